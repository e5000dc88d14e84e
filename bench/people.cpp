#include "bench/people.h"

#include <exception>
#include <iostream>
#include <utility>

#include "bench/people_scenes.h"

namespace tessera::bench {
namespace {

constexpr PeopleSize kPeopleFull{.starts = 20,
                                 .bodies = 2000,
                                 .viewers = 5,
                                 .rounds = 20,
                                 .span_s = 3,
                                 .slow_viewers = 50,
                                 .slow_rounds = 6,
                                 .slow_span_s = 10,
                                 .kills = 20,
                                 .players = 20,
                                 .swarm_rounds = 5,
                                 .swarm_span_s = 8,
                                 .page_rounds = 10};
constexpr PeopleSize kPeopleQuick{.starts = 3,
                                  .bodies = 2000,
                                  .viewers = 5,
                                  .rounds = 3,
                                  .span_s = 2,
                                  .slow_viewers = 50,
                                  .slow_rounds = 1,
                                  .slow_span_s = 4,
                                  .kills = 3,
                                  .players = 8,
                                  .swarm_rounds = 1,
                                  .swarm_span_s = 3,
                                  .page_rounds = 2};

struct PeopleScene {
  const char* name;
  absl::Status (*run)(const PeopleSize&, Report&);
};

constexpr PeopleScene kPeopleScenes[] = {{"ready", RunReady}, {"viewers", RunViewers}, {"slow", RunSlowViewers},
                                         {"gap", RunGap},     {"swarm", RunSwarm},     {"page", RunPage}};

absl::Status Try(const PeopleScene& scene, const PeopleSize& size, Report& report) {
  try {
    return scene.run(size, report);
  } catch (const std::exception& error) {  // a program could not be started
    return absl::InternalError(error.what());
  }
}

}  // namespace

absl::Status RunPeople(const SuiteOptions& options, Report& report) {
  const PeopleSize& size = options.quick ? kPeopleQuick : kPeopleFull;
  absl::Status worst = absl::OkStatus();
  for (const PeopleScene& scene : kPeopleScenes) {
    if (std::string(scene.name).find(options.only) == std::string::npos) continue;
    // A scene that fails is reported, and leaves the others their turn.
    const absl::Status status = Try(scene, size, report);
    if (!status.ok()) {
      std::cerr << "people: " << scene.name << ": " << status.message() << "\n";
      worst = status;
    }
    if (absl::Status saved = report.Save(); !saved.ok()) return saved;
  }
  return worst;
}

}  // namespace tessera::bench

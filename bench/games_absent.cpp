#include "bench/games_absent.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>

#include "absl/status/statusor.h"
#include "bench/callgrind.h"
#include "host/program_folder.h"

namespace tessera::bench {
namespace {

// Four regions, a grid of cells with as much to do, and bodies that cross; both versions have it.
absl::StatusOr<std::uint64_t> CountHandovers(const std::string& program, bool with_physics) {
  const Counted counted =
      with_physics ? Counted{} : Counted{Counted::Where::kOutside, "tessera::physics::World::Step(*"};
  return CountInstructions({program, "borders", "--only", "handover", "--quick"}, counted);
}

}  // namespace

absl::Status MeasureAbsent(Report& report) {
  const char* const other = std::getenv(kOtherBenchEnvironment);
  if (other == nullptr || *other == '\0') {
    std::cerr << "games: absent: not measured; it needs " << kOtherBenchEnvironment
              << "=PATH/tessera-bench of the version to compare with\n";
    return absl::OkStatus();
  }
  for (const bool with_physics : {true, false}) {
    const auto ours = CountHandovers(host::ProgramFolder() + "/tessera-bench", with_physics);
    if (!ours.ok()) return ours.status();
    const auto theirs = CountHandovers(other, with_physics);
    if (!theirs.ok()) return theirs.status();
    const double ratio = static_cast<double>(*ours) / static_cast<double>(*theirs);
    const char* const config = with_physics ? "all" : "outside physics";
    report.Add("absent", "tessera", config, "game_absent_ratio", ratio, "1");
    std::cerr << fmt::format("games: absent: {}: {} against {} instructions, ratio {:.4f}\n", config, *ours, *theirs,
                             ratio);
  }
  return absl::OkStatus();
}

}  // namespace tessera::bench

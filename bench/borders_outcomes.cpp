// Scenes that are judged by their outcome: within the spread of one world over jittered, shuffled runs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/borders_stage.h"
#include "bench/statistics.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/stacks.h"
#include "scenes/measured/structures.h"

namespace tessera::bench {
namespace {

constexpr double kJitter_m = 0.001;

// How one run came out.
struct BorderOutcome {
  std::vector<Vec3d> places;  // positions of the dynamic bodies, in the order of the scene
  std::vector<bool> stands;   // whether it is about as high as it was built
  double ghosts_per_body = 0, bytes_per_tick = 0;
};

struct Chaotic {
  std::string name;
  Scene scene;
  double seconds = 8;
  double cell_m = 20;
  bool pinned = false;
  std::vector<std::uint32_t> counts{2, 4};
  std::size_t judged = 0;  // so many dynamic bodies, the first; 0: all
  double stands_m = 0.3;   // a body stands if it ended at most so far above or below its start
};

BorderOutcome RunOnce(const Chaotic& chaotic, const Manner& manner, std::uint64_t seed) {
  const scenes::Jitter jitter = scenes::Jittered(chaotic.scene, seed, kJitter_m);
  const auto instance = Start(CutBy(jitter.scene, manner.regions, chaotic.cell_m), manner);
  const int ticks = static_cast<int>(60 * chaotic.seconds);
  instance->Ticks(ticks);
  BorderOutcome outcome;
  for (std::size_t i = 0; i < chaotic.scene.bodies.size(); ++i) {
    const BodyDef& body = chaotic.scene.bodies[i];
    if (body.motion != Motion::kDynamic) continue;
    if (chaotic.judged > 0 && outcome.places.size() == chaotic.judged) break;
    const Vec3d place = instance->StateOf(jitter.id_of[i]).position;
    outcome.places.push_back(place);
    outcome.stands.push_back(std::abs(place.y - body.initial.position.y) < chaotic.stands_m);
  }
  outcome.ghosts_per_body = instance->ghosts_per_body();
  outcome.bytes_per_tick = static_cast<double>(instance->frame_bytes()) / ticks;
  return outcome;
}

std::vector<BorderOutcome> RunAll(const Chaotic& chaotic, const Manner& manner, int runs) {
  std::vector<BorderOutcome> all;
  all.reserve(static_cast<std::size_t>(runs));
  for (int seed = 1; seed <= runs; ++seed) all.push_back(RunOnce(chaotic, manner, static_cast<std::uint64_t>(seed)));
  return all;
}

Vec3d MeanPlace(const std::vector<BorderOutcome>& runs, std::size_t body, std::size_t but) {
  Vec3d sum;
  double count = 0;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    if (run == but) continue;
    sum += runs[run].places[body];
    ++count;
  }
  return sum / count;
}

// Distance of every body of every run from the mean of the other runs of one world, m.
std::vector<double> Deviations(const std::vector<BorderOutcome>& runs, const std::vector<BorderOutcome>& one) {
  std::vector<double> all;
  all.reserve(runs.size() * one.front().places.size());
  for (std::size_t run = 0; run < runs.size(); ++run) {
    const std::size_t but = &runs == &one ? run : one.size();
    for (std::size_t body = 0; body < one.front().places.size(); ++body) {
      all.push_back(Length(runs[run].places[body] - MeanPlace(one, body, but)));
    }
  }
  return all;
}

double ShareStanding(const std::vector<BorderOutcome>& runs) {
  double stand = 0;
  for (const BorderOutcome& run : runs)
    stand += std::all_of(run.stands.begin(), run.stands.end(), [](bool b) { return b; });
  return stand / static_cast<double>(runs.size());
}

double MeanHeight(const std::vector<BorderOutcome>& runs) {
  double sum = 0, count = 0;
  for (const BorderOutcome& run : runs) {
    for (const Vec3d place : run.places) sum += place.y, ++count;
  }
  return sum / count;
}

void Judge(BorderStage& stage, const Chaotic& chaotic, const std::vector<Manner>& manners) {
  const int runs = stage.Few(16, 4);
  BorderStage::Progress(fmt::format("{}: one world, {} runs", chaotic.name, runs));
  const std::vector<BorderOutcome> one = RunAll(chaotic, Regions(1), runs);
  const double spread = Quantile(Deviations(one, one), 0.95);
  stage.Note(chaotic.name, "regions=1", "deviation_p95", spread, "m");
  stage.Note(chaotic.name, "regions=1", "stands", ShareStanding(one));
  for (const Manner& manner : manners) {
    BorderStage::Progress(fmt::format("{}: {}", chaotic.name, manner.name));
    const std::vector<BorderOutcome> many = RunAll(chaotic, manner, runs);
    const double deviation = Quantile(Deviations(many, one), 0.95);
    stage.Note(chaotic.name, manner.name, "deviation_p95", deviation, "m");
    stage.Note(chaotic.name, manner.name, "spread_ratio", deviation / spread);
    stage.Note(chaotic.name, manner.name, "sunk", MeanHeight(one) - MeanHeight(many), "m");
    stage.Note(chaotic.name, manner.name, "stands", ShareStanding(many));
    stage.Note(chaotic.name, manner.name, "outcome_equal", ShareStanding(many) == ShareStanding(one) ? 1 : 0);
    stage.Note(chaotic.name, manner.name, "ghosts_per_body", many.front().ghosts_per_body);
    stage.Note(chaotic.name, manner.name, "bytes_per_tick", many.front().bytes_per_tick, "bytes");
  }
}

void Judge(BorderStage& stage, const Chaotic& chaotic) {
  std::vector<Manner> manners;
  manners.reserve(chaotic.counts.size());
  for (const std::uint32_t regions : chaotic.counts) manners.push_back(Regions(regions, chaotic.pinned));
  Judge(stage, chaotic, manners);
}

void Piles(BorderStage& stage) {
  const int layers = stage.Few(15, 8);
  Judge(stage,
        {.name = "pyramid", .scene = scenes::Pyramid(layers), .seconds = 500.0 / 60, .cell_m = 40, .stands_m = 10});
}
// How deep a neighbour sees, by itself: nothing is shown as a whole.
void Depths(BorderStage& stage) {
  std::vector<Manner> manners;
  for (const std::uint32_t regions : {2U, 4U}) {
    for (const std::uint32_t depth : {0U, 1U, 2U, 4U}) {
      if (stage.quick() && depth > 1) continue;
      Manner manner = Regions(regions);
      manner.name += fmt::format(" depth={}", depth);
      manner.settings.ghost_depth = depth;
      manner.settings.whole_up_to = 0;
      manners.push_back(manner);
    }
  }
  Judge(stage, {.name = "depth of ghosts", .scene = scenes::Pyramid(8), .cell_m = 40, .stands_m = 10}, manners);
}
void Towers(BorderStage& stage) {
  Judge(stage, {.name = "tower on the line", .scene = scenes::TowerInTurn(10, false), .pinned = true, .counts = {2}});
  Judge(stage, {.name = "tower on the corner", .scene = scenes::TowerInTurn(10, true), .pinned = true, .counts = {4}});
}
void Walls(BorderStage& stage) {
  Judge(stage, {.name = "wall across", .scene = scenes::BrickWall(8, 8, false), .pinned = true});
  Judge(stage, {.name = "wall along", .scene = scenes::BrickWall(8, 8, true), .pinned = true, .counts = {2}});
}
void Hanging(BorderStage& stage) {
  Judge(stage, {.name = "bridge", .scene = scenes::Bridge(), .judged = 20, .stands_m = 2});
}

// --- Outcomes that are one number.

// Tiles that lie, and when the last one fell.
void Dominoes(BorderStage& stage) {
  constexpr int kCount = 80;
  std::vector<double> fallen;
  for (const std::uint32_t regions : {1U, 2U, 4U, 9U}) {
    Scene scene = scenes::DominoRow(kCount);
    const PartitionMap map = scenes::StripsOf(scene, regions, 44.0 / regions);
    const Manner manner = Regions(regions);
    const auto instance = Start({std::make_shared<const Scene>(scene), map}, manner);
    double last_s = 0, count = 0;
    for (int tick = 1; tick <= 60 * 20; ++tick) {
      instance->Tick();
      if (last_s == 0 && instance->StateOf(BodyId(kCount + 1)).position.y < 0.5) last_s = tick / 60.0;
    }
    for (std::uint64_t id = 2; id <= kCount + 1; ++id) count += instance->StateOf(BodyId(id)).position.y < 0.6 ? 1 : 0;
    fallen.push_back(count);
    stage.Note("dominoes", manner.name, "fallen", count);
    stage.Note("dominoes", manner.name, "last_fell_after", last_s, "s");
    if (regions > 1) stage.Note("dominoes", manner.name, "outcome_equal", count == fallen.front() ? 1 : 0);
  }
}

// A cart that started `aside_m` further along, after 8 s.
struct Drive {
  double way_m, crate_slid_m;
  std::uint64_t handovers;
};
Drive DriveOnce(std::uint32_t regions, double aside_m) {
  scenes::Vehicle drive = scenes::Drive(-12);
  for (BodyDef& body : drive.scene.bodies) {
    if (body.motion == Motion::kDynamic) body.initial.position.x += aside_m;
  }
  const PartitionMap map = scenes::StripsOf(drive.scene, regions, 36.0 / regions);
  const auto instance = Start({std::make_shared<const Scene>(drive.scene), map}, Regions(regions));
  const double from = instance->StateOf(drive.chassis).position.x;
  instance->Ticks(60 * 8);
  const BodyState chassis = instance->StateOf(drive.chassis), crate = instance->StateOf(drive.crate);
  const Vec3d seat = Rotate(Conjugate(chassis.orientation), crate.position - chassis.position);
  return {chassis.position.x - from, std::hypot(seat.x, seat.z), instance->handovers()};
}

// Where a wheel meets a sill decides by how much it is slowed: a start that differs by a hundred-millionth of a metre
// ends by some decimetres elsewhere.
void Vehicle(BorderStage& stage) {
  constexpr double kOverBothSills_m = 20, kOnTheBed_m = 1;
  const int runs = stage.Few(16, 4);
  double mean = 0, spread = 0, arrived = 0;
  for (const std::uint32_t regions : {1U, 2U, 4U, 9U}) {
    std::vector<Drive> drives;
    drives.reserve(static_cast<std::size_t>(runs));
    for (int run = 0; run < runs; ++run) drives.push_back(DriveOnce(regions, kJitter_m * (2.0 * run / runs - 1)));
    const auto share = [&](const auto& what) {
      double sum = 0;
      for (const Drive& drive : drives) sum += what(drive);
      return sum / runs;
    };
    const double way = share([](const Drive& drive) { return drive.way_m; });
    const double there = share([](const Drive& drive) {
      return drive.way_m > kOverBothSills_m && drive.crate_slid_m < kOnTheBed_m ? 1.0 : 0.0;
    });
    if (regions == 1) mean = way, arrived = there;
    std::vector<double> deviations;
    deviations.reserve(drives.size());
    for (const Drive& drive : drives) deviations.push_back(std::abs(drive.way_m - mean));
    const double deviation = Quantile(deviations, 0.95);
    if (regions == 1) spread = deviation;
    const std::string name = Regions(regions).name;
    stage.Note("vehicle", name, "way", way, "m");
    stage.Note("vehicle", name, "deviation_p95", deviation, "m");
    stage.Note("vehicle", name, "crate_slid", share([](const Drive& drive) { return drive.crate_slid_m; }), "m");
    stage.Note("vehicle", name, "handovers", share([](const Drive& d) { return static_cast<double>(d.handovers); }));
    if (regions == 1) continue;
    stage.Note("vehicle", name, "spread_ratio", deviation / spread);
    stage.Note("vehicle", name, "outcome_equal", there == arrived && there > 0 ? 1 : 0);
  }
}

}  // namespace

std::vector<BorderCheck> OutcomeChecks() {
  return {{"pyramid", Piles},  {"depth of ghosts", Depths}, {"tower", Towers},   {"wall", Walls},
          {"bridge", Hanging}, {"dominoes", Dominoes},      {"vehicle", Vehicle}};
}

}  // namespace tessera::bench

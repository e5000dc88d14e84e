// Structures that stand by friction and balance: Kapla tower, card house, arch, dominoes; and thin boxes on waves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bench/stability_stage.h"
#include "scenes/measured/crowds.h"
#include "scenes/measured/structures.h"

namespace tessera::bench {
namespace {

// Until its last block, which lies on the topmost floor, has come down by a layer.
absl::Status Kapla(StabilityStage& stage) {
  const double seconds = stage.quick() ? 10 : 600;
  const Scene scene = scenes::KaplaTower();
  absl::StatusOr<Run> run = stage.Start(scene, 100);
  if (!run.ok()) return run.status();
  const BodyDef& last = scene.bodies.back();
  bool standing = true;
  while (standing && run->time_s() < seconds - 1e-6) {
    run->Seconds(0.5);
    standing = run->StateOf(last.id).position.y > last.initial.position.y - scenes::kKaplaLayer_m;
  }
  stage.Note("kapla", "hz=100", "standing", standing);
  stage.Note("kapla", "hz=100", "stood_s", run->time_s(), "s");
  stage.Note("kapla", "hz=100", "drift_m", DisplacementOf(*run, scene).any_m, "m");
  stage.Cost("kapla", "hz=100", run->cpu_us_per_tick());
  return absl::OkStatus();
}

// Whether nothing has moved by more than `moved_m` after `seconds`, at 60 and at 240 Hz.
absl::Status StandsAtBothRates(StabilityStage& stage, const std::string& name, const Scene& scene, double seconds,
                               double moved_m) {
  bool outcome[2] = {};
  const double rates[2] = {60, 240};
  for (int i = 0; i < 2; ++i) {
    absl::StatusOr<Run> run = stage.Start(scene, rates[i]);
    if (!run.ok()) return run.status();
    run->Seconds(seconds);
    const Displacement moved = DisplacementOf(*run, scene);
    outcome[i] = moved.any_m < moved_m;
    const std::string config = fmt::format("hz={:g}", rates[i]);
    stage.Note(name, config, "standing", outcome[i]);
    stage.Note(name, config, "moved_m", moved.any_m, "m");
    stage.Note(name, config, "residual_speed", FastestOf(*run, scene), "m/s");
    stage.Cost(name, config, run->cpu_us_per_tick());
  }
  stage.Note(name, "60 against 240 Hz", "same_outcome", outcome[0] == outcome[1]);
  return absl::OkStatus();
}

absl::Status Cards(StabilityStage& stage) {
  return StandsAtBothRates(stage, "card_house", scenes::CardHouse(), stage.quick() ? 4 : 20, 0.05);
}

absl::Status StoneArch(StabilityStage& stage) {
  return StandsAtBothRates(stage, "arch", scenes::Arch(), stage.quick() ? 4 : 20, 0.3);
}

absl::Status FallingDominoes(StabilityStage& stage) {
  constexpr double kSeconds = 40, kUpright = 0.94;  // cosine of 20 degrees
  const Scene scene = scenes::Dominoes();
  int fallen[2] = {};
  const double rates[2] = {60, 240};
  for (int i = 0; i < 2; ++i) {
    absl::StatusOr<Run> run = stage.Start(scene, rates[i]);
    if (!run.ok()) return run.status();
    double last_s = 0;
    for (; run->time_s() < kSeconds - 1e-6; run->Seconds(0.25)) {
      int now = 0;
      for (const BodyDef& body : scene.bodies) {
        if (body.motion == Motion::kStatic) continue;
        now += Rotate(Quatd(run->StateOf(body.id).orientation), Vec3d{0, 1, 0}).y < kUpright;
      }
      if (now > fallen[i]) last_s = run->time_s();
      fallen[i] = now;
    }
    const std::string config = fmt::format("hz={:g}", rates[i]);
    stage.Note("dominoes", config, "fallen", fallen[i]);
    stage.Note("dominoes", config, "last_fell_s", last_s, "s");
    stage.Cost("dominoes", config, run->cpu_us_per_tick());
  }
  stage.Note("dominoes", "60 against 240 Hz", "same_outcome", fallen[0] == fallen[1]);
  return absl::OkStatus();
}

absl::Status ThinBoxes(StabilityStage& stage) {
  constexpr double kStill_m_s = 0.05;
  const double seconds = stage.quick() ? 4 : 20;
  const Scene scene = scenes::ThinBoxesOnWaves(stage.quick() ? 100 : 400);
  absl::StatusOr<Run> run = stage.Start(scene);
  if (!run.ok()) return run.status();
  double settled_s = seconds;
  bool still = false;
  while (run->time_s() < seconds - 1e-6) {
    run->Seconds(0.1);
    const bool now = FastestOf(*run, scene) < kStill_m_s;
    if (now && !still) settled_s = run->time_s();
    if (!now) settled_s = seconds;
    still = now;
  }
  int through = 0;
  for (const BodyDef& body : scene.bodies) through += !(run->StateOf(body.id).position.y > scenes::kWaveFloor_m);
  stage.Note("thin_boxes", "hz=60", "fallen_through", through);
  stage.Note("thin_boxes", "hz=60", "settled_s", settled_s, "s");
  stage.Note("thin_boxes", "hz=60", "residual_speed", FastestOf(*run, scene), "m/s");
  stage.Cost("thin_boxes", "hz=60", run->cpu_us_per_tick());
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> StructureChecks() {
  return {{"kapla", Kapla, true},
          {"card_house", Cards, true},
          {"arch", StoneArch, true},
          {"dominoes", FallingDominoes},
          {"thin_boxes", ThinBoxes, true}};
}

}  // namespace tessera::bench

// At the edges: far from the origin, and numbers that no world should take in.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "bench/stability_stage.h"
#include "bench/thread_cpu.h"
#include "core/physics/world.h"
#include "core/world/scene_load.h"
#include "core/world/state_check.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/linkages.h"
#include "scenes/measured/stacks.h"

namespace tessera::bench {
namespace {

// Places on a grid of a micrometre, which a double holds 10 000 km away too: the runs then begin the same to the bit.
Scene OnGrid(Scene scene) {
  const auto snap = [](double x) { return std::nearbyint(x * 0x1p20) * 0x1p-20; };
  for (BodyDef& body : scene.bodies) {
    Vec3d& p = body.initial.position;
    p = {snap(p.x), snap(p.y), snap(p.z)};
  }
  return scene;
}

// The largest distance of any body from where the same run at the origin has it, after ten seconds. A region's local
// coordinates are about its own origin, which for Tessera lies where the scene is.
absl::Status FarAway(StabilityStage& stage) {
  const double seconds = stage.quick() ? 3 : 10;
  const std::map<std::string, Scene> scenes{{"far_stack", OnGrid(scenes::Tower(10, 0.01))},
                                            {"far_pyramid", OnGrid(scenes::Pyramid(5))},
                                            {"far_ragdoll", OnGrid(scenes::Ragdolls(1))}};
  for (const auto& entry : scenes) {
    const std::string& name = entry.first;
    const Scene& at_origin = entry.second;
    std::vector<Vec3d> truth;
    const auto compare = [&](Vec3d by, Vec3d origin, const std::string& config) -> absl::Status {
      Scene scene = at_origin;
      scenes::Shift(scene, by);
      absl::StatusOr<Run> run = stage.Start(scene, 60, origin);
      if (!run.ok()) return run.status();
      run->Seconds(seconds);
      double most = 0;
      for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const Vec3d place = run->StateOf(scene.bodies[i].id).position - by;
        if (truth.size() < scene.bodies.size()) truth.push_back(place);  // the first run
        const double off = Length(place - truth[i]);
        if (!(off <= most)) most = off;
      }
      stage.Note(name, config, "off_m", most, "m");
      stage.Cost(name, config, run->cpu_us_per_tick());
      return absl::OkStatus();
    };
    absl::Status status;
    for (const double km : {0.0, 10.0, 100.0, 1000.0, 10'000.0}) {
      const Vec3d by{km * 700, 0, km * 700};
      if (status.ok()) status = compare(by, by, fmt::format("km={:g}", km));
    }
    // The scene's own answer to so small a change: it starts a nanometre aside.
    if (status.ok()) status = compare({1e-9, 0, 1e-9}, {}, "nudged=1nm");
    if (!status.ok() && !absl::IsUnimplemented(status)) return status;
  }
  return absl::OkStatus();
}

constexpr const char* kAbsurd[] = {"nan", "inf", "-inf", "1e30", "-1e30"};

// A good scene in which one number is replaced by a bad one.
absl::Status ResolveWith(const std::string& field, const std::string& number) {
  std::map<std::string, std::string> numbers{
      {"gravity", "-9.81"},      {"mass", "1"},           {"position", "2"},   {"linear_velocity", "0"},
      {"angular_velocity", "0"}, {"half_extents", "0.5"}, {"friction", "0.5"}, {"max_force", "1"}};
  numbers.at(field) = number;
  const std::string text = fmt::format(
      R"(name: "absurd" bounds {{ min {{ x: -50 y: -50 z: -50 }} max {{ x: 50 y: 50 z: 50 }} }} gravity {{ y: {} }}
         materials {{ name: "wood" friction: {} }}
         bodies {{ id: 7 mass: {} material: "wood" shape {{ box {{ half_extents {{ x: {} y: 1 z: 1 }} }} }}
                   pose {{ position {{ y: {} }} }} linear_velocity {{ x: {} }} angular_velocity {{ x: {} }} }}
         joints {{ id: 1 body_a: 7 hinge {{ motor {{ target_velocity: 1 max_force: {} }} }} }})",
      numbers["gravity"], numbers["friction"], numbers["mass"], numbers["half_extents"], numbers["position"],
      numbers["linear_velocity"], numbers["angular_velocity"], numbers["max_force"]);
  return LoadScene(SceneForm::kText, text, "scene").status();
}

absl::Status AbsurdScenes(StabilityStage& stage) {
  int asked = 0, refused = 0;
  for (const char* field : {"gravity", "mass", "position", "linear_velocity", "angular_velocity", "half_extents",
                            "friction", "max_force"}) {
    if (const absl::Status good = ResolveWith(field, "1"); !good.ok()) return good;
    for (const char* number : kAbsurd) {
      const absl::Status status = ResolveWith(field, number);
      ++asked;
      refused += !status.ok() && std::string(status.message()).find(field) != std::string::npos;
    }
  }
  stage.Note("absurd_scene", "fields=8", "refused_share", static_cast<double>(refused) / asked);
  return absl::OkStatus();
}

// Bad input after the scene: states, forces and torques.
absl::Status AbsurdStates(StabilityStage& stage) {
  const float absurd[] = {std::nanf(""), HUGE_VALF, -HUGE_VALF, 1e30f, -1e30f};
  int asked = 0, refused = 0;
  const auto expect_named = [&](const absl::Status& status, const char* field) {
    const std::string text(status.message());
    ++asked;
    refused += !status.ok() && text.find("body 7") != std::string::npos && text.find(field) != std::string::npos;
  };
  const BodyId id(7);
  for (const float number : absurd) {
    BodyState state;
    state.position.y = number;
    expect_named(CheckState(id, state), "position");
    state = {};
    state.orientation.x = number;
    expect_named(CheckState(id, state), "orientation");
    state = {};
    state.linear_velocity.z = number;
    expect_named(CheckState(id, state), "linear_velocity");
    state = {};
    state.angular_velocity.x = number;
    expect_named(CheckState(id, state), "angular_velocity");
    expect_named(CheckForce(id, {number, 0, 0}, {}), "force_n");
    expect_named(CheckForce(id, {}, {0, 0, number}), "torque_nm");
  }
  if (!CheckState(id, {}).ok() || !CheckForce(id, {1, 2, 3}, {}).ok()) {
    return absl::InternalError("a good state or force is refused");
  }
  stage.Note("absurd_state", "fields=6", "refused_share", static_cast<double>(refused) / asked);
  return absl::OkStatus();
}

// The topmost of ten boxes is pushed by a force that is no number, past the checks: it alone is taken out, and those
// below it stay as they were.
absl::Status Isolation(StabilityStage& stage) {
  const float absurd[] = {std::nanf(""), HUGE_VALF, 1e30f};
  int alone = 0;
  double stirred = 0;
  const double begin = ThreadCpuSeconds();
  for (const float force : absurd) {
    const Scene scene = scenes::Tower(10);
    physics::World world({.gravity_m_s2 = scene.gravity_m_s2});
    for (const BodyDef& body : scene.bodies) world.Add(body, body.initial);
    for (int step = 0; step < 60; ++step) world.Step(1.0 / 60);
    std::vector<Vec3d> before;
    for (const BodyDef& body : scene.bodies) before.push_back(world.StateOf(body.id).position);
    const BodyId top = scene.bodies.back().id;
    world.ApplyForce(top, {0, force, 0}, {});
    std::vector<BodyId> isolated;
    for (int step = 0; step < 60; ++step) {
      world.Step(1.0 / 60);
      isolated.insert(isolated.end(), world.isolated().begin(), world.isolated().end());
    }
    alone += isolated == std::vector<BodyId>{top};
    for (std::size_t i = 0; i + 1 < scene.bodies.size(); ++i) {
      const double moved = Length(world.StateOf(scene.bodies[i].id).position - before[i]);
      if (!(moved <= stirred)) stirred = moved;
    }
  }
  stage.Note("absurd_force", "boxes=10", "isolated_alone_share", alone / 3.0);
  stage.Note("absurd_force", "boxes=10", "neighbours_moved_m", stirred, "m");
  stage.Cost("absurd_force", "boxes=10", (ThreadCpuSeconds() - begin) * 1e6 / (3 * 120));
  return absl::OkStatus();
}

}  // namespace

std::vector<Check> BoundaryChecks() {
  return {{"far", FarAway, true},
          {"absurd_scene", AbsurdScenes},
          {"absurd_force", Isolation},
          {"absurd_state", AbsurdStates}};
}

}  // namespace tessera::bench

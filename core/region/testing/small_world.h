// SmallWorld: a few bodies in a square of cells, and what region 1 has of them. For tests of a region's parts.
//
//   SmallWorld world(Balls({{-1, 0, 0}, {1, 0, 0}}));   // body 1 in region 1, body 2 in region 2
//   world.Own(1);
//   world.AddGhost(2, 2);
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/neighborhood.h"

namespace tessera::region {

constexpr RegionId kOne{1}, kTwo{2}, kThree{3}, kFour{4};

// Balls of half a metre and 1 kg without gravity, from -10 to 10 in x and z; ids count from 1.
inline Scene Balls(const std::vector<Vec3d>& places) {
  Scene scene;
  scene.bounds = {{-10, -10, -10}, {10, 10, 10}};
  scene.gravity_m_s2 = {};
  for (const Vec3d place : places) {
    BodyDef def;
    def.id = BodyId(scene.bodies.size() + 1);
    def.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
    def.initial.position = place;
    scene.bodies.push_back(std::move(def));
  }
  return scene;
}

inline void AllowPlayers(Scene& scene) {
  PlayerRules& rules = scene.player.emplace();
  rules.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  rules.spawn_points = {{-5, 0, -5}};
  rules.max_force_n = 20;
  rules.max_speed_m_s = 5;
}

inline void Join(Scene& scene, std::uint64_t a, std::uint64_t b) {
  JointDef joint;
  joint.id = JointId(static_cast<std::uint32_t>(scene.joints.size() + 1));
  joint.body_a = BodyId(a);
  joint.body_b = BodyId(b);
  joint.kind = PointJoint{};
  scene.joints.push_back(joint);
}

struct SmallWorld {
  static constexpr double kTick_s = 1.0 / 60;

  explicit SmallWorld(Scene built, std::uint32_t regions = 2)
      : scene(std::make_shared<const Scene>(std::move(built))),
        catalog(scene),
        neighborhood(RegionId(1), *MakeGridMap(scene->ground(), regions)),
        bodies(catalog, {.gravity_m_s2 = scene->gravity_m_s2}) {}

  BodyState InitialOf(std::uint64_t id) const { return catalog.Find(BodyId(id))->initial; }
  void Own(std::uint64_t id) { Own(id, InitialOf(id)); }
  void Own(std::uint64_t id, const BodyState& state, Epoch epoch = Epoch(1)) {
    bodies.Own(BodyId(id), epoch, state);
    bodies.ConnectJoints();
    bodies.NotePlaces();
  }
  void AddGhost(std::uint64_t id, std::uint32_t owner) { AddGhost(id, owner, InitialOf(id)); }
  void AddGhost(std::uint64_t id, std::uint32_t owner, const BodyState& state, Epoch epoch = Epoch(1)) {
    Ghost ghost;
    ghost.record.id = BodyId(id);
    ghost.record.epoch = epoch;
    ghost.record.state = state;
    ghost.owner = RegionId(owner);
    ghost.reported = true;
    ghosts.push_back(ghost);
    bodies.PlaceGhosts(ghosts);
    bodies.ConnectJoints();
    bodies.NotePlaces();
  }
  void Step() {
    bodies.NotePlaces();
    bodies.Step(kTick_s, tick);
    ++tick;
    bodies.ReadBack();
    bodies.NotePlaces();
  }

  const std::shared_ptr<const Scene> scene;
  const Catalog catalog;
  Neighborhood neighborhood;
  Bodies bodies;
  std::vector<Ghost> ghosts;  // ascending
  Tick tick;
};

}  // namespace tessera::region

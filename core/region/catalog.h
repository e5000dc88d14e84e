// Catalog: a scene as a region looks things up in it: bodies by id, and which bodies joints tie into one assembly.
//
// An assembly is a set of dynamic bodies connected by joints; it has one owner and moves as one. Static bodies and the
// world tie nothing: every region has them. A body without joints is an assembly of itself; so is a player's. Bodies
// that a game makes are known by their ids alone. Thread rule: immutable after construction.
#pragma once

#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/region/assembly.h"
#include "core/world/prefab.h"
#include "core/world/scene.h"

namespace tessera::region {

class Catalog {
 public:
  // `game`: whether a game runs in the world, which may push any body.
  explicit Catalog(std::shared_ptr<const Scene> scene, bool game = false);

  const Scene& scene() const { return *scene_; }
  bool has_game() const { return has_game_; }
  // A dynamic body of the scene, a player's if the scene has players, or one of a prefab's; and the world itself where
  // a game runs in it.
  bool Known(BodyId id) const;
  // The definition of one of the scene's bodies, or a prefab's of a body that a game makes, which then has another id;
  // null for players' bodies and unknown ids.
  const BodyDef* Find(BodyId id) const;
  // `Known(id)`, and it is a body. kg.
  double MassOf(BodyId id) const;
  // Where the record of the world belongs: a point on the ground, from which its owner follows by any map.
  Vec3d InstancePlace() const;
  BodyDef MakePlayer(PlayerNumber player) const;  // requires scene().player

  // Whether any two bodies may be jointed.
  bool has_joints() const { return has_joints_; }
  // Bodies of the same assembly, `id` among them.
  Assembly AssemblyOf(BodyId id) const;
  // Joints that hold bodies of its assembly, ascending.
  void ForEachJoint(BodyId id, absl::FunctionRef<void(const JointDef&)> visit) const;

 private:
  struct Jointed {
    std::vector<BodyId> bodies;
    std::vector<const JointDef*> joints;
  };
  // Bodies of the scene whose ids count up without a gap. There are few of these, and every body that a frame or log
  // names is looked up in every tick.
  struct IdRun {
    BodyId first;
    std::size_t begin = 0, end = 0;  // indices into the scene's bodies
  };
  bool Dynamic(BodyId id) const;

  std::shared_ptr<const Scene> scene_;
  bool has_game_, has_joints_;
  std::vector<IdRun> runs_;  // ascending
  std::vector<Jointed> assemblies_;
  std::unordered_map<BodyId, std::size_t> assembly_of_;  // for bodies with joints
};

}  // namespace tessera::region

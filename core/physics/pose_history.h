// PoseHistory: where the bodies of a world that may move were after each of the last ticks, so that a query can look
// back.
//
//   PoseHistory history(40);
//   history.Note(Tick(7), bodies, {.own = owned, .ghosts = ghosts, .fixed = on_paths});   // after each step
//   if (history.Covers(6.25)) history.Visit(6.25, QueryScope::kSeen, bodies, may_meet, visit);
//
// Between two ticks a body is on the straight line from one pose to the other; one that was put elsewhere stays where
// it was until then. A body that has left the world since is still known by its geometry.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/physics/body_store.h"
#include "core/physics/collide/geometry.h"
#include "core/physics/noted_bodies.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/query.h"

namespace tessera::physics {

// One body as it was.
struct PastBody {
  BodyId id;
  const Geometry* geometry = nullptr;
  std::uint32_t layer = 0;  // index
  bool dynamic = false, trigger = false;
  Vec3d position;  // its centre of mass
  Quatd orientation;
};

class PoseHistory {
 public:
  // Keeps so many ticks.
  explicit PoseHistory(std::size_t ticks) : most_(ticks) {}

  // Where the bodies are after the step to `tick`. A tick that does not follow the last one begins anew.
  void Note(Tick tick, double tick_s, const BodyStore& bodies, const NotedBodies& noted);
  // The body is about to leave the world.
  void Left(const RigidBody& body);
  void Forget();

  // Whether the poses of this moment, a tick and a part of one, are here.
  bool Covers(double at) const;
  // Bodies that there were at the moment nearest to `at` which is here, of this scope, in no order, but for those that
  // `may_meet` leaves out by a ball that holds the body. `visit` also gets the radius of the ball about the body's
  // middle, and returns whether to go on.
  void Visit(double at, QueryScope scope, const BodyStore& bodies,
             absl::FunctionRef<bool(Vec3d middle, double radius_m)> may_meet,
             absl::FunctionRef<bool(const PastBody&, double radius_m)> visit) const;

 private:
  struct Pose {
    BodyId id;
    Vec3d position;
    Quatd orientation;
    float radius_m = 0, speed_m_s = 0;
  };
  struct Frame {
    Tick tick;
    std::vector<Pose> own, ghosts, fixed;  // each ascending
  };
  struct Gone {
    Tick since;  // the last tick that was noted
    std::shared_ptr<const Geometry> geometry;
    std::uint32_t layer = 0;
    bool dynamic = false, trigger = false;
  };
  // The last frame at or before the moment, or the nearest one. Requires that there is one.
  std::size_t FrameAt(double at, double* part) const;
  static void Fill(const BodyStore& bodies, std::span<const BodyId> ids, std::vector<Pose>& poses);
  static const Pose* Find(const Frame& frame, BodyId id);
  Pose Between(const Pose& from, const Pose* to, double part) const;

  const std::size_t most_;
  double tick_s_ = 0;
  std::deque<Frame> frames_;  // frames of ticks that follow each other
  std::map<BodyId, Gone> gone_;
  std::deque<std::pair<Tick, BodyId>> left_;  // in which order they went, so that none is looked at before its time
};

}  // namespace tessera::physics

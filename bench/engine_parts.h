// EngineParts: shared by the adapters of bench/engine.h: how a body of the scene sits in an engine that wants the
// centre of mass as origin and the principal axes as axes.
//
// Pure functions, any thread.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "bench/engine.h"
#include "core/world/scene.h"

namespace tessera::bench {

// Frame of the mass in the shape's coordinates; none for a static body.
struct MassFrame {
  Vec3d origin;
  Quatd axes;
  Vec3d inertia_kg_m2;  // principal

  // The shape's coordinates as seen from here.
  Pose ShapePose() const { return {Rotate(Conjugate(axes), -origin), Conjugate(axes)}; }
  bool trivial() const { return origin == Vec3d() && axes == Quatd(); }
};
MassFrame MassFrameOf(const BodyDef& def);

// `inner` in the coordinates that `outer` is given in.
Pose Compose(const Pose& outer, const Pose& inner);
// A turn that leads z to `direction`, a unit vector.
Quatd TurnFromZ(Vec3d direction);
// A joint's frame, given in the shape's coordinates, as seen from the mass.
Pose JointFrame(const MassFrame& mass, const Pose& in_shape);

// Pairs' friction and restitution, as core/world/scene.h has them.
double PairFriction(const Material& a, const Material& b);
double PairRestitution(const Material& a, const Material& b);

// The one restitution of all pairs, for engines that know no rule of pairs like ours: -1 if there is no such one.
double CommonRestitution(const Scene& scene);
// That a scene asks for what an engine has not.
absl::Status Lacking(std::string_view engine, std::string_view what);

std::unique_ptr<Engine> MakeTesseraEngine(const EngineConfig& config);
std::unique_ptr<Engine> MakeBulletEngine(const EngineConfig& config);
std::unique_ptr<Engine> MakeOdeEngine(const EngineConfig& config);
std::unique_ptr<Engine> MakeMujocoEngine(const EngineConfig& config);
std::unique_ptr<Engine> MakeBox3dEngine(const EngineConfig& config);
std::unique_ptr<Engine> MakeJoltEngine(const EngineConfig& config);

}  // namespace tessera::bench

// The packed form of bodies, joints and prefabs.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <memory>
#include <span>

#include "core/world/packed_io.h"
#include "core/world/packed_shape.h"
#include "core/world/scene.h"
#include "core/world/spawned_id.h"

namespace tessera::packed {

// Tables that the parts of a scene refer to.
struct Context {
  ShapeTable& shapes;
  std::span<const PropertyDef> properties;
  std::size_t kinds = 0, layers = 0;
};

// Where a body, or what is made of it, may be.
struct BodyLimits {
  std::uint64_t least_id = 1, most_id = kFirstPlayerBody - 1;
  double position_m = kMaxCoordinate_m;
};

template <class Io, class T>
void MaterialOf(Io& io, T& material) {
  io.Real("friction", material.friction, 0, kMaxFriction);
  io.Real("rolling_friction", material.rolling_friction, 0, kMaxFriction);
  io.Real("spinning_friction", material.spinning_friction, 0, kMaxFriction);
  io.Real("restitution", material.restitution, 0, 1);
}

inline bool SameBits(const Material& a, const Material& b) {
  return SameBits(a.friction, b.friction) && SameBits(a.rolling_friction, b.rolling_friction) &&
         SameBits(a.spinning_friction, b.spinning_friction) && SameBits(a.restitution, b.restitution);
}

template <class Io, class T>
void PathOf(Io& io, T& path) {
  double before_s = 0;
  io.List("points", path.points, 1, kMaxPathPoints, 64, [&](auto& point) {
    const bool first = &point == &path.points.front();
    io.Real("time_s", point.time_s, first ? 0 : before_s + kMinPathTime_s / 2, first ? 0 : 2 * kMaxPathTime_s);
    before_s = point.time_s;
    PoseOf(io, "pose", point.pose, kMaxCoordinate_m);
  });
  io.Choice("repeat", path.repeat, PathRepeat::kOnce);
  io.Vector("spin_rad_s", path.spin_rad_s, kMaxPathSpin_rad_s);
}

template <class Io, class T>
void StateOf(Io& io, T& state, const BodyLimits& limits) {
  const BodyState usual;
  const std::uint32_t parts =
      io.Parts("state", {!SameBits(state.orientation, usual.orientation),
                         !SameBits(state.linear_velocity, usual.linear_velocity),
                         !SameBits(state.angular_velocity, usual.angular_velocity),
                         !SameBits(state.angular_momentum, usual.angular_momentum), state.still_s != 0, state.asleep});
  io.Vector("position", state.position, limits.position_m);
  if ((parts & 1) != 0) io.Turn("orientation", state.orientation);
  if ((parts & 2) != 0) io.Vector("linear_velocity", state.linear_velocity, kMaxSpeed_m_s);
  if ((parts & 4) != 0) io.Vector("angular_velocity", state.angular_velocity, kMaxAngularSpeed_rad_s);
  if ((parts & 8) != 0) io.Vector("angular_momentum", state.angular_momentum, kMaxStateAngularMomentum);
  if ((parts & 16) != 0) io.Real("still_s", state.still_s, 0, kMaxPathTime_s);
  if constexpr (Io::kReads) state.asleep = (parts & 32) != 0;
}

// Values of a body's properties, as PropertySet encodes them.
inline void SetOf(PackWriter& io, const PropertySet& set, const Context&) {
  io.Block("properties", set.Encode(), kMaxPropertyBytes);
}
inline void SetOf(PackReader& io, PropertySet& set, const Context& context) {
  std::vector<std::uint8_t> bytes;
  io.Block("properties", bytes, kMaxPropertyBytes);
  if (!io.ok()) return;
  absl::StatusOr<PropertySet> read = PropertySet::Decode(bytes, context.properties);
  if (!read.ok()) return io.Fail("properties", std::string(read.status().message()));
  set = *std::move(read);
}

inline void PathPointerOf(PackWriter& io, const std::shared_ptr<const BodyPath>& path) { PathOf(io, *path); }
inline void PathPointerOf(PackReader& io, std::shared_ptr<const BodyPath>& path) {
  auto made = std::make_shared<BodyPath>();
  PathOf(io, *made);
  path = std::move(made);
}

// Checks that the fields of a body go together.
inline void CheckBody(PackReader& io, const BodyDef& body) {
  if (!io.ok()) return;
  const bool dynamic = body.motion == Motion::kDynamic;
  if (dynamic && IsForStaticBodies(*body.shape)) io.Fail("shape", "is for static bodies only");
  if (dynamic && !body.kinematic && body.mass_kg < kMinMass_kg) io.Fail("mass_kg", absl::StrCat(body.mass_kg));
  if ((!dynamic || body.kinematic) && body.mass_kg != 0) io.Fail("mass_kg", "is of a body that nothing pushes");
  if (body.path != nullptr && (dynamic || !body.kinematic)) io.Fail("path", "is not of a kinematic body");
  if (body.visible_to == Visibility::kPlayer) io.Fail("visible_to", "is not of a body");
}

template <class Io, class T>
void InertiaOf(Io& io, T& body) {
  if constexpr (Io::kReads) body.inertia_kg_m2.emplace();
  const double most = body.mass_kg * kMaxInertiaOfMass_m2, least = body.mass_kg * kMinInertiaOfMass_m2;
  for (auto* moment : {&body.inertia_kg_m2->x, &body.inertia_kg_m2->y, &body.inertia_kg_m2->z}) {
    io.Real("inertia_kg_m2", *moment, least, most);
  }
}

template <class Io, class T>
void BodyOf(Io& io, T& body, const Context& context, const BodyLimits& limits = {}) {
  const BodyDef usual;
  const bool damped = !SameBits(body.linear_damping, 0) || !SameBits(body.angular_damping, 0);
  const bool on_layer = body.layer != usual.layer;
  const std::uint32_t parts = io.Parts(
      "body", {!body.name.empty(), body.path != nullptr, !SameBits(body.mass_kg, usual.mass_kg),
               body.inertia_kg_m2.has_value(), !SameBits(body.material, usual.material), damped,
               !SameBits(body.gravity_scale, usual.gravity_scale), on_layer, body.kind != 0, !body.properties.empty(),
               body.motion == Motion::kStatic, body.kinematic, body.trigger, !body.may_sleep});
  io.Number("id", body.id, limits.least_id, limits.most_id);
  context.shapes.Reference(io, "shape", body.shape);
  if ((parts & 1) != 0) io.Text("name", body.name, kMaxNameLength);
  if ((parts & 2) != 0) PathPointerOf(io, body.path);
  if ((parts & 4) != 0) io.Real("mass_kg", body.mass_kg, 0, kMaxMass_kg);
  if ((parts & 8) != 0) InertiaOf(io, body);
  if ((parts & 16) != 0) MaterialOf(io, body.material);
  if ((parts & 32) != 0) {
    io.Real("linear_damping", body.linear_damping, 0, 1);
    io.Real("angular_damping", body.angular_damping, 0, 1);
  }
  if ((parts & 64) != 0) io.Real("gravity_scale", body.gravity_scale, -1000, 1000);
  if ((parts & 128) != 0) {
    io.Number("layer", body.layer.index, 0, context.layers - 1);
    io.Number("collides", body.layer.collides, 0, ~0u);
  }
  if ((parts & 256) != 0) io.Number("kind", body.kind, 0, context.kinds - 1);
  if ((parts & 512) != 0) SetOf(io, body.properties, context);
  io.Choice("visible_to", body.visible_to, Visibility::kTeam);
  StateOf(io, body.initial, limits);
  if constexpr (Io::kReads) {
    body.motion = (parts & 1024) != 0 ? Motion::kStatic : Motion::kDynamic;
    body.kinematic = (parts & 2048) != 0;
    body.trigger = (parts & 4096) != 0;
    body.may_sleep = (parts & 8192) == 0;
    CheckBody(io, body);
  }
}

// Least bytes of a body and of a joint.
inline constexpr std::size_t kMinBodyBytes = 1 + 1 + 1 + 1 + 1 + 24, kMinJointBytes = 3 + 2 * 56 + 2;

}  // namespace tessera::packed

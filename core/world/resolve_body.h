// BodyResolver: makes bodies from their messages, those written out and the templates of scatters and players.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <span>
#include <string>
#include <unordered_map>

#include "core/world/bounds.h"
#include "core/world/faults.h"
#include "core/world/resolve_layers.h"
#include "core/world/resolve_shape.h"
#include "core/world/scene.h"
#include "tessera/v1/scene.pb.h"

namespace tessera {

// Largest id of a body of a scene; players' bodies come after.
inline constexpr std::uint64_t kMaxSceneBody = kFirstPlayerBody - 1;

class BodyResolver {
 public:
  // For a scene with these bounds, this gravity, these properties and these layers, which must outlive the resolver.
  BodyResolver(Faults& faults, const Aabb& bounds, Vec3d gravity_m_s2, std::span<const PropertyDef> properties,
               NamedLayers layers)
      : faults_(faults),
        bounds_(bounds),
        gravity_m_s2_(Length(gravity_m_s2)),
        properties_(properties),
        layers_(layers),
        shapes_(faults) {}

  // Materials come before the bodies that name them.
  void AddMaterial(int index, const v1::Material& material);
  BodyDef Body(int index, const v1::Body& body);
  // A body without id and pose. `place` is its place in the scene, e.g. "scatters[0].templates[2]".
  BodyDef Template(const std::string& place, const v1::Body& body);
  // One of a prefab: without id, and posed about the place where a game makes it.
  BodyDef Member(const std::string& place, const v1::Body& body);
  // The kinds of all bodies so far, as Scene has them.
  const std::vector<std::string>& kinds() const { return kinds_; }

 private:
  std::uint16_t Kind(const std::string& name);
  CollisionLayer Layer(const std::string& name);
  BodyDef Common(const v1::Body& body);
  void CheckKinematic(const v1::Body& body);
  // Forces do nothing to it; `what` it is goes into faults.
  void CheckUnmoved(const v1::Body& body, const char* what);
  void CheckDynamic(const v1::Body& body, BodyDef& def);
  void CheckInertia(const v1::Body& body, BodyDef& def);

  Faults& faults_;
  Aabb bounds_;
  double gravity_m_s2_;
  std::span<const PropertyDef> properties_;
  NamedLayers layers_;
  ShapeResolver shapes_;
  std::unordered_map<std::string, Material> materials_;
  std::vector<std::string> kinds_{""};
};

// The place of a body in words: `bodies[12] (id 40 "crate")`.
std::string PlaceOf(int index, const v1::Body& body);

}  // namespace tessera

// The packed form of what a scene says beside its bodies: bounds, fields, properties, players, view, prefabs.
//
// For use inside core/world only. Thread rule: one thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <type_traits>
#include <variant>

#include "core/world/packed_body.h"
#include "core/world/packed_io.h"
#include "core/world/packed_joint.h"
#include "core/world/properties.h"
#include "core/world/scene.h"
#include "core/world/spawned_id.h"

namespace tessera::packed {

template <class Io, class T>
void BoxOf(Io& io, const char* field, T& box) {
  io.Vector(field, box.min, kMaxCoordinate_m);
  io.Vector(field, box.max, kMaxCoordinate_m);
  if constexpr (Io::kReads) {
    const bool volume = box.min.x < box.max.x && box.min.y < box.max.y && box.min.z < box.max.z;
    if (io.ok() && !volume) io.Fail(field, "has no volume");
  }
}

template <class Io, class T>
void FieldOf(Io& io, T& field) {
  bool uniform = field.index() == 1;
  io.Flag("kind", uniform);
  if constexpr (Io::kReads) {
    if (uniform) field = UniformField{};
  }
  if (auto* vortex = std::get_if<VortexField>(&field)) {
    io.Vector("center", vortex->center, kMaxCoordinate_m);
    io.Real("radius_m", vortex->radius_m, kMinExtent_m, kMaxCoordinate_m);
    io.Real("angular_velocity_rad_s", vortex->angular_velocity_rad_s, -kMaxAngularSpeed_rad_s, kMaxAngularSpeed_rad_s);
    io.Real("gain_per_s", vortex->gain_per_s, 0, kMaxTickRateHz);
  } else if (auto* wind = std::get_if<UniformField>(&field)) {
    BoxOf(io, "bounds", wind->bounds);
    io.Vector("acceleration_m_s2", wind->acceleration_m_s2, kMaxAcceleration_m_s2);
  }
}

// Makes `value` the alternative of this place.
template <std::size_t kPlace = 0>
void BecomeValue(PropertyValue& value, std::size_t place) {
  if constexpr (kPlace < std::variant_size_v<PropertyValue>) {
    if (place != kPlace) return BecomeValue<kPlace + 1>(value, place);
    value.emplace<kPlace>();
  }
}

template <class Io, class V>
void ValueOf(Io& io, V& value) {
  using T = std::remove_const_t<V>;
  if constexpr (std::is_same_v<T, bool>) {
    io.Flag("initial", value);
  } else if constexpr (std::is_same_v<T, std::int64_t>) {
    auto bits = static_cast<std::uint64_t>(value);
    io.Number("initial", bits, 0, ~0ull);
    if constexpr (Io::kReads) value = static_cast<std::int64_t>(bits);
  } else if constexpr (std::is_same_v<T, double>) {
    io.Real("initial", value, -kMaxPropertyReal, kMaxPropertyReal);
  } else if constexpr (std::is_same_v<T, std::string>) {
    io.Text("initial", value, kMaxPropertyText);
  } else if constexpr (std::is_same_v<T, Vec3d>) {
    io.Vector("initial", value, kMaxPropertyReal);
  } else if constexpr (std::is_same_v<T, BodyId>) {
    io.Number("initial", value, 0, ~0ull);
  } else {
    io.Block("initial", value.bytes, kMaxPropertyBlob);
  }
}

template <class Io, class T>
void DeclarationOf(Io& io, T& def) {
  io.Text("name", def.name, kMaxNameLength);
  auto type = static_cast<std::uint8_t>(def.initial.index());
  io.Choice("type", type, static_cast<std::uint8_t>(std::variant_size_v<PropertyValue> - 1));
  if constexpr (Io::kReads) BecomeValue(def.initial, type);
  std::visit([&](auto& value) { ValueOf(io, value); }, def.initial);
  io.Choice("visible_to", def.visible_to, Visibility::kTeam);
}

template <class Io, class T>
void NamesOf(Io& io, const char* field, T& names, std::size_t low, std::size_t most, std::size_t longest) {
  io.List(field, names, low, most, 1, [&](auto& name) { io.Text("name", name, longest); });
}

// Everything that bodies refer to, or that is not about bodies.
template <class Io, class T>
void RulesOf(Io& io, T& scene, const Context&) {
  io.Text("name", scene.name, kMaxNameLength);
  BoxOf(io, "bounds", scene.bounds);
  io.Vector("gravity_m_s2", scene.gravity_m_s2, kMaxAcceleration_m_s2);
  io.Number("tick_rate_hz", scene.tick_rate_hz, kMinTickRateHz, kMaxTickRateHz);
  io.List("fields", scene.fields, 0, kMaxFields, 49, [&](auto& field) { FieldOf(io, field); });
  io.Real("view.radius_m", scene.view.radius_m, 0, kMaxCoordinate_m);
  io.Real("view.bytes_per_s", scene.view.bytes_per_s, kMinViewBytes_per_s, kMaxViewBytes_per_s);
  const auto declaration = [&](auto& def) { DeclarationOf(io, def); };
  io.List("properties", scene.properties, 0, kMaxProperties, 4, declaration);
  io.List("instance_properties", scene.instance_properties, 0, kMaxProperties, 4, declaration);
  io.Text("team_property", scene.team_property, kMaxNameLength);
  NamesOf(io, "kinds", scene.kinds, 1, kMaxKinds + 1, kMaxKindLength);
  NamesOf(io, "layers", scene.layers, 1, kMaxLayers, kMaxLayerLength);
  if constexpr (Io::kReads) {
    const auto is_team = [&](const PropertyDef& def) { return def.name == scene.team_property; };
    if (io.ok() && !scene.team_property.empty() && std::ranges::none_of(scene.properties, is_team)) {
      io.Fail("team_property", "is not declared");
    }
  }
}

template <class Io, class T>
void CharacterOf(Io& io, T& rules) {
  io.Real("walk_speed_m_s", rules.walk_speed_m_s, 0, kMaxSpeed_m_s);
  io.Real("run_speed_m_s", rules.run_speed_m_s, 0, kMaxSpeed_m_s);
  io.Real("acceleration_m_s2", rules.acceleration_m_s2, 0, kMaxAcceleration_m_s2);
  io.Real("air_control", rules.air_control, 0, 1);
  io.Real("jump_speed_m_s", rules.jump_speed_m_s, 0, kMaxSpeed_m_s);
  io.Real("step_height_m", rules.step_height_m, 0, kMaxExtent_m);
  io.Real("max_slope_rad", rules.max_slope_rad, 0, 2);
  io.Real("push_mass_kg", rules.push_mass_kg, 0, kMaxMass_kg);
}

template <class Io, class T>
void PlayerOf(Io& io, T& player, const Context& context) {
  BodyOf(io, player.body, context, {.least_id = 0, .most_id = 0});
  io.List("spawn_points", player.spawn_points, 1, kMaxBodies, 24,
          [&](auto& point) { io.Vector("point", point, kMaxCoordinate_m); });
  io.Real("max_force_n", player.max_force_n, 0, kMaxForce);
  const std::uint32_t parts = io.Parts(
      "player", {player.max_force_up_n != std::numeric_limits<double>::infinity(), player.character.has_value()});
  if ((parts & 1) != 0) io.Real("max_force_up_n", player.max_force_up_n, 0, kMaxForce);
  io.Vector("up", player.up, 1 + kUnitTolerance);
  io.Real("max_speed_m_s", player.max_speed_m_s, 0, kMaxSpeed_m_s);
  if constexpr (Io::kReads) {
    if ((parts & 2) != 0) player.character.emplace();
  }
  if ((parts & 2) != 0) CharacterOf(io, *player.character);
  if constexpr (Io::kReads) {
    if (io.ok() && player.body.motion != Motion::kDynamic) io.Fail("body.motion", "is not dynamic");
    if (io.ok() && player.character && !std::holds_alternative<CapsuleShape>(player.body.shape->form)) {
      io.Fail("character", "has no capsule");
    }
  }
}

template <class Io, class T>
void PrefabOf(Io& io, T& prefab, const Context& context) {
  io.Text("name", prefab.name, kMaxNameLength);
  std::uint64_t number = 0;
  io.List("bodies", prefab.bodies, 1, kMaxPrefabBodies, kMinBodyBytes, [&](auto& body) {
    ++number;
    BodyOf(io, body, context, {.least_id = number, .most_id = number, .position_m = kMaxExtent_m});
    if constexpr (Io::kReads) {
      if (io.ok() && body.motion != Motion::kDynamic) io.Fail("motion", "is not dynamic");
    }
  });
  std::uint64_t joint_number = 0;
  io.List("joints", prefab.joints, 0, kMaxPrefabBodies, kMinJointBytes, [&](auto& joint) {
    JointOf(io, joint);
    if constexpr (Io::kReads) {
      const auto is_member = [&](BodyId id) { return id.value() >= 1 && id.value() <= number; };
      if (io.ok() && !(is_member(joint.body_a) && is_member(joint.body_b))) io.Fail("body_a", "is not in the prefab");
      if (io.ok() && joint.id.value() != ++joint_number) io.Fail("id", "is not its number");
    }
  });
}

// After the bodies of the scene, because they share their shapes.
template <class Io, class T>
void PlayerAndPrefabsOf(Io& io, T& scene, const Context& context) {
  bool has_player = scene.player.has_value();
  io.Flag("player", has_player);
  if constexpr (Io::kReads) {
    if (has_player) scene.player.emplace();
  }
  if (has_player) PlayerOf(io, *scene.player, context);
  io.List("prefabs", scene.prefabs, 0, kMaxPrefabs, kMinBodyBytes,
          [&](auto& prefab) { PrefabOf(io, prefab, context); });
}

}  // namespace tessera::packed

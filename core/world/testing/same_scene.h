// Whether two scenes are the same, field by field and to the bit; for tests. A difference is named:
// "bodies[3].mass_kg".
#pragma once

#include <cstring>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/world/scene.h"

namespace tessera {

// Keeps the first difference.
class SceneDifference {
 public:
  static std::string Between(const Scene& a, const Scene& b) {
    SceneDifference found;
    found.Scenes(a, b);
    return found.what_;
  }

 private:
  void Is(bool same, const std::string& what) {
    if (!same && what_.empty()) what_ = what;
  }
  void Bits(double a, double b, const std::string& what) { Is(std::memcmp(&a, &b, sizeof a) == 0, what); }
  void Bits(float a, float b, const std::string& what) { Is(std::memcmp(&a, &b, sizeof a) == 0, what); }
  template <class T>
  void Bits(Vec3<T> a, Vec3<T> b, const std::string& what) {
    Bits(a.x, b.x, what), Bits(a.y, b.y, what), Bits(a.z, b.z, what);
  }
  void Bits(const Aabb& a, const Aabb& b, const std::string& what) {
    Bits(a.min, b.min, what), Bits(a.max, b.max, what);
  }
  void Bits(const Pose& a, const Pose& b, const std::string& what) {
    Bits(a.position, b.position, what);
    Bits(Vec3d{a.orientation.x, a.orientation.y, a.orientation.z},
         Vec3d{b.orientation.x, b.orientation.y, b.orientation.z}, what);
    Bits(a.orientation.w, b.orientation.w, what);
  }
  template <class List, class Each>
  void Lists(const List& a, const List& b, const std::string& what, Each each) {
    if (a.size() != b.size()) return Is(false, what + ".size");
    for (std::size_t i = 0; i < a.size() && what_.empty(); ++i) each(a[i], b[i], what + "[" + std::to_string(i) + "]");
  }

  void Forms(const Shape& a, const Shape& b, const std::string& what) {
    Lists(a.visuals, b.visuals, what + ".visuals", [this](const Visual& p, const Visual& q, const std::string& at) {
      Is(p.sha256 == q.sha256 && p.mesh == q.mesh, at);
      Bits(p.pose, q.pose, at + ".pose");
      Bits(p.scale, q.scale, at + ".scale");
    });
    if (a.form.index() != b.form.index()) return Is(false, what + ".form");
    std::visit([&](const auto& form) { Form(form, std::get<std::decay_t<decltype(form)>>(b.form), what); }, a.form);
  }
  void Form(const BoxShape& a, const BoxShape& b, const std::string& what) {
    Bits(a.half_extents_m, b.half_extents_m, what);
  }
  void Form(const SphereShape& a, const SphereShape& b, const std::string& what) { Bits(a.radius_m, b.radius_m, what); }
  void Form(const CapsuleShape& a, const CapsuleShape& b, const std::string& what) {
    Bits(a.radius_m, b.radius_m, what), Bits(a.half_height_m, b.half_height_m, what);
  }
  void Form(const CylinderShape& a, const CylinderShape& b, const std::string& what) {
    Bits(a.radius_m, b.radius_m, what), Bits(a.half_height_m, b.half_height_m, what);
  }
  void Form(const ConeShape& a, const ConeShape& b, const std::string& what) {
    Bits(a.radius_m, b.radius_m, what), Bits(a.height_m, b.height_m, what);
  }
  void Form(const ConvexHullShape& a, const ConvexHullShape& b, const std::string& what) {
    Lists(a.points, b.points, what, [this](Vec3f p, Vec3f q, const std::string& at) { Bits(p, q, at); });
  }
  void Form(const CompoundShape& a, const CompoundShape& b, const std::string& what) {
    Lists(a.children, b.children, what, [this](const CompoundChild& p, const CompoundChild& q, const std::string& at) {
      Bits(p.pose, q.pose, at);
      Forms(*p.shape, *q.shape, at);
    });
  }
  void Form(const TriangleMeshShape& a, const TriangleMeshShape& b, const std::string& what) {
    Lists(a.vertices, b.vertices, what, [this](Vec3f p, Vec3f q, const std::string& at) { Bits(p, q, at); });
    Is(a.triangles == b.triangles, what + ".triangles");
  }
  void Form(const HeightFieldShape& a, const HeightFieldShape& b, const std::string& what) {
    Is(a.columns == b.columns && a.rows == b.rows, what);
    Bits(a.spacing_m, b.spacing_m, what);
    Lists(a.heights_m, b.heights_m, what, [this](float p, float q, const std::string& at) { Bits(p, q, at); });
  }
  void Form(const PlaneShape& a, const PlaneShape& b, const std::string& what) {
    Bits(a.normal, b.normal, what), Bits(a.offset_m, b.offset_m, what);
  }

  void States(const BodyState& a, const BodyState& b, const std::string& what) {
    Bits(Pose{a.position, a.orientation}, Pose{b.position, b.orientation}, what + ".pose");
    Bits(a.linear_velocity, b.linear_velocity, what + ".linear_velocity");
    Bits(a.angular_velocity, b.angular_velocity, what + ".angular_velocity");
    Bits(a.angular_momentum, b.angular_momentum, what + ".angular_momentum");
    Bits(a.still_s, b.still_s, what + ".still_s");
    Is(a.asleep == b.asleep, what + ".asleep");
  }
  void Paths(const BodyPath* a, const BodyPath* b, const std::string& what) {
    if (a == nullptr || b == nullptr) return Is(a == b, what);
    Lists(a->points, b->points, what, [this](const PathPoint& p, const PathPoint& q, const std::string& at) {
      Bits(p.time_s, q.time_s, at), Bits(p.pose, q.pose, at);
    });
    Is(a->repeat == b->repeat, what + ".repeat");
    Bits(a->spin_rad_s, b->spin_rad_s, what + ".spin");
  }
  void Bodies(const BodyDef& a, const BodyDef& b, const std::string& what) {
    Is(a.id == b.id, what + ".id");
    Is(a.name == b.name, what + ".name");
    Forms(*a.shape, *b.shape, what + ".shape");
    Is(a.motion == b.motion, what + ".motion");
    Is(a.kinematic == b.kinematic, what + ".kinematic");
    Paths(a.path.get(), b.path.get(), what + ".path");
    Bits(a.mass_kg, b.mass_kg, what + ".mass_kg");
    Is(a.inertia_kg_m2.has_value() == b.inertia_kg_m2.has_value(), what + ".inertia");
    Bits(a.inertia_kg_m2.value_or(Vec3d()), b.inertia_kg_m2.value_or(Vec3d()), what + ".inertia");
    Bits(a.material.friction, b.material.friction, what + ".friction");
    Bits(a.material.rolling_friction, b.material.rolling_friction, what + ".rolling_friction");
    Bits(a.material.spinning_friction, b.material.spinning_friction, what + ".spinning_friction");
    Bits(a.material.restitution, b.material.restitution, what + ".restitution");
    Bits(a.linear_damping, b.linear_damping, what + ".linear_damping");
    Bits(a.angular_damping, b.angular_damping, what + ".angular_damping");
    Bits(a.gravity_scale, b.gravity_scale, what + ".gravity_scale");
    Is(a.trigger == b.trigger && a.may_sleep == b.may_sleep, what + ".flags");
    Is(a.layer == b.layer, what + ".layer");
    Is(a.kind == b.kind, what + ".kind");
    Is(a.properties == b.properties, what + ".properties");
    Is(a.visible_to == b.visible_to, what + ".visible_to");
    States(a.initial, b.initial, what + ".initial");
  }
  void Limits(const Limit& a, const Limit& b, const std::string& what) {
    Bits(a.lower, b.lower, what), Bits(a.upper, b.upper, what);
  }
  void Motors(const Motor& a, const Motor& b, const std::string& what) {
    Bits(a.target_velocity, b.target_velocity, what), Bits(a.max_force, b.max_force, what);
  }
  void Springs(const Spring& a, const Spring& b, const std::string& what) {
    Bits(a.stiffness, b.stiffness, what), Bits(a.damping, b.damping, what), Bits(a.rest, b.rest, what);
  }
  void Kind(const PointJoint&, const PointJoint&, const std::string&) {}
  void Kind(const FixedJoint&, const FixedJoint&, const std::string&) {}
  void Kind(const HingeJoint& a, const HingeJoint& b, const std::string& what) {
    Limits(a.limit_rad, b.limit_rad, what), Motors(a.motor, b.motor, what);
  }
  void Kind(const SliderJoint& a, const SliderJoint& b, const std::string& what) {
    Limits(a.limit_m, b.limit_m, what), Motors(a.motor, b.motor, what);
  }
  void Kind(const ConeTwistJoint& a, const ConeTwistJoint& b, const std::string& what) {
    Bits(Vec3d{a.swing_y_rad, a.swing_z_rad, a.twist_rad}, Vec3d{b.swing_y_rad, b.swing_z_rad, b.twist_rad}, what);
  }
  void Kind(const SixDofJoint& a, const SixDofJoint& b, const std::string& what) {
    Lists(a.axes, b.axes, what, [this](const SixDofAxis& p, const SixDofAxis& q, const std::string& at) {
      Limits(p.limit, q.limit, at), Motors(p.motor, q.motor, at), Springs(p.spring, q.spring, at);
    });
  }
  void Kind(const UniversalJoint& a, const UniversalJoint& b, const std::string& what) {
    Limits(a.limit_a_rad, b.limit_a_rad, what), Limits(a.limit_b_rad, b.limit_b_rad, what);
  }
  void Kind(const Hinge2Joint& a, const Hinge2Joint& b, const std::string& what) {
    Limits(a.steering_rad, b.steering_rad, what), Springs(a.suspension, b.suspension, what);
    Motors(a.drive, b.drive, what);
  }
  void Kind(const GearJoint& a, const GearJoint& b, const std::string& what) { Bits(a.ratio, b.ratio, what); }
  void Joints(const JointDef& a, const JointDef& b, const std::string& what) {
    Is(a.id == b.id && a.body_a == b.body_a && a.body_b == b.body_b, what + ".ids");
    Bits(a.frame_a, b.frame_a, what + ".frame_a");
    Bits(a.frame_b, b.frame_b, what + ".frame_b");
    Is(a.bodies_collide == b.bodies_collide, what + ".bodies_collide");
    if (a.kind.index() != b.kind.index()) return Is(false, what + ".kind");
    std::visit([&](const auto& kind) { Kind(kind, std::get<std::decay_t<decltype(kind)>>(b.kind), what + ".kind"); },
               a.kind);
  }
  void Fields(const Field& a, const Field& b, const std::string& what) {
    if (a.index() != b.index()) return Is(false, what);
    if (const auto* vortex = std::get_if<VortexField>(&a)) {
      const auto& other = std::get<VortexField>(b);
      Bits(vortex->center, other.center, what);
      Bits(Vec3d{vortex->radius_m, vortex->angular_velocity_rad_s, vortex->gain_per_s},
           Vec3d{other.radius_m, other.angular_velocity_rad_s, other.gain_per_s}, what);
    } else {
      Bits(std::get<UniformField>(a).bounds, std::get<UniformField>(b).bounds, what);
      Bits(std::get<UniformField>(a).acceleration_m_s2, std::get<UniformField>(b).acceleration_m_s2, what);
    }
  }
  void Declarations(const std::vector<PropertyDef>& a, const std::vector<PropertyDef>& b, const std::string& what) {
    Lists(a, b, what, [this](const PropertyDef& p, const PropertyDef& q, const std::string& at) {
      Is(p.name == q.name && p.initial == q.initial && p.visible_to == q.visible_to, at);
    });
  }
  void Players(const PlayerRules& a, const PlayerRules& b) {
    Bodies(a.body, b.body, "player.body");
    Lists(a.spawn_points, b.spawn_points, "player.spawn_points",
          [this](Vec3d p, Vec3d q, const std::string& at) { Bits(p, q, at); });
    Bits(a.max_force_n, b.max_force_n, "player.max_force_n");
    Bits(a.max_force_up_n, b.max_force_up_n, "player.max_force_up_n");
    Bits(a.up, b.up, "player.up");
    Bits(a.max_speed_m_s, b.max_speed_m_s, "player.max_speed_m_s");
    Is(a.character.has_value() == b.character.has_value(), "player.character");
    if (!a.character || !b.character) return;
    const CharacterRules &p = *a.character, &q = *b.character;
    Bits(Vec3d{p.walk_speed_m_s, p.run_speed_m_s, p.acceleration_m_s2},
         Vec3d{q.walk_speed_m_s, q.run_speed_m_s, q.acceleration_m_s2}, "player.character.speeds");
    Bits(Vec3d{p.air_control, p.jump_speed_m_s, p.step_height_m},
         Vec3d{q.air_control, q.jump_speed_m_s, q.step_height_m}, "player.character.jump");
    Bits(p.max_slope_rad, q.max_slope_rad, "player.character.max_slope_rad");
    Bits(p.push_mass_kg, q.push_mass_kg, "player.character.push_mass_kg");
  }
  void Scenes(const Scene& a, const Scene& b) {
    const auto bodies = [this](const BodyDef& p, const BodyDef& q, const std::string& at) { Bodies(p, q, at); };
    const auto joints = [this](const JointDef& p, const JointDef& q, const std::string& at) { Joints(p, q, at); };
    Is(a.name == b.name, "name");
    Bits(a.bounds, b.bounds, "bounds");
    Bits(a.gravity_m_s2, b.gravity_m_s2, "gravity");
    Is(a.tick_rate_hz == b.tick_rate_hz, "tick_rate_hz");
    Lists(a.bodies, b.bodies, "bodies", bodies);
    Lists(a.joints, b.joints, "joints", joints);
    Lists(a.fields, b.fields, "fields",
          [this](const Field& p, const Field& q, const std::string& at) { Fields(p, q, at); });
    Is(a.player.has_value() == b.player.has_value(), "player");
    if (a.player && b.player) Players(*a.player, *b.player);
    Bits(a.view.radius_m, b.view.radius_m, "view.radius_m");
    Bits(a.view.bytes_per_s, b.view.bytes_per_s, "view.bytes_per_s");
    Declarations(a.properties, b.properties, "properties");
    Declarations(a.instance_properties, b.instance_properties, "instance_properties");
    Is(a.team_property == b.team_property, "team_property");
    Is(a.kinds == b.kinds, "kinds");
    Is(a.layers == b.layers, "layers");
    Lists(a.prefabs, b.prefabs, "prefabs", [&](const Prefab& p, const Prefab& q, const std::string& at) {
      Is(p.name == q.name, at + ".name");
      Lists(p.bodies, q.bodies, at + ".bodies", bodies);
      Lists(p.joints, q.joints, at + ".joints", joints);
    });
  }

  std::string what_;
};

}  // namespace tessera

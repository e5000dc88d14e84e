#include "core/world/resolve_character.h"

#include <algorithm>

#include "core/world/limits.h"

namespace tessera {
namespace {

constexpr double kMaxWalk_m_s = 50;
constexpr double kMinJump_m_s = 2, kMaxJump_m_s = 50;
constexpr double kMinAcceleration_m_s2 = 1, kMaxWalkAcceleration_m_s2 = 1000;
constexpr double kMinSlope_rad = 0.1, kMaxSlope_rad = 1.3;
// Moments of inertia about the horizontal axes, of 1 kg, m^2. A blow of 5 m/s at half a metre turns the body by 2e-9
// rad/s then, and damping stops that: it would take years to tilt. Much more, and a float could not hold the angular
// momentum of the least turn beside that of the largest.
constexpr double kUprightInertia_m2 = 1e9;
constexpr double kUprightDamping = 0.9;

class CharacterResolver {
 public:
  CharacterResolver(Faults& faults, const v1::PlayerRules& player) : faults_(faults), player_(player) {}

  CharacterRules Resolve(Vec3d gravity_m_s2, BodyDef& body) {
    CheckSurroundings(gravity_m_s2, body);
    const v1::Character& in = player_.character();
    CharacterRules out;
    Take("walk_speed", in.walk_speed(), 1e-3, kMaxWalk_m_s, out.walk_speed_m_s);
    out.run_speed_m_s = out.walk_speed_m_s;
    Take("run_speed", in.run_speed(), 1e-3, kMaxWalk_m_s, out.run_speed_m_s);
    Take("acceleration", in.acceleration(), kMinAcceleration_m_s2, kMaxWalkAcceleration_m_s2, out.acceleration_m_s2);
    if (in.has_air_control() && faults_.Range("character.air_control", in.air_control(), 0, 1)) {
      out.air_control = in.air_control();
    }
    Take("jump_speed", in.jump_speed(), kMinJump_m_s, kMaxJump_m_s, out.jump_speed_m_s);
    Take("max_slope", in.max_slope(), kMinSlope_rad, kMaxSlope_rad, out.max_slope_rad);
    out.push_mass_kg = body.mass_kg;
    if (in.has_push_mass() && faults_.NotNegative("character.push_mass", in.push_mass(), kMaxMass_kg)) {
      out.push_mass_kg = in.push_mass();
    }
    const auto* capsule = body.shape == nullptr ? nullptr : std::get_if<CapsuleShape>(&body.shape->form);
    if (capsule == nullptr) {
      faults_.Add("character needs a body.shape that is a capsule");
      return out;
    }
    const double most_step_m = capsule->radius_m + capsule->half_height_m;
    out.step_height_m = std::min(out.step_height_m, most_step_m);
    if (in.has_step_height() && faults_.Range("character.step_height", in.step_height(), 0, most_step_m)) {
      out.step_height_m = in.step_height();
    }
    KeepUpright(*capsule, body);
    return out;
  }

 private:
  void CheckSurroundings(Vec3d gravity_m_s2, const BodyDef& body) {
    const Vec3d pull = gravity_m_s2 * body.gravity_scale;
    if (pull.x != 0 || pull.z != 0 || !(pull.y < 0)) faults_.Add("character needs gravity that points along -y");
    if (body.inertia_kg_m2.has_value()) faults_.Add("body.inertia must be left out for a character: nothing tilts it");
    if (body.trigger) faults_.Add("body.trigger must be left out for a character: it would fall through the ground");
    if (player_.max_force() != 0 || player_.max_speed() != 0 || player_.has_max_force_up()) {
      faults_.Add("max_force, max_force_up and max_speed must be left out beside character: forces do not move it");
    }
  }
  // A number whose 0 stands for the default.
  void Take(const char* field, double value, double low, double high, double& to) {
    if (value == 0) return;
    if (faults_.Range(std::string("character.") + field, value, low, high)) to = value;
  }
  static void KeepUpright(const CapsuleShape& capsule, BodyDef& body) {
    const double upright = kUprightInertia_m2 * body.mass_kg;
    // About its own axis it turns like a cylinder of its radius.
    body.inertia_kg_m2 = {upright, body.mass_kg * capsule.radius_m * capsule.radius_m / 2, upright};
    body.angular_damping = std::max(body.angular_damping, kUprightDamping);
    body.material = {.friction = 0};
  }

  Faults& faults_;
  const v1::PlayerRules& player_;
};

}  // namespace

CharacterRules ResolveCharacter(Faults& faults, const v1::PlayerRules& player, Vec3d gravity_m_s2, BodyDef& body) {
  return CharacterResolver(faults, player).Resolve(gravity_m_s2, body);
}

}  // namespace tessera

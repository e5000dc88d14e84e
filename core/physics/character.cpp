#include "core/physics/character.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include "core/world/limits.h"

namespace tessera::physics {
namespace {

// Swept spheres are thinner than the capsule by this, m: walls that it leans on and seams of a floor are not ahead of
// it. Larger, and it feels low bumps late.
constexpr double kSkin_m = 0.01;
// A gap up to this, m, is closed by gravity alone. Smaller, and a capsule that rests is pulled to and fro.
constexpr double kResting_m = 0.01;
// A thin probe, m, that looks at the top of an edge so far behind it.
constexpr double kThin_m = 0.02, kBehindEdge_m = 0.03;
// An edge is a place whose top is by so much more upright than what is touched there.
constexpr double kEdge = 0.05;
// Ground that rises by less than this along the way counts as level.
constexpr double kLevel = 0.05;
// A wall is come up to in so many ticks, ever slower.
constexpr double kWallTicks = 2;
// A jump needs ground this near, m.
constexpr double kJumpGap_m = 0.1;
// Beyond a tick's way or two it looks ahead so far, m.
constexpr double kAhead_m = 0.05;
constexpr double kTicksAhead = 2;
// A body that falls faster than this, m/s, is left to fall: it need not be drawn down, and stands once it is down.
// Otherwise two worlds that differ by a rounding would land it at visibly other times.
constexpr double kFalling_m_s = 1;
// A contact as upright as this bears nothing.
constexpr double kLeastBearing = 0.2;
// Greatest speed at which it is drawn down to the ground, m/s.
constexpr double kDrawDown_m_s = 5;
// A body that leaves the ground faster than this, m/s, has jumped or was thrown; the share is of the jump's speed.
// Between the ground and half of a jump's height it has .7 of that speed.
constexpr double kThrown_m_s = 3, kMostLeaving_m_s = 4, kLeavingShare = 0.69;
// A step is climbed at this share of that speed, and so many ticks before its top ever slower.
constexpr double kClimbShare = 0.9, kClimbTicks = 2;
// It turns to where the player looks at most so fast, rad/s, and rests within so much of it, rad.
constexpr double kMostTurn_rad_s = 20, kFacing_rad = 1e-3;
// Heights of steps are compared with this tolerance, m.
constexpr double kStepTolerance_m = 0.002;

constexpr Vec3d kUp{0, 1, 0};

Vec3d Horizontal(Vec3d v) { return {v.x, 0, v.z}; }

std::optional<Vec3d> HorizontalNormal(Vec3d normal) {
  const Vec3d flat = Horizontal(normal);
  const double length = Length(flat);
  if (length < 1e-6) return std::nullopt;
  return flat / length;
}

double LeavingSpeed(const CharacterRules& rules) {
  return rules.jump_speed_m_s > 0 ? std::min(kLeavingShare * rules.jump_speed_m_s, kMostLeaving_m_s) : kThrown_m_s;
}

// How far below it ground draws it down, m: a step, but less than half a jump, or a low jump would end at once.
double SnapHeight(const CharacterRules& rules, double gravity_m_s2) {
  if (rules.jump_speed_m_s <= 0) return rules.step_height_m;
  const double jump_m = rules.jump_speed_m_s * rules.jump_speed_m_s / (2 * gravity_m_s2);
  return std::min(rules.step_height_m, jump_m / 2);
}

double YawOf(Quatd q) { return std::atan2(2 * (q.w * q.y + q.x * q.z), 1 - 2 * (q.x * q.x + q.y * q.y)); }

// Feels with spheres around one capsule.
class Feeler {
 public:
  Feeler(const World& world, BodyId id, const PlayerRules& player)
      : world_(world),
        id_(id),
        rules_(*player.character),
        shape_(std::get<CapsuleShape>(player.body.shape->form)),
        state_(world.StateOf(id)),
        least_up_(std::cos(rules_.max_slope_rad)),
        center_(state_.position - kUp * shape_.half_height_m),
        bottom_m_(center_.y - shape_.radius_m) {}

  void FeelGround(double snap_m, Footing& footing) const {
    const auto hit = Sweep(center_, center_ - kUp * (snap_m + 2 * kSkin_m), Radius());
    if (!hit.has_value()) return;
    const double up = hit->normal.y;
    if (up <= 0) return;
    const double gap = (center_.y - hit->center.y) + (kSweptGap_m - kSkin_m) / std::max(up, kLeastBearing);
    const bool bears = up >= least_up_ || TopBehind(*hit).has_value();
    if (bears && up >= kLeastBearing) {
      Ground(*hit, gap, footing);
    } else if (const auto under = Under(snap_m); bears || under.has_value()) {
      // It leans on something steep, and stands on the ground below its middle or on the edge itself.
      if (under.has_value()) Ground(*under, center_.y - under->center.y - shape_.radius_m + kThin_m, footing);
      footing.grounded = true;
      footing.gap_m = under.has_value() ? footing.gap_m : std::max(gap, 0.0);
    }
    if (up < least_up_ && gap < kResting_m) footing.steep = HorizontalNormal(hit->normal);
    if (bears) footing.steep.reset();
  }

  void FeelWay(Vec3d asked_m_s, double tick_s, Footing& footing) const {
    const double speed = Length(asked_m_s);
    if (speed <= 0) return;
    Vec3d along = asked_m_s / speed;
    if (footing.grounded && footing.normal.y >= least_up_) along.y = -Dot(along, footing.normal) / footing.normal.y;
    along = Normalized(along);
    const auto hit = Sweep(center_, center_ + along * (kTicksAhead * speed * tick_s + kAhead_m), Radius());
    if (!hit.has_value()) return;
    const double mass_kg = world_.MassOf(hit->body);
    if (mass_kg > 0 && mass_kg <= rules_.push_mass_kg) return;
    if (footing.grounded) {
      if (const auto top = TopBehind(*hit); top.has_value()) {
        // Where a slope begins nothing has to be climbed: the ground there is as steep as what was hit.
        if (top->normal.y > hit->normal.y + kEdge) footing.rise_m = std::max(TopOf(*top) - bottom_m_, 0.0);
        return;
      }
    }
    if (hit->normal.y >= least_up_) return;
    footing.wall = HorizontalNormal(hit->normal);
    if (footing.wall.has_value()) {
      footing.wall_m = std::max(0.0, -Dot(hit->center - center_, *footing.wall) + kSweptGap_m - kSkin_m);
    }
  }

 private:
  double Radius() const { return std::max(shape_.radius_m - kSkin_m, shape_.radius_m / 2); }
  std::optional<SphereHit> Sweep(Vec3d from, Vec3d to, double radius_m) const {
    return world_.SweepSphere(from, to, radius_m, id_);
  }
  bool Walkable(const SphereHit& hit) const { return hit.normal.y >= least_up_; }

  void Ground(const SphereHit& hit, double gap_m, Footing& footing) const {
    footing.grounded = true;
    footing.normal = hit.normal;
    footing.gap_m = gap_m;
    const BodyState under = world_.StateOf(hit.body);
    if (under.linear_velocity == Vec3f() && under.angular_velocity == Vec3f()) return;
    const Vec3d arm = hit.center - under.position;
    footing.ground_velocity_m_s = Vec3d(under.linear_velocity) + Cross(Vec3d(under.angular_velocity), arm);
  }
  // Walkable ground right under its middle.
  std::optional<SphereHit> Under(double snap_m) const {
    const double way_m = shape_.radius_m - kThin_m + std::min(snap_m, kResting_m);
    const auto hit = Sweep(center_, center_ - kUp * way_m, kThin_m);
    return hit.has_value() && Walkable(*hit) ? hit : std::nullopt;
  }
  static double TopOf(const SphereHit& top) { return top.center.y - kThin_m - kSweptGap_m; }
  // The walkable top of what was hit, a little behind the point of contact, unless it is more than a step up.
  std::optional<SphereHit> TopBehind(const SphereHit& hit) const {
    const auto out = HorizontalNormal(hit.normal);
    if (!out.has_value()) return std::nullopt;
    const Vec3d behind = hit.center - hit.normal * Radius() - *out * kBehindEdge_m;
    const double start_m = bottom_m_ + rules_.step_height_m + 2 * kThin_m;
    const Vec3d from{behind.x, start_m, behind.z}, to{behind.x, bottom_m_ - kThin_m, behind.z};
    const auto top = Sweep(from, to, kThin_m);
    if (!top.has_value() || !Walkable(*top)) return std::nullopt;
    const double top_m = TopOf(*top);
    // A probe that starts within a wall comes out below it.
    const double touched_m = hit.center.y - hit.normal.y * Radius() - kThin_m;
    const bool reached = top_m >= touched_m && top_m <= bottom_m_ + rules_.step_height_m + kStepTolerance_m;
    return reached ? top : std::nullopt;
  }

  const World& world_;
  const BodyId id_;
  const CharacterRules& rules_;
  const CapsuleShape& shape_;
  const BodyState state_;
  const double least_up_;
  const Vec3d center_;  // centre of the lower sphere
  const double bottom_m_;
};

Vec3d Limited(Vec3d v, double most) {
  const double length = Length(v);
  return length > most ? v * (most / length) : v;
}

// Leaves no more than `most` of what goes against a horizontal normal.
Vec3d Along(Vec3d v, const std::optional<Vec3d>& normal, double most) {
  if (!normal.has_value()) return v;
  const double against = -Dot(v, *normal);
  return against > most ? v + *normal * (against - most) : v;
}

// The change of velocity, beyond gravity's, that the step shall bring.
Vec3d GroundChange(const CharacterRules& rules, double gravity_m_s2, Vec3d velocity, Vec3d asked,
                   const Footing& footing, double tick_s) {
  const Vec3d n = footing.normal, gravity = kUp * -gravity_m_s2;
  const Vec3d relative = velocity - footing.ground_velocity_m_s;
  const double out = Dot(relative, n);
  Vec3d wanted = asked - n * Dot(asked, n);
  if (const double length = Length(wanted); length > 0) wanted = wanted * (Length(asked) / length);
  Vec3d change = Limited(wanted - (relative - n * out), rules.acceleration_m_s2 * tick_s);
  if (n.y >= kLeastBearing) change -= (gravity - n * Dot(gravity, n)) * tick_s;
  if (footing.rise_m > 0) {
    const double climb = std::min(kClimbShare * LeavingSpeed(rules), footing.rise_m / (kClimbTicks * tick_s));
    change.y = std::max(change.y, climb - relative.y + gravity_m_s2 * tick_s);
  } else if (footing.gap_m > kResting_m && Dot(asked, n) >= -kLevel * Length(asked) && relative.y > -kFalling_m_s) {
    // Downhill and on the level only: on its way up over an edge it would stumble.
    const double down = -std::min(kDrawDown_m_s, footing.gap_m / tick_s);
    change.y = std::min(change.y, down - relative.y + gravity_m_s2 * tick_s);
  } else if (out > 0) {
    change -= n * out;
  }
  return change;
}

// A jump that rises to v^2 / 2g from the ground. In the step that it begins in, which is solved in two substeps because
// the body touches the ground, it rises by 3/4 of the speed at its end.
double JumpStart(double speed, double gravity_m_s2, double tick_s) {
  const double first = gravity_m_s2 * tick_s * 3 / 4;
  return std::sqrt(speed * speed + first * first) - first;
}

double TurnTorque(const PlayerRules& player, const BodyState& state, float yaw_rad, double tick_s) {
  const double off = std::remainder(static_cast<double>(yaw_rad) - YawOf(state.orientation), 2 * std::numbers::pi);
  const double turning = static_cast<double>(state.angular_velocity.y);
  if (std::abs(off) < kFacing_rad && std::abs(turning) < kFacing_rad) return 0;
  const double wanted = std::abs(off) < kFacing_rad ? 0 : std::clamp(off / tick_s, -kMostTurn_rad_s, kMostTurn_rad_s);
  return player.body.inertia_kg_m2->y * (wanted - turning) / tick_s;
}

bool Asks(const CharacterRules& rules, const PlayerInput& input) {
  return input.move != Vec2f() || (rules.jump_speed_m_s > 0 && (input.buttons & kJumpButton) != 0);
}

}  // namespace

Vec3d AskedVelocity(const CharacterRules& rules, const PlayerInput& input) {
  const double sine = std::sin(static_cast<double>(input.yaw_rad)),
               cosine = std::cos(static_cast<double>(input.yaw_rad));
  const Vec3d right{cosine, 0, -sine}, forward{-sine, 0, -cosine};
  const Vec3d move = right * static_cast<double>(input.move.x) + forward * static_cast<double>(input.move.y);
  const bool runs = (input.buttons & kRunButton) != 0;
  return Limited(move, 1) * (runs ? rules.run_speed_m_s : rules.walk_speed_m_s);
}

Footing FindFooting(const World& world, BodyId id, const PlayerRules& player, double gravity_m_s2, Vec3d asked_m_s,
                    double tick_s) {
  const Feeler feeler(world, id, player);
  Footing footing;
  feeler.FeelGround(SnapHeight(*player.character, gravity_m_s2), footing);
  const Vec3d relative = Vec3d(world.StateOf(id).linear_velocity) - footing.ground_velocity_m_s;
  const bool leaves = Dot(relative, footing.normal) > LeavingSpeed(*player.character);
  const bool falls = relative.y < -kFalling_m_s && footing.gap_m > kJumpGap_m;
  if (leaves || falls) footing.grounded = false;
  feeler.FeelWay(asked_m_s, tick_s, footing);
  return footing;
}

CharacterDrive Drive(const PlayerRules& player, double gravity_m_s2, const BodyState& state, const Footing& footing,
                     const PlayerInput& input, double tick_s) {
  const CharacterRules& rules = *player.character;
  const double mass_kg = player.body.mass_kg;
  const Vec3d velocity(state.linear_velocity);
  const Vec3d asked = Along(AskedVelocity(rules, input), footing.wall, footing.wall_m / (kWallTicks * tick_s));
  const bool jumps =
      rules.jump_speed_m_s > 0 && (input.buttons & kJumpButton) != 0 && footing.grounded && footing.gap_m <= kJumpGap_m;
  Vec3d change;
  if (footing.grounded) {
    change = GroundChange(rules, gravity_m_s2, velocity, asked, footing, tick_s);
    if (jumps) {
      if (asked == Vec3d()) change = Vec3d();  // nothing brakes it any more
      const double start = JumpStart(rules.jump_speed_m_s, gravity_m_s2, tick_s);
      change.y = start + std::max(footing.ground_velocity_m_s.y, 0.0) - velocity.y + gravity_m_s2 * tick_s;
    }
  } else if (asked != Vec3d()) {
    const double most = rules.acceleration_m_s2 * rules.air_control * tick_s;
    change = Along(Limited(asked - Horizontal(velocity), most), footing.steep, 0);
  }
  const Vec3d force = Limited(change * (mass_kg / tick_s), kMaxAcceleration_m_s2 * mass_kg);
  return {Vec3f(force), Vec3f(0, static_cast<float>(TurnTorque(player, state, input.yaw_rad, tick_s)), 0)};
}

CharacterDrive DriveCharacter(const World& world, BodyId id, const PlayerRules& player, Vec3d gravity_m_s2,
                              const PlayerInput& input, double tick_s) {
  assert(player.character.has_value());
  const BodyState state = world.StateOf(id);
  const double gravity = -gravity_m_s2.y * player.body.gravity_scale;
  if (world.IsParked(id)) return {};
  if (state.asleep && !Asks(*player.character, input)) {
    return {Vec3f(), Vec3f(0, static_cast<float>(TurnTorque(player, state, input.yaw_rad, tick_s)), 0)};
  }
  const Vec3d asked = AskedVelocity(*player.character, input);
  return Drive(player, gravity, state, FindFooting(world, id, player, gravity, asked, tick_s), input, tick_s);
}

}  // namespace tessera::physics

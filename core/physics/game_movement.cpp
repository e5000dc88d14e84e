#include "core/physics/game_movement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <exception>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

// A call of a movement: what the functions of its tick need.
struct tessera_movement_call {
  const tessera::physics::World& world;
  tessera::BodyId body;
  int sweeps = 0;
  std::string refused{};  // why the first sweep that was refused was
};

namespace tessera::physics {
namespace {

constexpr double kLeastSwept_m = 0.001, kMostSwept_m = 10, kLongestSweep_m = 1000;

void Put(Vec3d v, double to[3]) { to[0] = v.x, to[1] = v.y, to[2] = v.z; }
Vec3d From(const double v[3]) { return {v[0], v[1], v[2]}; }

const char* WrongSweep(const tessera_movement_call& call, Vec3d from, Vec3d to, double radius_m) {
  if (call.sweeps > TESSERA_MAX_MOVEMENT_SWEEPS) return "more than 64 in one call";
  if (!IsFinite(from) || !IsFinite(to)) return "from or to is not finite";
  if (!(Length(to - from) <= kLongestSweep_m)) return "is longer than 1000 m";
  if (!(radius_m >= kLeastSwept_m && radius_m <= kMostSwept_m)) return "radius_m is not within .001 to 10";
  return nullptr;
}

// Fields that the caller's struct has; the size stays the caller's.
void GiveHit(const tessera_movement_hit& found, tessera_movement_hit* hit) {
  const std::uint32_t size = hit->size;
  std::memcpy(hit, &found, std::min<std::size_t>(size, sizeof found));
  hit->size = size;
}

int SweepForMovement(const tessera_movement_call* const_call, const double from[3], const double to[3], double radius_m,
                     tessera_movement_hit* hit) {
  auto& call = *const_cast<tessera_movement_call*>(const_call);
  ++call.sweeps;
  const char* wrong = WrongSweep(call, From(from), From(to), radius_m);
  if (wrong == nullptr && (hit == nullptr || hit->size < offsetof(tessera_movement_hit, fraction))) {
    wrong = "hit is NULL, or its size is not set";
  }
  if (wrong != nullptr) {
    if (call.refused.empty()) call.refused = absl::StrCat("sweep: ", wrong);
    return -1;
  }
  const auto met = call.world.SweepSphere(From(from), From(to), radius_m, call.body);
  if (!met) return 0;
  tessera_movement_hit found = TESSERA_MOVEMENT_HIT;
  found.body = met->body.value();
  found.fraction = met->fraction;
  Put(met->center, found.center);
  Put(met->normal, found.normal);
  const BodyState state = call.world.StateOf(met->body);
  const Vec3d at = met->center - met->normal * radius_m;
  Put(Vec3d(state.linear_velocity) + Cross(Vec3d(state.angular_velocity), at - state.position), found.velocity);
  found.mass_kg = call.world.MassOf(met->body);
  GiveHit(found, hit);
  return 1;
}

bool AsksForMovement(const PlayerInput& input) { return input.move != Vec2f() || input.buttons != 0; }

tessera_movement_tick TickFor(const GameMovement& movement, const World& world, const MovementTick& of,
                              const tessera_movement_call& call) {
  const BodyState state = world.StateOf(of.body);
  const PlayerInput& input = of.input;
  tessera_movement_tick tick{};
  tick.size = sizeof tick;
  tick.buttons = input.buttons;
  tick.seconds = of.tick_s;
  Put(of.gravity_m_s2, tick.gravity);
  tick.body = of.body.value();
  tick.mass_kg = world.MassOf(of.body);
  Put(world.InertiaOf(of.body), tick.inertia);
  Put(state.position, tick.position);
  const Quatd q = state.orientation;
  const double orientation[4] = {q.x, q.y, q.z, q.w};
  std::copy(std::begin(orientation), std::end(orientation), tick.orientation);
  Put(Vec3d(state.linear_velocity), tick.linear_velocity);
  Put(Vec3d(state.angular_velocity), tick.angular_velocity);
  tick.move[0] = input.move.x, tick.move[1] = input.move.y;
  tick.yaw = input.yaw_rad;
  tick.pitch = input.pitch_rad;
  tick.user = movement.table->user;
  tick.call = &call;
  tick.sweep = SweepForMovement;
  return tick;
}

// Why the call failed; empty if it did not.
std::string CallMovement(const GameMovement& movement, const tessera_movement_tick& tick,
                         const tessera_movement_call& call, MovementState& state, tessera_movement_push& push) {
  int code = 0;
  try {
    code = movement.table->move(&tick, state.bytes.data(), &push);
  } catch (const std::exception& thrown) {
    return absl::StrCat("threw ", thrown.what());
  } catch (...) {
    return "threw what is no std::exception";
  }
  if (!call.refused.empty()) return call.refused;
  if (code != 0) return absl::StrCat("returned ", code);
  if (!IsFinite(From(push.force))) return "force is not finite";
  if (!IsFinite(From(push.torque))) return "torque is not finite";
  const auto beyond = state.bytes.begin() + state.size;
  if (std::any_of(beyond, state.bytes.end(), [](std::uint8_t byte) { return byte != 0; })) {
    return absl::StrCat("wrote beyond the ", movement.state_bytes, " bytes of its state");
  }
  return {};
}

Vec3f ScaledDown(Vec3d v, double most) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest == 0) return {};
  const Vec3d direction = v / largest;  // its square is no infinity
  const double length = largest * Length(direction);
  return Vec3f(length > most ? direction * (most / Length(direction)) : v);
}

}  // namespace

MovementRun RunMovement(const GameMovement& movement, const World& world, const MovementTick& tick,
                        const MovementState& before) {
  MovementRun run{.drive = {}, .state = StateFor(movement, tick.body, before), .error = {}};
  if (world.IsParked(tick.body)) return run;
  if (world.StateOf(tick.body).asleep && !AsksForMovement(tick.input)) return run;
  tessera_movement_call call{world, tick.body};
  const tessera_movement_tick given = TickFor(movement, world, tick, call);
  MovementState after = run.state;
  tessera_movement_push push{};
  run.error = CallMovement(movement, given, call, after, push);
  if (!run.error.empty()) {
    run.error = absl::StrCat("movement ", movement.name, ": ", run.error);
    return run;
  }
  run.state = after;
  const Vec3d inertia = world.InertiaOf(tick.body);
  const double most_inertia = std::max({inertia.x, inertia.y, inertia.z});
  run.drive.force_n = ScaledDown(From(push.force), kMaxAcceleration_m_s2 * world.MassOf(tick.body));
  run.drive.torque_nm = ScaledDown(From(push.torque), kMostMovementSpin_rad_s2 * most_inertia);
  return run;
}

}  // namespace tessera::physics

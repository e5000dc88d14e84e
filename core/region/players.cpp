#include "core/region/players.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"

namespace tessera::region {
namespace {

Vec3d Clamped(Vec3d v, double limit) {
  const double length = Length(v);
  return length > limit ? v * (limit / length) : v;
}

// `push` less what it does along `motion` beyond a share that falls to 0 as `motion` grows to `most`.
Vec3d Faded(Vec3d push, Vec3d motion, double most) {
  const double speed = Length(motion);
  if (speed <= 0) return push;
  const Vec3d along = motion / speed;
  const double pushing = Dot(push, along);
  if (pushing <= 0) return push;
  const double share = most > 0 ? std::max(0.0, 1 - speed / most) : 0.0;
  return push - along * (pushing * (1 - share));
}

}  // namespace

Vec3f LimitedForce(const PlayerRules& rules, Vec3f asked_n, Vec3f velocity_m_s) {
  return Vec3f(Faded(Clamped(Vec3d(asked_n), rules.max_force_n), Vec3d(velocity_m_s), rules.max_speed_m_s));
}

Vec3f LimitedTorque(const PlayerRules& rules, double radius_m, Vec3f asked_nm, Vec3f angular_velocity_rad_s) {
  const Vec3d torque = Clamped(Vec3d(asked_nm), std::min(rules.max_force_n * radius_m, kMaxForce));
  return Vec3f(Faded(torque, Vec3d(angular_velocity_rad_s), rules.max_speed_m_s / radius_m));
}

void Players::Spawn(PlayerNumber player) {
  if (spawned_.insert(player).second) asked_.insert(player);
}

void Players::Park(PlayerNumber player, bool parked) {
  if (parked) {
    parked_.insert(player);
    unparked_.erase(player);
  } else if (parked_.erase(player) > 0) {
    unparked_.insert(player);
  }
}

std::vector<PlayerNumber> Players::TakeSpawns() {
  std::vector<PlayerNumber> spawns;
  for (const PlayerNumber player : asked_) {
    if (!HasLeft(player)) spawns.push_back(player);
  }
  asked_.clear();
  return spawns;
}

std::map<PlayerNumber, PlayerControl> Players::Controls() const {
  std::map<PlayerNumber, PlayerControl> controls;
  for (const auto& [player, steering] : steering_) controls.emplace(player, steering.control);
  return controls;
}

void Players::Adopt(PlayerNumber player, PlayerControl control) {
  Steering steering;
  steering.newest = std::max(control.last_input, control.committed ? control.committed_number : 0);
  if (!control.queue.empty()) steering.newest = std::max(steering.newest, control.queue.back().number);
  steering.control = std::move(control);
  steering_[player] = std::move(steering);
}

const PlayerControl* Players::Find(PlayerNumber player) const {
  const auto it = steering_.find(player);
  return it == steering_.end() ? nullptr : &it->second.control;
}

absl::Status Players::Queue(const PlayerInput& input) {
  if (input.body != PlayerBodyId(input.player)) {
    return absl::PermissionDeniedError(
        absl::StrCat("body ", input.body.value(), " is not player ", input.player.value(), "'s"));
  }
  if (!IsFinite(input.force_n)) return absl::InvalidArgumentError("force_n is not finite");
  if (!IsFinite(input.torque_nm)) return absl::InvalidArgumentError("torque_nm is not finite");
  const auto it = steering_.find(input.player);
  if (it == steering_.end()) {
    return absl::NotFoundError(absl::StrCat("body ", input.body.value(), " is not owned here"));
  }
  Steering& steering = it->second;
  if (input.number <= steering.newest) {
    return absl::OutOfRangeError(
        absl::StrCat("input ", input.number, " is late: ", steering.newest, " is here already"));
  }
  if (steering.gone + steering.control.queue.size() >= kMaxQueuedInputs) {
    return absl::ResourceExhaustedError(
        absl::StrCat("player ", input.player.value(), " has ", kMaxQueuedInputs, " inputs waiting already"));
  }
  steering.newest = input.number;
  steering.control.queue.push_back({input.number, input.force_n, input.torque_nm});
  return absl::OkStatus();
}

void Players::QueueForwarded(PlayerNumber player, const QueuedInput& input) {
  const auto it = steering_.find(player);
  if (it == steering_.end()) return;
  PlayerControl& control = it->second.control;
  const std::uint32_t done = std::max(control.last_input, control.committed ? control.committed_number : 0);
  if (input.number <= done || control.queue.size() >= kMaxGrantedInputs) return;
  const auto at = std::lower_bound(control.queue.begin(), control.queue.end(), input.number,
                                   [](const QueuedInput& queued, std::uint32_t n) { return queued.number < n; });
  if (at != control.queue.end() && at->number == input.number) return;
  control.queue.insert(at, input);
  it->second.newest = std::max(it->second.newest, input.number);
}

void Players::Commit(PlayerNumber player, const BodyState& state, double radius_m) {
  PlayerControl& control = steering_.at(player).control;
  if (control.queue.empty()) return;
  const QueuedInput input = control.queue.front();
  control.queue.erase(control.queue.begin());
  control.committed = true;
  control.committed_number = input.number;
  control.force_n = LimitedForce(*scene_.player, input.force_n, state.linear_velocity);
  control.torque_nm = LimitedTorque(*scene_.player, radius_m, input.torque_nm, state.angular_velocity);
}

void Players::Applied(PlayerNumber player) {
  PlayerControl& control = steering_.at(player).control;
  if (control.committed) control.last_input = control.committed_number;
  control.committed = false;
  control.force_n = control.torque_nm = Vec3f();
}

PlayerControl Players::MakeGrant(PlayerNumber player) {
  Steering& steering = steering_.at(player);
  PlayerControl granted = steering.control;
  steering.gone = granted.queue.size();
  steering.control.queue.clear();
  return granted;
}

std::vector<QueuedInput> Players::Release(PlayerNumber player) {
  auto node = steering_.extract(player);
  return node.empty() ? std::vector<QueuedInput>() : std::move(node.mapped().control.queue);
}

}  // namespace tessera::region

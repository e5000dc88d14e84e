#include "core/region/region_players.h"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "absl/strings/str_cat.h"
#include "core/region/ascends.h"
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

double SpeedOf(const PlayerRules& rules, const PlayerLimits& limits) {
  return limits.speed_m_s ? static_cast<double>(*limits.speed_m_s) : rules.max_speed_m_s;
}

}  // namespace

Vec3f LimitedForce(const PlayerRules& rules, Vec3f asked_n, Vec3f velocity_m_s, const PlayerLimits& limits) {
  Vec3d force = Clamped(Vec3d(asked_n), limits.force_n ? static_cast<double>(*limits.force_n) : rules.max_force_n);
  const Vec3d axes(limits.axes);
  force = {force.x * axes.x, force.y * axes.y, force.z * axes.z};
  if (const double lift = Dot(force, rules.up); lift > rules.max_force_up_n) {
    force -= rules.up * (lift - rules.max_force_up_n);
  }
  return Vec3f(Faded(force, Vec3d(velocity_m_s), SpeedOf(rules, limits)));
}

Vec3f LimitedTorque(const PlayerRules& rules, double radius_m, Vec3f asked_nm, Vec3f angular_velocity_rad_s,
                    const PlayerLimits& limits) {
  const double force = limits.force_n ? static_cast<double>(*limits.force_n) : rules.max_force_n;
  const double most = limits.torque_nm ? static_cast<double>(*limits.torque_nm) : std::min(force * radius_m, kMaxForce);
  const Vec3d torque = Clamped(Vec3d(asked_nm), most);
  return Vec3f(Faded(torque, Vec3d(angular_velocity_rad_s), SpeedOf(rules, limits) / radius_m));
}

void RegionPlayers::Spawn(PlayerNumber player, PropertySet begins) {
  if (spawned_.insert(player).second) asked_.emplace(player, std::move(begins));
}

std::vector<BodyId> RegionPlayers::SetHidden(std::span<const BodyId> hidden) {
  if (hidden_.empty() && hidden.empty()) return {};
  std::vector<BodyId> shown;
  std::ranges::set_difference(hidden_, hidden, std::back_inserter(shown));
  hidden_.assign(hidden.begin(), hidden.end());
  return shown;
}

void RegionPlayers::Park(PlayerNumber player, bool parked) {
  if (parked) {
    parked_.insert(player);
    unparked_.erase(player);
  } else if (parked_.erase(player) > 0) {
    unparked_.insert(player);
  }
}

std::vector<std::pair<PlayerNumber, PropertySet>> RegionPlayers::TakeSpawns() {
  std::vector<std::pair<PlayerNumber, PropertySet>> spawns;
  for (auto& [player, begins] : asked_) {
    if (!HasLeft(player)) spawns.emplace_back(player, std::move(begins));
  }
  asked_.clear();
  return spawns;
}

std::map<PlayerNumber, PlayerControl> RegionPlayers::Controls() const {
  std::map<PlayerNumber, PlayerControl> controls;
  for (const auto& [player, controlled] : controlled_) controls.emplace(player, controlled.control);
  return controls;
}

void RegionPlayers::Adopt(PlayerNumber player, PlayerControl control) {
  Controlled controlled;
  controlled.sequence.Decide(control.last_input);
  if (control.committed) controlled.sequence.Decide(control.next.number);
  for (const PlayerInput& input : control.queue) controlled.sequence.Decide(input.number);
  controlled.control = std::move(control);
  controlled_[player] = std::move(controlled);
}

const PlayerControl* RegionPlayers::Find(PlayerNumber player) const {
  const auto it = controlled_.find(player);
  return it == controlled_.end() ? nullptr : &it->second.control;
}

void RegionPlayers::SetDriven(std::vector<Driven> driven) {
  if (driven == driven_) return;
  driven_ = std::move(driven);
  drivers_ = driven_;
  std::ranges::sort(drivers_, {}, &Driven::body);
}

BodyId RegionPlayers::MovedBy(PlayerNumber player) const {
  const BodyId own = PlayerBodyId(player);
  const auto at = std::ranges::lower_bound(driven_, own, {}, &Driven::own);
  return at != driven_.end() && at->own == own ? at->body : own;
}

const PlayerControl* RegionPlayers::MoverOf(BodyId body) const {
  if (driven_.empty()) return IsPlayerBody(body) ? Find(PlayerOf(body)) : nullptr;
  if (IsPlayerBody(body)) return MovedBy(PlayerOf(body)) == body ? Find(PlayerOf(body)) : nullptr;
  const auto at = std::ranges::lower_bound(drivers_, body, {}, &Driven::body);
  return at != drivers_.end() && at->body == body ? Find(PlayerOf(at->own)) : nullptr;
}

absl::Status RegionPlayers::Queue(const PlayerInput& input) {
  const auto it = controlled_.find(input.player);
  if (it != controlled_.end()) {
    switch (it->second.sequence.Decide(input.number)) {
      case InputSequence::Order::kNewest:
        break;
      case InputSequence::Order::kRepeated:
        return {absl::StatusCode::kAlreadyExists, ""};  // most inputs end here: without a message nothing is allocated
      case InputSequence::Order::kLate:
        return absl::OutOfRangeError(absl::StrCat("input ", input.number, " is late"));
    }
  }
  if (input.body != PlayerBodyId(input.player)) {
    return absl::PermissionDeniedError(
        absl::StrCat("body ", input.body.value(), " is not player ", input.player.value(), "'s"));
  }
  if (const char* wrong = WrongField(input); wrong != nullptr) return absl::InvalidArgumentError(wrong);
  if (it == controlled_.end()) {
    return absl::NotFoundError(absl::StrCat("body ", input.body.value(), " is not owned here"));
  }
  std::vector<PlayerInput>& queue = it->second.control.queue;
  if (it->second.granted + queue.size() >= kMaxQueuedInputs) {
    return absl::ResourceExhaustedError(
        absl::StrCat("player ", input.player.value(), " has ", kMaxQueuedInputs, " inputs waiting already"));
  }
  queue.push_back(input);
  return absl::OkStatus();
}

void RegionPlayers::QueueForwarded(const PlayerInput& input) {
  const auto it = controlled_.find(input.player);
  if (it == controlled_.end()) return;
  PlayerControl& control = it->second.control;
  const std::uint32_t done = std::max(control.last_input, control.committed ? control.next.number : 0);
  if (input.number <= done || control.queue.size() >= kMaxGrantedInputs) return;
  if (it->second.sequence.Decide(input.number) == InputSequence::Order::kRepeated) return;
  const auto at = std::lower_bound(control.queue.begin(), control.queue.end(), input.number,
                                   [](const PlayerInput& queued, std::uint32_t n) { return queued.number < n; });
  control.queue.insert(at, input);
}

// False if there is none.
bool RegionPlayers::TakeNext(PlayerControl& control) {
  if (control.queue.empty()) return false;
  control.committed = true;
  control.next = control.queue.front();
  control.queue.erase(control.queue.begin());
  return true;
}

void RegionPlayers::Commit(PlayerNumber player, bool goes_on,
                           absl::FunctionRef<Moved(const PlayerInput&, const MovementState&)> move) {
  PlayerControl& control = controlled_.at(player).control;
  if (TakeNext(control)) {
    control.held = 0;
  } else if (!goes_on) {
    control.next_state = {};
    return;
  } else if (control.held < kMaxHeldTicks) {
    ++control.held;
  } else {
    control.next.move = {};
    control.next.buttons = 0;
  }
  const Moved moved = move(control.next, control.next_state);
  control.next.force_n = moved.drive.force_n;
  control.next.torque_nm = moved.drive.torque_nm;
  control.next_state = moved.state;
}

void RegionPlayers::Applied(PlayerNumber player) {
  PlayerControl& control = controlled_.at(player).control;
  if (control.committed) control.last_input = control.next.number;
  control.committed = false;
  control.next.force_n = control.next.torque_nm = Vec3f();
  control.state = control.next_state;
}

PlayerControl RegionPlayers::MakeGrant(PlayerNumber player) {
  Controlled& controlled = controlled_.at(player);
  PlayerControl granted = controlled.control;
  controlled.granted = granted.queue.size();
  controlled.control.queue.clear();
  return granted;
}

std::vector<PlayerInput> RegionPlayers::Release(PlayerNumber player) {
  auto node = controlled_.extract(player);
  return node.empty() ? std::vector<PlayerInput>() : std::move(node.mapped().control.queue);
}

void RegionPlayers::Validate() const {
  assert(Ascends(driven_, &Driven::own) && Ascends(drivers_, &Driven::body));
  assert(std::ranges::all_of(driven_, [this](const Driven& one) { return Find(PlayerOf(one.own)) != nullptr; }));
  assert(std::ranges::all_of(asked_, [this](const auto& asked) { return spawned_.contains(asked.first); }));
  assert(std::ranges::none_of(unparked_, [this](PlayerNumber player) { return parked_.contains(player); }));
  assert(std::ranges::all_of(controlled_, [](const auto& entry) {
    const PlayerControl& control = entry.second.control;
    const std::uint32_t done = std::max(control.last_input, control.committed ? control.next.number : 0);
    return control.queue.size() <= kMaxGrantedInputs && Ascends(control.queue, &PlayerInput::number) &&
           (control.queue.empty() || control.queue.front().number > done);
  }));
}

}  // namespace tessera::region

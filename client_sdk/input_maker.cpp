#include "client_sdk/input_maker.h"

#include <algorithm>

namespace tessera::client {
namespace {

// A region lets a character, and what a game's function moves, go on by its last input when it has none, so the end of
// steering is sent this often.
constexpr std::uint32_t kEndingInputs = 30;

}  // namespace

InputMaker::InputMaker(PlayerNumber player, std::uint32_t tick_rate_hz)
    : player_(player), tick_length_(1'000'000'000 / tick_rate_hz) {
  steering_.body = PlayerBodyId(player);
}

void InputMaker::Steer(const Steering& steering) {
  const bool looked = steering_.yaw_rad != steering.yaw_rad || steering_.pitch_rad != steering.pitch_rad;
  look_changed_ = look_changed_ || looked;
  steering_.force_n = steering.force_n;
  steering_.torque_nm = steering.torque_nm;
  steering_.move = steering.move;
  steering_.yaw_rad = steering.yaw_rad;
  steering_.pitch_rad = steering.pitch_rad;
  steering_.buttons = steering.buttons;
}

void InputMaker::Move(Vec3f force_n, Vec3f torque_nm) {
  steering_.force_n = force_n;
  steering_.torque_nm = torque_nm;
}

bool InputMaker::IsSteering() const {
  return steering_.force_n != Vec3f() || steering_.torque_nm != Vec3f() || steering_.move != Vec2f() ||
         steering_.buttons != 0;
}

std::vector<PlayerInput> InputMaker::MakeDue(TimePoint now, const World& world) {
  if (IsSteering() || look_changed_) last_steering_ = next_;
  look_changed_ = false;
  const bool ending = world.goes_on_alone && last_steering_ != 0 && next_ - last_steering_ < kEndingInputs;
  std::vector<PlayerInput> made;
  if (!world.moves || (!IsSteering() && !ending && !world.predicted)) {
    clock_.Stop();
    return made;
  }
  for (int due = clock_.Due(now, world.tick_rate_hz); due > 0; --due) {
    clock_.Made(next_);
    made.push_back(Make(steering_, world.shown_tick));
  }
  return made;
}

// The tick that an input is meant for: inputs act one a tick, after those that the region had not applied yet.
PlayerInput InputMaker::Make(const PlayerInput& asked, double shown_tick) {
  PlayerInput input = AsSent(asked);
  input.number = next_++;
  input.player = player_;
  input.shown_at = ShownAt(shown_tick);
  const bool own = input.body == PlayerBodyId(player_);
  if (own && applied_) input.target = applied_->tick + (input.number - std::min(input.number, applied_->input));
  queue_.Push(input);
  return input;
}

void InputMaker::SkipPast(std::uint32_t last_input) {
  if (last_input < next_) return;
  next_ = last_input + 1;
  queue_.Clear();
  clock_.Stop();
}

std::optional<std::uint32_t> InputMaker::Applied(TimePoint now, Tick tick, std::uint32_t last_input,
                                                 std::int32_t margin_ticks) {
  if (applied_ && tick < applied_->tick) return std::nullopt;
  if (applied_ && tick == applied_->tick) return applied_->input;
  applied_ = {tick, std::max(last_input, applied_ ? applied_->input : 0)};
  clock_.Applied(now, applied_->input, margin_ticks);
  return applied_->input;
}

void InputMaker::Forget() {
  last_applied_ = 0;
  applied_.reset();
  queue_.Clear();
  clock_.Stop();
}

}  // namespace tessera::client

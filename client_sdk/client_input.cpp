// What a client sends: inputs at the world's tick rate, each in a few datagrams, along with acknowledgements.
#include <algorithm>

#include "client_sdk/client_impl.h"

namespace tessera::client {
namespace {

// Datagrams that carry an input: two in a row may be lost.
constexpr int kSendings = 3;
// Ticks that one Poll makes up for; a longer pause is a pause.
constexpr std::int64_t kMaxCatchUp = 4;
static_assert(kMaxCatchUp < static_cast<std::int64_t>(replication::kMaxInputs));

}  // namespace

void Client::Impl::Push(BodyId body, Vec3f force_n, Vec3f torque_nm) {
  pending.push_back(
      {{.number = next_input++, .body = body, .target = Tick(), .force_n = force_n, .torque_nm = torque_nm},
       kSendings});
  // More than fit in a message means that nobody listens: the oldest are stale.
  if (pending.size() > replication::kMaxInputs) pending.pop_front();
}

void Client::Impl::MakeInputs(TimePoint now) {
  const bool steering = steering_force_n != Vec3f() || steering_torque_nm != Vec3f();
  if (!started || !steering) {
    inputs_made_at.reset();
    return;
  }
  const auto tick_length = std::chrono::nanoseconds(1'000'000'000 / session.tick_rate_hz);
  if (!inputs_made_at.has_value()) inputs_made_at = now - tick_length;  // the first one at once
  std::int64_t ticks = (now - *inputs_made_at) / tick_length;
  *inputs_made_at += ticks * tick_length;
  for (ticks = std::min(ticks, kMaxCatchUp); ticks > 0; --ticks) {
    Push(PlayerBodyId(session.player), steering_force_n, steering_torque_nm);
  }
}

// To the region that owns the body; to all while nobody is known to.
std::vector<replication::InputCommand> Client::Impl::InputsFor(const RegionLink& link) const {
  std::vector<replication::InputCommand> inputs;
  for (const PendingInput& input : pending) {
    const std::optional<RegionId> owner = world.OwnerOf(input.command.body);
    if (!owner.has_value() || *owner == link.region()) inputs.push_back(input.command);
  }
  return inputs;
}

void Client::Impl::SendInputs(TimePoint now) {
  for (RegionLink& link : links) Sent(link.Send(now, wire, InputsFor(link)));
  for (PendingInput& input : pending) --input.sendings_left;
  std::erase_if(pending, [](const PendingInput& input) { return input.sendings_left <= 0; });
}

std::uint32_t Client::Move(Vec3f force_n, Vec3f torque_nm) {
  impl_->steering_force_n = force_n;
  impl_->steering_torque_nm = torque_nm;
  return impl_->next_input;
}

std::uint32_t Client::MoveBody(BodyId body, Vec3f force_n, Vec3f torque_nm) {
  impl_->Push(body, force_n, torque_nm);
  return impl_->next_input - 1;
}

}  // namespace tessera::client

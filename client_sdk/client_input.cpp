// Sending: inputs at the world's tick rate, each in a few datagrams, along with acknowledgements.
#include <algorithm>
#include <utility>

#include "client_sdk/blend.h"
#include "client_sdk/client_impl.h"

namespace tessera::client {

// A predicted body that moves needs inputs, too: they give the tick that is shown.
void Client::Impl::MakeInputs(TimePoint now) {
  if (own.watches() || delivery.under_way()) return;
  const bool character = session.scene->player.has_value() && session.scene->player->character.has_value();
  const auto seen = world.bodies().find(own.id());
  const bool moves = prediction.on() && seen != world.bodies().end() && !AtRest(seen->second.state);
  const InputMaker::World in{.moves = progress.started() && !time.clock().paused,
                             .goes_on_alone = character || own.MovedByGame(),
                             .predicted = moves || prediction.NeedsInputs(),
                             .tick_rate_hz = time.playout().tick_rate_hz(),
                             .shown_tick = time.shown_tick()};
  for (const PlayerInput& input : inputs.MakeDue(now, in)) prediction.Add(input);
}

// A snapshot may take several datagrams, and the own body's record may be in any of them.
void Client::Impl::NoteApplied(TimePoint now, const RegionConnection& connection,
                               const replication::ReceivedSnapshot& snapshot) {
  const BodyId body = own.id();
  const auto seen = world.bodies().find(body);
  if (seen == world.bodies().end() || seen->second.region != connection.region()) return;
  const auto applied = inputs.Applied(now, snapshot.tick, snapshot.last_input, snapshot.input_margin_ticks);
  if (!applied) return;
  const bool sent = std::any_of(snapshot.bodies.begin(), snapshot.bodies.end(),
                                [&](const replication::BodyRecord& record) { return record.id == body; });
  const bool is_new = sent || AtRest(seen->second.state);
  prediction.Heard(now, is_new ? std::optional(std::pair(snapshot.tick, *applied)) : std::nullopt);
}

void Client::Impl::Correct() {
  WorkBudget budget(kUnitsAPoll);
  prediction.Correct(own, world, budget, events);
  figures.Work(budget.spent());
}

// Each input goes to the region that owns its body, and to all regions while the owner is unknown.
void Client::Impl::SendInputs(TimePoint now) {
  const bool due = inputs.Due(now);
  for (RegionConnection& connection : regions.all()) {
    const auto is_its_own = [&](BodyId body) {
      return world.OwnerOf(own.MovedBy(body)).value_or(connection.region()) == connection.region();
    };
    figures.Sent(connection.Send(now, network, due ? inputs.queue().Select(is_its_own) : std::vector<PlayerInput>()));
  }
  if (due) inputs.Sent(now);
}

std::uint32_t Client::Move(Vec3f force_n, Vec3f torque_nm) {
  impl_->inputs.Move(force_n, torque_nm);
  return impl_->inputs.next();
}

std::uint32_t Client::Steer(const Steering& steering) {
  impl_->inputs.Steer(steering);
  return impl_->inputs.next();
}

absl::Status Client::SetMovement(const tessera_movement* movement) { return impl_->prediction.SetMovement(movement); }

std::uint32_t Client::MoveBody(BodyId body, Vec3f force_n, Vec3f torque_nm) {
  if (impl_->own.watches()) return 0;
  PlayerInput asked;
  asked.body = body;
  asked.force_n = force_n;
  asked.torque_nm = torque_nm;
  const PlayerInput made = impl_->inputs.Make(asked, impl_->time.shown_tick());
  if (made.body == impl_->own.player_body()) impl_->prediction.Add(made);
  return made.number;
}

}  // namespace tessera::client

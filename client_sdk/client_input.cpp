// Sending: inputs at the world's tick rate, each in a few datagrams, along with acknowledgements.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "client_sdk/blend.h"
#include "client_sdk/client_impl.h"
#include "core/physics/body_path.h"

namespace tessera::client {

namespace {

// A predicted state counts as such for so many ticks after the last word of the own body's region; a failover takes
// less, and a world in which nothing moves is heard of twice as often.
constexpr double kStaleAfter_ticks = 60;

}  // namespace

// A predicted body that moves needs inputs, too: they give the tick that is shown.
void Client::Impl::MakeInputs(TimePoint now) {
  if (own.watches() || fetch) return;
  const bool character = session.scene->player.has_value() && session.scene->player->character.has_value();
  const auto seen = world.bodies().find(own.id());
  const bool moves = predictor && seen != world.bodies().end() && !AtRest(seen->second.state);
  const InputMaker::World in{.moves = started && !time.clock().paused,
                             .goes_on_alone = character || own.MovedByGame(),
                             .predicted = moves || (predictor && predictor->NeedsInputs()),
                             .tick_rate_hz = time.playout().tick_rate_hz(),
                             .shown_tick = time.shown_tick()};
  for (const PlayerInput& input : inputs.MakeDue(now, in)) {
    if (predictor) predictor->Add(input);
  }
}

void Client::Impl::NoteApplied(TimePoint now, const RegionConnection& connection,
                               const replication::ReceivedSnapshot& snapshot) {
  const BodyId body = own.id();
  const auto seen = world.bodies().find(body);
  if (seen == world.bodies().end() || seen->second.region != connection.region()) return;
  const auto applied = inputs.Applied(now, snapshot.tick, snapshot.last_input, snapshot.input_margin_ticks);
  if (!applied) return;
  own_heard_at = now;
  const bool sent = std::any_of(snapshot.bodies.begin(), snapshot.bodies.end(),
                                [&](const replication::BodyRecord& record) { return record.id == body; });
  if (sent || AtRest(seen->second.state)) correct_to = {snapshot.tick, *applied};
}

void Client::Impl::Correct() {
  if (!predictor) return;
  if (const auto seen = world.bodies().find(own.id()); seen == world.bodies().end()) {
    predictor->Forget();
  } else {
    WorkBudget budget(kUnitsAPoll);
    predictor->Prepare(seen->second.state, budget);
    figures.Work(budget.spent());
  }
  if (correct_to) predictor->Correct(correct_to->first, correct_to->second, world.bodies());
  correct_to.reset();
  for (const Correction& correction : predictor->TakeCorrections()) {
    const auto seen = world.bodies().find(own.id());
    events.push_back({.kind = ClientEvent::Kind::kPredictionCorrected,
                      .body = own.id(),
                      .other = correction.met,
                      .region = seen == world.bodies().end() ? RegionId() : seen->second.region,
                      .input_number = correction.last_input,
                      .detail = Describe(correction)});
  }
}

void Client::Impl::ShowOnPaths(double tick, std::vector<ShownBody>& shown) const {
  const auto of_regions = std::ssize(shown);
  const double time_s = std::max(tick, 0.0) / session.tick_rate_hz;
  for (const BodyDef* def : on_paths) shown.push_back({def->id, physics::PoseOn(*def->path, time_s)});
  std::ranges::inplace_merge(shown, shown.begin() + of_regions, {}, &ShownBody::id);
}

void Client::Impl::ShowPredicted(TimePoint now, std::vector<ShownBody>& shown) {
  if (!predictor) return;
  // Whoever has heard nothing of the own body for long shows where it was to be, and knows no more than of others.
  const double silent_s = std::chrono::duration<double>(now - own_heard_at).count();
  const bool stale = !time.clock().paused && silent_s * time.clock().ticks_per_second > kStaleAfter_ticks;
  auto at = shown.begin();
  std::vector<ShownBody> thrown;
  for (const PredictedBody& body : predictor->At(now, inputs.clock().Phase(now))) {
    if (body.thrown) {
      thrown.push_back({.id = body.id,
                        .pose = body.pose,
                        .extrapolated = stale,
                        .predicted = !stale,
                        .velocity_m_s = body.velocity_m_s,
                        .spin_rad_s = body.spin_rad_s});
      continue;
    }
    while (at != shown.end() && at->id < body.id) ++at;
    if (at == shown.end() || at->id != body.id) continue;
    at->pose = Between(at->pose, body.pose, body.weight);
    at->predicted = body.weight > 0.5 && !stale;
    at->extrapolated = at->extrapolated || stale;
  }
  if (predictor->thrown() > 0) ShowThrown(std::move(thrown), shown);
}

void Client::Impl::ShowThrown(std::vector<ShownBody> thrown, std::vector<ShownBody>& shown) const {
  std::erase_if(shown, [this](const ShownBody& body) {
    if (!IsSpawned(body.id)) return false;
    const auto seen = world.bodies().find(body.id);
    return seen != world.bodies().end() && predictor->Awaits(seen->second.tuning);
  });
  const auto of_server = std::ssize(shown);
  shown.insert(shown.end(), thrown.begin(), thrown.end());
  std::ranges::inplace_merge(shown, shown.begin() + of_server, {}, &ShownBody::id);
}

void Client::Impl::TellOfThrown() {
  if (!predictor) return;
  for (const ThrownNews& news : predictor->TakeThrown()) {
    if (news.body == BodyId()) {
      events.push_back({.kind = ClientEvent::Kind::kSpawnLost, .body = news.thrown, .detail = news.why});
      continue;
    }
    char metres[32];
    std::snprintf(metres, sizeof(metres), "%.3f m off", news.off_m);
    events.push_back({.kind = ClientEvent::Kind::kSpawnTaken,
                      .body = news.body,
                      .other = news.thrown,
                      .region = world.OwnerOf(news.body).value_or(RegionId()),
                      .detail = metres,
                      .off_m = news.off_m});
  }
}

// Each input goes to the region that owns its body, and to all regions while the owner is unknown.
void Client::Impl::SendInputs(TimePoint now) {
  const bool due = inputs.Due(now);
  for (RegionConnection& connection : connections) {
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

absl::Status Client::SetMovement(const tessera_movement* movement) {
  impl_->movement = nullptr;
  const absl::Status status = movement == nullptr ? absl::OkStatus() : CheckMovement(*movement);
  const tessera_movement* const good = status.ok() ? movement : nullptr;
  if (!impl_->predictor) {
    impl_->movement = good;
    return status;
  }
  const absl::Status fits = impl_->predictor->SetMovement(good);
  return status.ok() ? fits : status;
}

std::uint32_t Client::MoveBody(BodyId body, Vec3f force_n, Vec3f torque_nm) {
  if (impl_->own.watches()) return 0;
  PlayerInput asked;
  asked.body = body;
  asked.force_n = force_n;
  asked.torque_nm = torque_nm;
  const PlayerInput made = impl_->inputs.Make(asked, impl_->time.shown_tick());
  if (impl_->predictor && made.body == impl_->own.player_body()) impl_->predictor->Add(made);
  return made.number;
}

}  // namespace tessera::client

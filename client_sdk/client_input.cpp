// Sending: inputs at the world's tick rate, each in a few datagrams, along with acknowledgements.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "client_sdk/blend.h"
#include "client_sdk/client_impl.h"
#include "core/physics/body_path.h"

namespace tessera::client {

namespace {

// A region lets a character, and what a game's function moves, go on by its last input when it has none, so the end of
// steering is sent this often.
constexpr std::uint32_t kEndingInputs = 30;
// A predicted state counts as such for so many ticks after the last word of the own body's region; a failover takes
// less, and a world in which nothing moves is heard of twice as often.
constexpr double kStaleAfter_ticks = 60;

}  // namespace

// The tick that an input is meant for: inputs act one a tick, after those that the region had not applied yet.
void Client::Impl::Push(const PlayerInput& asked) {
  PlayerInput input = AsSent(asked);
  input.number = next_input++;
  input.player = own.player();
  input.shown_at = ShownAt(time.shown_tick());
  const bool its_own = input.body == own.player_body();
  if (its_own && applied) input.target = applied->tick + (input.number - std::min(input.number, applied->input));
  inputs.Push(input);
  if (its_own && predictor) predictor->Add(input);
}

bool Client::Impl::IsSteering() const {
  return steering.force_n != Vec3f() || steering.torque_nm != Vec3f() || steering.move != Vec2f() ||
         steering.buttons != 0;
}

// While the player steers, one input a tick. A predicted body that moves needs them too: they give the tick that is
// shown. A character needs some that say that steering has ended, or that the player looks elsewhere.
void Client::Impl::MakeInputs(TimePoint now) {
  if (own.watches() || fetch) return;
  if (IsSteering() || look_changed) last_steering_input = next_input;
  look_changed = false;
  const bool character = session.scene->player.has_value() && session.scene->player->character.has_value();
  const bool goes_on = character || own.MovedByGame();
  const bool ending = goes_on && last_steering_input != 0 && next_input - last_steering_input < kEndingInputs;
  const bool steers = IsSteering() || ending;
  const auto seen = world.bodies().find(own.id());
  const bool moves = predictor && seen != world.bodies().end() && !AtRest(seen->second.state);
  const bool predicted = moves || (predictor && predictor->NeedsInputs());
  if (!started || time.clock().paused || (!steers && !predicted)) {
    input_clock.Stop();
    return;
  }
  for (int due = input_clock.Due(now, time.playout().tick_rate_hz()); due > 0; --due) {
    input_clock.Made(next_input);
    Push(steering);
  }
}

void Client::Impl::NoteApplied(TimePoint now, const RegionConnection& connection,
                               const replication::ReceivedSnapshot& snapshot) {
  const BodyId body = own.id();
  const auto seen = world.bodies().find(body);
  if (seen == world.bodies().end() || seen->second.region != connection.region()) return;
  if (applied && snapshot.tick <= applied->tick) return;
  own_heard_at = now;
  applied = {snapshot.tick, std::max(snapshot.last_input, applied ? applied->input : 0)};
  input_clock.Applied(now, applied->input, snapshot.input_margin_ticks);
  const bool sent = std::any_of(snapshot.bodies.begin(), snapshot.bodies.end(),
                                [&](const replication::BodyRecord& record) { return record.id == body; });
  if (sent || AtRest(seen->second.state)) correct_to = applied;
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
  if (correct_to) predictor->Correct(correct_to->tick, correct_to->input, world.bodies());
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
  for (const PredictedBody& body : predictor->At(now, input_clock.Phase(now))) {
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
  const bool due = inputs.Due(now, std::chrono::nanoseconds(1'000'000'000 / session.tick_rate_hz));
  for (RegionConnection& connection : connections) {
    const auto is_its_own = [&](BodyId body) {
      return world.OwnerOf(own.MovedBy(body)).value_or(connection.region()) == connection.region();
    };
    figures.Sent(connection.Send(now, network, due ? inputs.Select(is_its_own) : std::vector<PlayerInput>()));
  }
  if (due) inputs.Sent(now);
}

std::uint32_t Client::Move(Vec3f force_n, Vec3f torque_nm) {
  impl_->steering.force_n = force_n;
  impl_->steering.torque_nm = torque_nm;
  return impl_->next_input;
}

std::uint32_t Client::Steer(const Steering& steering) {
  PlayerInput& asked = impl_->steering;
  const bool looked = asked.yaw_rad != steering.yaw_rad || asked.pitch_rad != steering.pitch_rad;
  impl_->look_changed = impl_->look_changed || looked;
  asked.force_n = steering.force_n;
  asked.torque_nm = steering.torque_nm;
  asked.move = steering.move;
  asked.yaw_rad = steering.yaw_rad;
  asked.pitch_rad = steering.pitch_rad;
  asked.buttons = steering.buttons;
  return impl_->next_input;
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
  impl_->Push(asked);
  return impl_->next_input - 1;
}

}  // namespace tessera::client

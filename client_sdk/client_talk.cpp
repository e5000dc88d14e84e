// This file carries commands of the player up to the game, and events of the game down to the player.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client_sdk/client_impl.h"
#include "core/game/joint.h"
#include "core/game/settings.h"
#include "core/world/limits.h"
#include "core/world/prefab.h"

namespace tessera::client {
namespace {

// A body that was thrown waits so much longer than a round trip for the server's, and at least for as long as the game
// may wait for the command's input, and for so many snapshots.
constexpr double kAwaited_s = 0.5, kAwaited_snapshots = 3;

// Ground is known about the own body.
constexpr double kMostFromOwn_m = 20;

// Names the field that the game's own function would refuse; empty: none.
std::string WrongIn(const SpawnAsk& ask, const Prefab& prefab) {
  const SpawnMotion& motion = ask.motion;
  if (prefab.bodies.size() != 1) {
    return absl::StrCat("prefab: \"", prefab.name, "\" has ", prefab.bodies.size(),
                        " bodies, and one can be predicted");
  }
  if (!IsFinite(motion.position)) return "position: is not finite";
  // Written so that a NaN fails.
  if (!(std::abs(Length(motion.rotation) - 1) <= kUnitTolerance)) return "orientation: is not of length 1";
  if (!(Length(motion.velocity_m_s) <= game::kMaxGameSpeed_m_s)) {
    return absl::StrCat("velocity: is not finite, or above ", game::kMaxGameSpeed_m_s, " m/s");
  }
  if (!(Length(motion.spin_rad_s) <= kMaxAngularSpeed_rad_s)) {
    return absl::StrCat("spin: is not finite, or above ", kMaxAngularSpeed_rad_s, " rad/s");
  }
  return "";
}

}  // namespace

void Client::Impl::On(TimePoint, RegionConnection& connection, const replication::NewsOfPlayer& news) {
  switch (talk.Take(news)) {
    case GameTalk::News::kMalformed:
      return connection.CountError();
    case GameTalk::News::kOld:
      return;
    case GameTalk::News::kNew:
      break;
  }
  if (news.spectating && !IsFinite(news.view)) return connection.CountError();
  own.LookFrom(news.spectating ? std::optional(news.view) : std::nullopt);
  const BodyId moved(news.controlled_body);
  const bool known = moved == BodyId() || prediction.Knows(moved);
  const absl::StatusOr<std::vector<game::JointOfBody>> joints = game::DecodeJoints(news.joints);
  if (WrongField(news.limits) != nullptr || !known || !joints.ok()) return connection.CountError();
  prediction.Follow(moved == BodyId() ? own.player_body() : moved, news.limits, *joints);
  own.Control(moved);
}

void Client::Impl::On(TimePoint, RegionConnection& connection, const replication::CommandRefusal& refusal) {
  talk.Take(refusal);
  events.push_back({.kind = ClientEvent::Kind::kCommandRefused,
                    .region = connection.region(),
                    .input_number = refusal.number,
                    .detail = refusal.detail});
}

void Client::Impl::On(TimePoint now, RegionConnection& connection, const replication::NewsOfWorld& news) {
  switch (properties.Take(news, delivery.under_way() ? nullptr : &session.scene->instance_properties, events)) {
    case WorldProperties::News::kMalformed:
      return connection.CountError();
    case WorldProperties::News::kOld:
    case WorldProperties::News::kSame:
      return;
    case WorldProperties::News::kNew:
      recording.World(now, news.properties);
  }
}

// To the region that owns the own body, and to all while that is unknown.
void Client::Impl::SendCommands(TimePoint now) {
  const auto bytes = talk.Write(now, regions.AnyWelcomed());
  if (!bytes) return;
  for (RegionConnection& connection : regions.all()) {
    if (world.OwnerOf(own.id()).value_or(connection.region()) != connection.region()) continue;
    figures.Sent(connection.SendCommands(now, network, *bytes));
  }
}

absl::Status Client::Send(std::string_view bytes) {
  if (impl_->playback) return absl::FailedPreconditionError("a recording takes no commands");
  if (impl_->own.watches()) return absl::FailedPreconditionError("a viewer sends no commands");
  if (impl_->progress.ended()) return absl::FailedPreconditionError("the client has ended");
  return impl_->talk.Push(bytes, ShownAt(impl_->time.shown_tick()));
}

absl::StatusOr<BodyId> Client::PredictSpawn(const SpawnAsk& ask, std::string_view command) {
  Impl& me = *impl_;
  if (me.playback) return absl::FailedPreconditionError("a recording takes no commands");
  if (me.own.watches()) return absl::FailedPreconditionError("a viewer sends no commands");
  if (me.progress.ended()) return absl::FailedPreconditionError("the client has ended");
  constexpr char kNotYet[] = "nothing is predicted here, or not yet";
  if (me.delivery.under_way()) return absl::FailedPreconditionError(kNotYet);
  const std::vector<Prefab>& prefabs = me.session.scene->prefabs;
  const auto prefab = std::ranges::find(prefabs, ask.prefab, &Prefab::name);
  if (prefab == prefabs.end()) {
    return absl::NotFoundError(
        absl::StrCat("prefab: the scene has no \"", std::string(ask.prefab.substr(0, 63)), "\""));
  }
  if (const std::string wrong = WrongIn(ask, *prefab); !wrong.empty()) {
    return absl::InvalidArgumentError(wrong);
  }
  const auto own = me.world.bodies().find(me.own.id());
  const std::optional<std::uint32_t> number = me.talk.next();
  if (own == me.world.bodies().end() || !me.prediction.running() || !number || !me.last_poll) {
    return absl::FailedPreconditionError(kNotYet);
  }
  const Vec3d from_own = ask.from_own ? ask.motion.position : ask.motion.position - own->second.state.position;
  if (!(Length(from_own) <= kMostFromOwn_m)) {
    return absl::InvalidArgumentError(absl::StrCat("position: is more than ", kMostFromOwn_m, " m from the own body"));
  }
  if (me.time.clock().paused) return absl::FailedPreconditionError("the world is paused");
  if (me.prediction.thrown() >= kMaxPredictedSpawns) {
    return absl::ResourceExhaustedError(absl::StrCat(kMaxPredictedSpawns, " bodies are predicted already"));
  }
  const absl::Status sent = me.talk.Push(command, ShownAt(me.time.shown_tick()), me.inputs.next());
  if (!sent.ok()) return sent;
  // The world's ticks may be long: slow motion.
  const double ticks =
      game::kMaxCommandWait_ticks + kAwaited_snapshots * me.session.tick_rate_hz / me.session.snapshot_rate_hz;
  const std::chrono::duration<double> awaited(
      me.Stats().round_trip_s + std::max(kAwaited_s, ticks / std::max(1.0, me.time.clock().ticks_per_second)));
  const TimePoint until = *me.last_poll + std::chrono::duration_cast<Clock::duration>(awaited);
  SpawnAsk made = ask;
  made.motion.rotation = Normalized(ask.motion.rotation);
  const auto place = static_cast<std::size_t>(prefab - prefabs.begin());
  return me.prediction.Throw(made, place, {me.own.player(), *number}, me.inputs.next(), until);
}

std::vector<GameEvent> Client::TakeGameEvents() { return impl_->talk.TakeEvents(); }

std::optional<PropertyValue> Client::WorldPropertyOf(std::string_view name) const {
  return ValueOf(impl_->session.scene->instance_properties, {}, impl_->properties.changed(), name);
}

std::optional<Vec3d> Client::spectator_view() const { return impl_->own.spectator_view(); }

std::string Client::NameOf(PlayerNumber player) const {
  const auto seen = impl_->world.bodies().find(PlayerBodyId(player));
  if (seen == impl_->world.bodies().end() || seen->second.properties == nullptr) return "";
  const auto set = PropertySet::Decode(*seen->second.properties, impl_->session.scene->properties);
  return set.ok() ? set->player_name() : "";
}

}  // namespace tessera::client

#include "core/game/player_calls.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/arguments.h"
#include "core/game/control_calls.h"
#include "core/game/player_record.h"
#include "core/game/settings.h"
#include "core/world/limits.h"

namespace tessera::game {
namespace {

using PlayerArguments = std::span<const tessera_game_value>;

constexpr std::uint64_t kInstructionsOfPlayer = 5;  // that world.players and world.broadcast cost for each

absl::string_view NameOf(const Function& function) { return {function.name.data(), function.name.size()}; }

absl::Status Refusal(const Function& function, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(NameOf(function), ": ", what));
}

tessera_game_value FlagValue(bool flag) { return ToInterface(GameValue(flag)); }

// The player's own body, for changing.
absl::StatusOr<Transaction::Changes*> OwnBody(tessera_game_call& call, const Function& function, PlayerNumber player) {
  Transaction::Changes* const body = call.transaction.Own(PlayerBodyId(player));
  if (body != nullptr) return body;
  return absl::FailedPreconditionError(
      absl::StrCat(NameOf(function), ": player ", player.value(), " has no body that this region owns"));
}

absl::Status End(tessera_game_call& call, const Function& function, PlayerNumber player, std::string_view reason,
                 PlayerStage stage, PlayerRecord& record) {
  if (call.callback == kOnLeave && call.self == PlayerBodyId(player)) {
    return absl::FailedPreconditionError(absl::StrCat(NameOf(function), ": the player leaves already"));
  }
  if (const absl::Status status = CheckEndReason(reason); !status.ok()) {
    return Refusal(function, absl::StrCat("`reason` ", status.message()));
  }
  if (record.ended()) return absl::OkStatus();  // the first reason counts
  ReleaseControl(call.transaction, player);
  record.stage = stage;
  record.reason = reason.empty() ? "sent away by the game" : std::string(reason);
  record.commands.clear();
  record.events.clear();
  return absl::OkStatus();
}

absl::StatusOr<PlayerEvent> EventFrom(const Function& function, PlayerArguments arguments) {
  PlayerEvent event;
  event.name = std::string(TextGiven(arguments[0]));
  if (const absl::Status status = CheckEventName(event.name); !status.ok()) {
    return Refusal(function, absl::StrCat("`name` ", status.message()));
  }
  if (arguments.size() < 2 || arguments[1].type == TESSERA_GAME_NOTHING) return event;
  const auto fields = FieldsFrom(arguments[1]);
  if (!fields.ok()) return Refusal(function, fields.status().message());
  auto bytes = EncodeFields(*fields);
  if (!bytes.ok()) return Refusal(function, bytes.status().message());
  event.values = *std::move(bytes);
  return event;
}

bool HasRoom(const PlayerRecord& record, const PlayerEvent& event) {
  return record.events.size() < kMaxWaitingEventsOfPlayer &&
         record.event_bytes() + event.bytes() <= kMaxWaitingEventBytes && record.last_event < UINT32_MAX;
}

void Add(PlayerEvent event, PlayerRecord& record) {
  ++record.last_event;
  record.events.push_back(std::move(event));
}

// Puts the player's body where the arguments say, standing still.
absl::Status Put(tessera_game_call& call, const Function& function, PlayerNumber player, PlayerArguments arguments,
                 GameRecord& record) {
  const BodyId id = PlayerBodyId(player);
  const double* const at = arguments[0].as.vector;
  const Vec3d place{at[0], at[1], at[2]};
  const Scene& scene = call.transaction.world().scene();
  if (!scene.bounds.Contains(place)) {
    return Refusal(function,
                   absl::StrCat("(", place.x, ", ", place.y, ", ", place.z, ") is outside the scene's bounds"));
  }
  BodyState state;
  state.position = place;
  state.orientation = call.transaction.StateOf(id).orientation;
  if (arguments.size() > 1 && arguments[1].type != TESSERA_GAME_NOTHING) {
    const double* const q = arguments[1].as.rotation;
    const Quatd given{q[0], q[1], q[2], q[3]};
    if (std::abs(Length(given) - 1) > kUnitTolerance) return Refusal(function, "`rotation` is not of length 1");
    state.orientation = Normalized(given);
  }
  call.transaction.Place(id, state);
  // Within on_join nobody has seen it elsewhere.
  if (call.callback != kOnJoin) {
    record.jumped = true;
    ++record.jumps;
  }
  record.push_ns = record.push_nms = Vec3f();
  return absl::OkStatus();
}

tessera_game_value InputFields(tessera_game_call& call, PlayerNumber player) {
  static const PlayerInput kNothing;
  const PlayerInput* const known = call.transaction.world().InputOf(player);
  const PlayerInput& input = known == nullptr ? kNothing : *known;
  call.fields.clear();
  const auto add = [&](std::string_view name, const GameValue& value) {
    call.fields.push_back({name.data(), name.size(), ToInterface(value)});
  };
  add("buttons", std::int64_t{input.buttons});
  add("look", call.transaction.world().LookOf(input));
  add("move", Vec3d{input.move.x, input.move.y, 0});
  add("pitch", double{input.pitch_rad});
  add("yaw", double{input.yaw_rad});
  tessera_game_value result{};
  result.type = TESSERA_GAME_FIELDS;
  result.count = static_cast<std::uint32_t>(call.fields.size());
  result.as.fields = call.fields.data();
  return result;
}

// The time that a client names is a claim: nobody sees the future, and naming a past too long gone gains nothing.
double ShownTime(const tessera_game_call& call, PlayerNumber player) {
  const PlayerInput* const input = call.transaction.world().InputOf(player);
  const bool of_command = call.callback == kOnCommand && call.self == PlayerBodyId(player);
  const std::uint64_t said = of_command ? call.shown_at : input == nullptr ? 0 : input->shown_at;
  const auto now = static_cast<double>(call.tick.value());
  if (said == 0) return now;
  const double oldest = now - kMaxLookBack_s * call.transaction.world().scene().tick_rate_hz;
  return std::clamp(static_cast<double>(said) / static_cast<double>(kShownParts), std::max(oldest, 0.0), now);
}

absl::StatusOr<tessera_game_value> Send(const Function& function, PlayerNumber player, PlayerArguments arguments,
                                        PlayerRecord& record) {
  auto event = EventFrom(function, arguments);
  if (!event.ok()) return event.status();
  if (!HasRoom(record, *event)) {
    return absl::ResourceExhaustedError(absl::StrCat(NameOf(function), ": player ", player.value(), " has ",
                                                     record.events.size(), " events with ", record.event_bytes(),
                                                     " bytes that its client has not taken"));
  }
  Add(*std::move(event), record);
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> ChangePlayer(tessera_game_call& call, const Function& function, PlayerNumber player,
                                                PlayerArguments arguments, GameRecord& record) {
  const bool ended = record.player->ended();
  absl::Status status;
  switch (function.number) {
    case kPlayerRefuse:
      if (call.callback != kOnJoin || call.self != PlayerBodyId(player)) {
        status = absl::FailedPreconditionError("refuse: only on_join may refuse, and the player that it is about");
      } else {
        status = End(call, function, player, TextGiven(arguments[0]), PlayerStage::kRefused, record.player.Change());
      }
      break;
    case kPlayerKick:
      status = End(call, function, player, TextGiven(arguments[0]), PlayerStage::kKicked, record.player.Change());
      break;
    default:
      if (ended) {
        return absl::FailedPreconditionError(
            absl::StrCat(NameOf(function), ": player ", player.value(), " was sent away"));
      }
      if (function.number == kPlayerSend) return Send(function, player, arguments, record.player.Change());
      if (function.number == kPlayerControl) return CallControl(call, function, player, arguments);
      if (function.number == kPlayerSetLimits) return CallSetLimits(function, record.player.Change(), arguments);
      if (function.number == kPlayerPlace && record.player->stage == PlayerStage::kDriving) {
        return Refusal(function, "the player moves another body, and is where that is");
      }
      if (function.number != kPlayerPlace) ReleaseControl(call.transaction, player);
      status = Put(call, function, player, arguments, record);
      if (status.ok() && function.number == kPlayerSpectate) record.player.Change().stage = PlayerStage::kSpectating;
      if (status.ok() && function.number == kPlayerRespawn) record.player.Change().stage = PlayerStage::kPlaying;
  }
  if (!status.ok()) return status;
  return tessera_game_value{};
}

}  // namespace

absl::StatusOr<tessera_game_value> CallPlayer(tessera_game_call& call, const Function& function, PlayerNumber player,
                                              PlayerArguments arguments) {
  const BodyId id = PlayerBodyId(player);
  if (function.number == kPlayerBody) return ToInterface(GameValue(id));
  if (function.number == kPlayerNumber) return ToInterface(GameValue(std::int64_t{player.value()}));
  if (function.number == kPlayerIsOwn) return FlagValue(call.transaction.Owns(id));
  const auto body = OwnBody(call, function, player);
  if (!body.ok()) return body.status();
  switch (function.number) {
    case kPlayerName: {
      call.text = (*body)->properties.player_name();
      tessera_game_value result{};
      result.type = TESSERA_GAME_TEXT;
      result.count = static_cast<std::uint32_t>(call.text.size());
      result.as.text = call.text.data();
      return result;
    }
    case kPlayerControlled:
      return ControlledBy(call, player);
    case kPlayerInput:
      return InputFields(call, player);
    case kPlayerShownTime:
      return ToInterface(GameValue(ShownTime(call, player)));
    case kPlayerIsSpectating:
      return FlagValue((*body)->record.player->stage == PlayerStage::kSpectating);
    default:
      return ChangePlayer(call, function, player, arguments, (*body)->record);
  }
}

absl::StatusOr<tessera_game_value> CallPlayers(tessera_game_call& call, const Function& function,
                                               PlayerArguments arguments) {
  const std::vector<BodyId> bodies = call.transaction.world().PlayerBodies();
  call.instructions += kInstructionsOfPlayer * bodies.size();
  if (function.number == kWorldPlayers) {
    call.values.clear();
    for (const BodyId id : bodies) call.values.push_back(ToInterface(GameValue(PlayerOf(id))));
    tessera_game_value result{};
    result.type = TESSERA_GAME_LIST;
    result.count = static_cast<std::uint32_t>(call.values.size());
    result.as.list = call.values.data();
    return result;
  }
  const auto event = EventFrom(function, arguments);
  if (!event.ok()) return event.status();
  std::int64_t sent = 0;
  for (const BodyId id : bodies) {
    Transaction::Changes& body = *call.transaction.Own(id);
    if (body.record.player->ended() || !HasRoom(*body.record.player, *event)) continue;
    Add(*event, body.record.player.Change());
    ++sent;
  }
  return ToInterface(GameValue(sent));
}

}  // namespace tessera::game

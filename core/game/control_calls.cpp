#include "core/game/control_calls.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/message_calls.h"
#include "core/game/option_reader.h"
#include "core/game/settings.h"
#include "core/game/value.h"
#include "core/world/limits.h"

namespace tessera::game {
namespace {

// In the message that answers: where the body is, or why the player does not get it.
constexpr char kAtField[] = "at", kReasonField[] = "reason";
// How long a player waits for an answer, and a body for its player: a message over ten borders, and the way.
constexpr std::uint64_t kControlWait_s = 2;

Tick WaitFrom(const Transaction& transaction, Tick now) {
  return now + kControlWait_s * transaction.world().scene().tick_rate_hz;
}

std::string Named(BodyId id) { return absl::StrCat("body ", id.value()); }

// Why inputs cannot move it; empty if they can.
std::string WhyNotMoved(const BodyDef* def, BodyId id) {
  if (IsPlayerBody(id)) return " is a player's own";
  if (def == nullptr) return "";
  if (def->motion != Motion::kDynamic) return " does not move";
  return def->kinematic ? " is kinematic: no force moves it" : "";
}

// Both are owned here, and the player is meant to have the body.
void TakeControl(Transaction& transaction, PlayerNumber player, BodyId id) {
  const BodyId own = PlayerBodyId(player);
  GameRecord& moved = transaction.Own(id)->record;
  moved.driver = player;
  moved.driver_until = Tick();
  PlayerRecord& record = transaction.Own(own)->record.player.Change();
  record.stage = PlayerStage::kDriving;
  record.controls = id;
  record.controls_until = Tick();
  BodyState aside;
  aside.position = transaction.StateOf(id).position;
  transaction.Place(own, aside);
}

void EndControl(PlayerRecord& record) {
  record.controls = BodyId();
  record.controls_until = Tick();
  if (record.stage == PlayerStage::kDriving) record.stage = PlayerStage::kSpectating;
}

void AnswerPlayer(Transaction& transaction, BodyId body, PlayerNumber player, const std::string& reason, Tick now) {
  GameFields fields;
  if (reason.empty()) {
    fields.emplace_back(kAtField, transaction.StateOf(body).position);
  } else {
    fields.emplace_back(kReasonField, reason.substr(0, 200));
  }
  Message message;
  message.verb = kPlayerControl;
  message.speaker = body;
  if (auto bytes = EncodeFields(fields, kMaxMessageBytes); bytes.ok()) message.values = *std::move(bytes);
  const absl::Status sent = transaction.Send(body, PlayerBodyId(player), now, std::move(message));
  if (!sent.ok()) transaction.Log(absl::StrCat("control: no answer: ", sent.message()));
}

// Whether nobody else has the body; the reason if not. The first that comes gets it.
std::string WhyNotFree(const Transaction& transaction, BodyId id, PlayerNumber player, Tick now) {
  if (const std::string why = WhyNotMoved(transaction.Find(id), id); !why.empty()) return Named(id) + why;
  const GameRecord& record = transaction.RecordOf(id);
  const bool held = record.driver_until == Tick() || record.driver_until > now;
  if (record.driver != PlayerNumber() && record.driver != player && held) {
    return absl::StrCat(Named(id), " is moved by player ", record.driver.value());
  }
  for (const BodyId other : transaction.world().AssemblyOf(id)) {
    if (other == id) continue;
    const PlayerNumber driver = IsPlayerBody(other) ? PlayerOf(other) : transaction.RecordOf(other).driver;
    if (driver != PlayerNumber() && driver != player) {
      return absl::StrCat(Named(id), " hangs together with what player ", driver.value(), " moves");
    }
    // A grant has one player's inputs, so the player's own body may not hang at it either.
    if (IsPlayerBody(other)) return absl::StrCat(Named(id), " hangs together with the player's own body");
  }
  return "";
}

absl::Status DecideControl(tessera_game_call& call, BodyId id, BodyId speaker) {
  if (!IsPlayerBody(speaker)) return absl::InvalidArgumentError("control: a message of no player");
  const PlayerNumber player = PlayerOf(speaker);
  Transaction& transaction = call.transaction;
  if (const std::string why = WhyNotFree(transaction, id, player, call.tick); !why.empty()) {
    AnswerPlayer(transaction, id, player, why, call.tick);
    return absl::OkStatus();
  }
  GameRecord& record = transaction.Own(id)->record;
  if (record.driver == player && record.driver_until == Tick()) return absl::OkStatus();
  if (transaction.Owns(speaker)) {
    // A player who has asked for another one, or for none, meanwhile gets that.
    if (transaction.RecordOf(speaker).player->controls != id) return absl::OkStatus();
    TakeControl(transaction, player, id);
    call.control_news.push_back({player, id, ""});
    return absl::OkStatus();
  }
  record.driver = player;
  record.driver_until = WaitFrom(transaction, call.tick);
  AnswerPlayer(transaction, id, player, "", call.tick);
  return absl::OkStatus();
}

absl::Status TakeAnswer(tessera_game_call& call, BodyId own, const Message& message) {
  const absl::StatusOr<GameFields> fields = DecodeFields(message.values, kMaxMessageBytes);
  if (!fields.ok()) return fields.status();
  if (fields->size() != 1) return absl::InvalidArgumentError("control: an answer without a reason or a place");
  Transaction& transaction = call.transaction;
  const PlayerNumber player = PlayerOf(own);
  PlayerRecord& record = transaction.Own(own)->record.player.Change();
  // The player has changed its mind: who holds the body for it gives it up in a while.
  if (record.controls != message.speaker || record.controls_until == Tick()) return absl::OkStatus();
  if (const auto* reason = std::get_if<std::string>(&fields->front().second); reason != nullptr) {
    EndControl(record);
    call.control_news.push_back({player, BodyId(), *reason});
    return absl::OkStatus();
  }
  const auto* const at = std::get_if<Vec3d>(&fields->front().second);
  if (at == nullptr) return absl::InvalidArgumentError("control: an answer with another value");
  if (transaction.Owns(record.controls) && transaction.RecordOf(record.controls).driver == player) {
    const BodyId id = record.controls;
    TakeControl(transaction, player, id);
    call.control_news.push_back({player, id, ""});
    return absl::OkStatus();
  }
  record.stage = PlayerStage::kDriving;
  record.controls_until = WaitFrom(transaction, call.tick);
  BodyState aside;
  aside.position = *at;
  transaction.Place(own, aside);
  return absl::OkStatus();
}

void SettlePlayer(Transaction& transaction, PlayerNumber player, Tick now, std::vector<ControlNews>& news) {
  PlayerRecord& record = transaction.Own(PlayerBodyId(player))->record.player.Change();
  const BodyId id = record.controls;
  const bool here = transaction.Owns(id);
  const bool its = here && transaction.RecordOf(id).driver == player;
  const auto end = [&](const std::string& reason) {
    EndControl(record);
    news.push_back({player, BodyId(), reason});
  };
  if (record.controls_until == Tick()) {
    if (here && !its) return end(absl::StrCat(Named(id), " is the player's no more"));
    if (transaction.world().IsRemoved(id)) return end(absl::StrCat(Named(id), " is gone"));
    // A death may have parted the two.
    if (!here) record.controls_until = WaitFrom(transaction, now);
    return;
  }
  if (record.stage == PlayerStage::kDriving && its) {
    TakeControl(transaction, player, id);
    news.push_back({player, id, ""});
  } else if (transaction.world().IsRemoved(id)) {
    end(absl::StrCat(Named(id), " is gone"));
  } else if (record.controls_until <= now) {
    end(absl::StrCat(Named(id), " was not found within ", 2 * kControlWait_s, " seconds"));
  }
}

void SettleMoved(Transaction& transaction, BodyId id, Tick now) {
  GameRecord& record = transaction.Own(id)->record;
  const BodyId own = PlayerBodyId(record.driver);
  const bool here = transaction.Owns(own);
  const bool its = here && transaction.RecordOf(own).player->controls == id;
  if (record.driver_until == Tick() && !here) {
    record.driver_until = WaitFrom(transaction, now);
  } else if (record.driver_until == Tick() ? !its : record.driver_until <= now) {
    record.driver = PlayerNumber();
    record.driver_until = Tick();
  }
}

}  // namespace

void ReleaseControl(Transaction& transaction, PlayerNumber player) {
  const SharedPlayerRecord& now = transaction.Own(PlayerBodyId(player))->record.player;
  if (now->controls == BodyId()) return;
  if (Transaction::Changes* moved = transaction.Own(now->controls);
      moved != nullptr && moved->record.driver == player) {
    moved->record.driver = PlayerNumber();
    moved->record.driver_until = Tick();
  }
  EndControl(transaction.Own(PlayerBodyId(player))->record.player.Change());
}

absl::StatusOr<tessera_game_value> CallControl(tessera_game_call& call, const Function& function, PlayerNumber player,
                                               std::span<const tessera_game_value> arguments) {
  Transaction& transaction = call.transaction;
  const BodyId own = PlayerBodyId(player);
  if (arguments.empty() || arguments[0].type == TESSERA_GAME_NOTHING) {
    ReleaseControl(transaction, player);
    PlayerRecord& record = transaction.Own(own)->record.player.Change();
    record.stage = PlayerStage::kSpectating;
    return tessera_game_value{};
  }
  const BodyId id(arguments[0].as.id);
  if (id == own) return absl::InvalidArgumentError("control: respawn gives a player its own body back");
  if (const std::string why = WhyNotMoved(transaction.Find(id), id); !why.empty()) {
    return absl::InvalidArgumentError(absl::StrCat("control: ", Named(id), why));
  }
  if (transaction.RecordOf(own).player->controls == id) return tessera_game_value{};
  Message message;
  message.verb = kPlayerControl;
  if (absl::Status status = SendAs(call, function, own, id, std::move(message)); !status.ok()) return status;
  ReleaseControl(transaction, player);
  PlayerRecord& record = transaction.Own(own)->record.player.Change();
  record.controls = id;
  record.controls_until = WaitFrom(transaction, call.tick);
  return tessera_game_value{};
}

tessera_game_value ControlledBy(const tessera_game_call& call, PlayerNumber player) {
  const GameRecord record = call.transaction.RecordOf(PlayerBodyId(player));
  if (record.player->stage == PlayerStage::kPlaying) return ToInterface(GameValue(PlayerBodyId(player)));
  const BodyId driven = record.player->driven();
  return driven == BodyId() ? tessera_game_value{} : ToInterface(GameValue(driven));
}

absl::StatusOr<tessera_game_value> ControllerOf(const tessera_game_call& call, const Function& function, BodyId id) {
  const absl::string_view name(function.name.data(), function.name.size());
  if (!call.transaction.Owns(id)) {
    return absl::FailedPreconditionError(absl::StrCat(name, ": ", Named(id), " is not owned by this region"));
  }
  const GameRecord record = call.transaction.RecordOf(id);
  const bool own = IsPlayerBody(id) && record.player->stage == PlayerStage::kPlaying;
  const PlayerNumber player = own ? PlayerOf(id) : record.driver_until == Tick() ? record.driver : PlayerNumber();
  return player == PlayerNumber() ? tessera_game_value{} : ToInterface(GameValue(player));
}

absl::StatusOr<tessera_game_value> CallSetLimits(const Function& function, PlayerRecord& record,
                                                 std::span<const tessera_game_value> arguments) {
  OptionReader options(function, arguments[0]);
  const auto narrow = [](const std::optional<double>& value) {
    return value ? std::optional(static_cast<float>(*value)) : std::nullopt;
  };
  PlayerLimits limits;
  limits.force_n = narrow(options.Number("force", 0, kMaxForce));
  limits.torque_nm = narrow(options.Number("torque", 0, kMaxForce));
  limits.speed_m_s = narrow(options.Number("speed", 0, kMaxSpeed_m_s));
  if (const auto axes = options.Vector("axes")) {
    limits.axes = Vec3f(*axes);
    if (WrongField(limits) != nullptr) options.Fault("axes", "must have parts from 0 to 1");
  }
  if (absl::Status status = options.status(); !status.ok()) return status;
  record.limits = limits;
  return tessera_game_value{};
}

absl::Status CarryOutControl(tessera_game_call& call, BodyId target, const Message& message) {
  return IsPlayerBody(target) ? TakeAnswer(call, target, message) : DecideControl(call, target, message.speaker);
}

bool MustSettleControl(const GameWorld& world, BodyId id, Tick now) {
  const GameRecord& record = world.RecordOf(id);
  if (IsPlayerBody(id)) {
    const BodyId controls = record.player->controls;
    if (controls == BodyId()) return false;
    const bool its = world.Owns(controls) && world.RecordOf(controls).driver == PlayerOf(id);
    if (record.player->controls_until == Tick()) return !its;
    const bool meets = its && record.player->stage == PlayerStage::kDriving;
    return meets || record.player->controls_until <= now || world.IsRemoved(controls);
  }
  if (record.driver == PlayerNumber()) return false;
  const BodyId own = PlayerBodyId(record.driver);
  const bool its = world.Owns(own) && world.RecordOf(own).player->controls == id;
  return record.driver_until == Tick() ? !its : record.driver_until <= now;
}

std::vector<ControlNews> SettleControl(Transaction& transaction, BodyId id, Tick now) {
  std::vector<ControlNews> news;
  if (IsPlayerBody(id)) {
    SettlePlayer(transaction, PlayerOf(id), now, news);
  } else {
    SettleMoved(transaction, id, now);
  }
  return news;
}

}  // namespace tessera::game

#include "core/game/player_record.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "core/game/value.h"
#include "core/world/player_name.h"
#include "core/world/utf8.h"

namespace tessera::game {
namespace {

absl::Status PlayerFault(absl::string_view what) { return absl::InvalidArgumentError(absl::StrCat("player: ", what)); }

absl::Status CheckShownText(std::string_view text, std::size_t most) {
  if (text.size() > most) return absl::InvalidArgumentError(absl::StrCat("has more than ", most, " bytes"));
  if (!IsUtf8(text)) return absl::InvalidArgumentError("is not UTF-8");
  if (!HasNoControls(text)) return absl::InvalidArgumentError("has a control character");
  return absl::OkStatus();
}

}  // namespace

std::size_t PlayerRecord::event_bytes() const {
  std::size_t bytes = 0;
  for (const PlayerEvent& event : events) bytes += event.bytes();
  return bytes;
}

void PlayerRecord::Acknowledge(std::uint32_t event) {
  if (event > last_event || event < first_event()) return;
  events.erase(events.begin(), events.begin() + (event - first_event() + 1));
}

const PlayerRecord& SharedPlayerRecord::operator*() const {
  static const PlayerRecord kNothing;
  return shared_ == nullptr ? kNothing : *shared_;
}

PlayerRecord& SharedPlayerRecord::Change() {
  if (shared_ == nullptr || shared_.use_count() > 1) shared_ = std::make_shared<PlayerRecord>(**this);
  return *shared_;
}

absl::Status CheckEventName(std::string_view name) {
  if (name.empty()) return absl::InvalidArgumentError("is empty");
  return CheckShownText(name, kMaxEventNameBytes);
}

absl::Status CheckEndReason(std::string_view reason) { return CheckShownText(reason, kMaxEndReasonBytes); }

void Write(ByteWriter& out, const PlayerRecord& record) {
  out.U8(static_cast<std::uint8_t>(record.stage));
  if (record.ended()) out.Block(std::string_view(record.reason));
  out.Varint(record.last_command);
  out.Varint(record.commands.size());
  for (const WaitingCommand& command : record.commands) {
    out.Block(std::string_view(command.bytes));
    out.Varint(command.shown_at);
    out.Varint(command.with_input);
    if (command.with_input != 0) out.Varint(command.due.value());
  }
  out.Varint(record.last_event);
  out.Varint(record.events.size());
  for (const PlayerEvent& event : record.events) {
    out.Block(std::string_view(event.name));
    out.Block(event.values);
  }
  out.Varint(record.controls.value());
  if (record.controls != BodyId()) out.Varint(record.controls_until.value());
  Write(out, record.limits);
}

PlayerRecord ReadPlayerRecord(ByteReader& in) {
  PlayerRecord record;
  const std::uint8_t stage = in.U8();
  if (stage > static_cast<std::uint8_t>(PlayerStage::kDriving)) in.Fail("unknown stage of a player");
  record.stage = in.ok() ? static_cast<PlayerStage>(stage) : PlayerStage::kPlaying;
  const auto text = [&in](std::size_t most) {
    const auto bytes = in.Block(most);
    return std::string(bytes.begin(), bytes.end());
  };
  if (record.ended()) record.reason = text(kMaxEndReasonBytes);
  record.last_command = in.Varint32();
  const std::uint64_t commands = in.Varint();
  if (commands > kMaxWaitingCommands) in.Fail("too many commands");
  for (std::uint64_t i = 0; in.ok() && i < commands; ++i) {
    WaitingCommand& command = record.commands.emplace_back(text(kMaxCommandBytes));
    command.shown_at = in.Varint();
    command.with_input = in.Varint32();
    if (command.with_input != 0) command.due = Tick(in.Varint());
  }
  record.last_event = in.Varint32();
  const std::uint64_t events = in.Varint();
  if (events > kMaxWaitingEventsOfPlayer) in.Fail("too many events");
  for (std::uint64_t i = 0; in.ok() && i < events; ++i) {
    PlayerEvent& event = record.events.emplace_back();
    event.name = text(kMaxEventNameBytes);
    const auto values = in.Block(kMaxFieldBytes);
    event.values.assign(values.begin(), values.end());
  }
  record.controls = BodyId(in.Varint());
  if (record.controls != BodyId()) record.controls_until = Tick(in.Varint());
  record.limits = ReadPlayerLimits(in);
  return record;
}

absl::Status CheckPlayerRecord(const PlayerRecord& record) {
  if (const absl::Status reason = CheckEndReason(record.reason); !reason.ok()) {
    return PlayerFault(absl::StrCat("reason: ", reason.message()));
  }
  if (!record.ended() && !record.reason.empty()) return PlayerFault("reason: of one who plays");
  if (IsPlayerBody(record.controls)) return PlayerFault("controls: a player's body");
  if (record.stage == PlayerStage::kDriving && record.controls == BodyId()) return PlayerFault("controls: nothing");
  if (record.ended() && record.controls != BodyId()) return PlayerFault("controls: of one who was sent away");
  if (const char* wrong = WrongField(record.limits); wrong != nullptr) {
    return PlayerFault(absl::StrCat("limits: ", wrong));
  }
  if (record.commands.size() > std::min<std::size_t>(kMaxWaitingCommands, record.last_command)) {
    return PlayerFault("commands: more than there can be");
  }
  if (record.events.size() > std::min<std::size_t>(kMaxWaitingEventsOfPlayer, record.last_event) ||
      record.event_bytes() > kMaxWaitingEventBytes) {
    return PlayerFault("events: more than there can be");
  }
  for (const PlayerEvent& event : record.events) {
    if (const absl::Status name = CheckEventName(event.name); !name.ok()) {
      return PlayerFault(absl::StrCat("events: a name ", name.message()));
    }
    if (const auto fields = DecodeFields(event.values); !fields.ok()) {
      return PlayerFault(absl::StrCat("events: ", fields.status().message()));
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::game

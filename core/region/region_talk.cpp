// The talk of players with the game, as Region's callers see it. It is kept in the record of the player's own
// body (core/game/player_record.h), so it goes wherever that body goes.
#include <algorithm>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/region/region.h"
#include "core/region/region_parts.h"

namespace tessera::region {
namespace {

// The body's record, with the player's part changed by `change` from the next tick on.
template <class Change>
void ChangePlayer(BodyId id, RegionParts& parts, const Change& change) {
  const KeptRecord* const now = parts.records.Find(id);
  const std::optional<KeptRecord> before = now == nullptr ? std::nullopt : std::optional(*now);
  game::GameRecord record = before ? before->game : game::GameRecord();
  change(record.player.Change());
  parts.records.Put(id, record);
  parts.output.Changed(before ? &*before : nullptr, *parts.records.Find(id), parts.tick + 1);
}

// The grant of a body that is being handed over has left, with its record: the new owner is to be asked.
bool IsChangeable(BodyId id, const RegionParts& parts) {
  return parts.bodies.Owns(id) && !parts.failover.under_way() &&
         FindDeparting(parts.grants_out.departing(), id) == nullptr;
}

}  // namespace

absl::Status Region::TakeCommand(PlayerNumber player, const PlayerCommand& command) {
  RegionParts& parts = *parts_;
  const BodyId id = PlayerBodyId(player);
  if (command.number == 0 || command.number < command.base) return absl::InvalidArgumentError("command: number");
  if (command.bytes.size() > game::kMaxCommandBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("command: ", command.bytes.size(), " bytes are more than ", game::kMaxCommandBytes));
  }
  if (!IsChangeable(id, parts)) return {absl::StatusCode::kNotFound, ""};
  if (parts.game.host() == nullptr) return absl::FailedPreconditionError("command: the world runs no game");
  const KeptRecord* const kept = parts.records.Find(id);
  static const game::PlayerRecord kNothing;
  const game::PlayerRecord& now = kept == nullptr ? kNothing : *kept->game.player;
  if (now.ended()) return absl::FailedPreconditionError("command: the player was sent away");
  if (command.number <= now.last_command) return {absl::StatusCode::kAlreadyExists, ""};
  if (command.number > std::max<std::uint64_t>(std::uint64_t{now.last_command} + 1, command.base)) {
    return {absl::StatusCode::kOutOfRange, ""};
  }
  if (now.commands.size() >= game::kMaxWaitingCommands) {
    return absl::ResourceExhaustedError(
        absl::StrCat("command: ", now.commands.size(), " commands wait for the game already"));
  }
  ChangePlayer(id, parts, [&](game::PlayerRecord& record) {
    record.last_command = command.number;
    game::WaitingCommand& waiting = record.commands.emplace_back(std::string(command.bytes), command.shown_at);
    if (command.with_input == 0) return;
    waiting.with_input = command.with_input;
    waiting.due = parts.tick + game::kMaxCommandWait_ticks;
  });
  return absl::OkStatus();
}

void Region::AcknowledgeEvents(PlayerNumber player, std::uint32_t event) {
  RegionParts& parts = *parts_;
  const BodyId id = PlayerBodyId(player);
  const KeptRecord* const kept = IsChangeable(id, parts) ? parts.records.Find(id) : nullptr;
  if (kept == nullptr) return;
  const game::PlayerRecord& now = *kept->game.player;
  if (now.events.empty() || event < now.first_event() || event > now.last_event) return;
  ChangePlayer(id, parts, [&](game::PlayerRecord& record) { record.Acknowledge(event); });
}

const game::PlayerRecord* Region::TalkOf(PlayerNumber player) const {
  const BodyId id = PlayerBodyId(player);
  if (!Owns(id) || parts_->output.IsHidden(id)) return nullptr;
  const KeptRecord* const kept = parts_->records.Find(id);
  static const game::PlayerRecord kNothing;
  return kept == nullptr ? &kNothing : &*parts_->output.PlayerOf(*kept);
}

BodyId Region::MovedBy(PlayerNumber player) const {
  const game::PlayerRecord* const talk = TalkOf(player);
  const BodyId driven = talk == nullptr ? BodyId() : talk->driven();
  return driven == BodyId() ? PlayerBodyId(player) : driven;
}

std::vector<game::JointOfBody> Region::JointsOf(PlayerNumber player) const {
  const RegionParts& parts = *parts_;
  std::vector<game::JointOfBody> joints;
  if (parts.bodies.game_joints().empty()) return joints;
  const BodyId moved = MovedBy(player);
  if (parts.bodies.IndexOf(moved) < 0) return joints;
  const Assembly assembly = parts.bodies.AssemblyOf(moved);
  if (assembly.size() < 2) return joints;
  const TeamId team = AudienceOf(PlayerBodyId(player)).team;
  const auto sees = [&](BodyId body) {
    const Audience audience = AudienceOf(body);
    return body == moved || MaySee(audience.visible_to, audience.team, team);
  };
  for (const BodyId id : assembly) {
    const KeptRecord* const kept = parts.records.Find(id);
    if (kept == nullptr || kept->game.joints.empty() || !sees(id)) continue;
    for (const game::GameJoint& joint : kept->game.joints) {
      if (parts.bodies.IndexOf(joint.other) >= 0 && sees(joint.other)) joints.push_back({id, joint});
    }
  }
  return joints;
}

std::optional<Region::GameMoved> Region::MovementOf(PlayerNumber player) const {
  const GameMovement* const movement = parts_->game.movement();
  const PlayerControl* const control = parts_->players.Find(player);
  if (movement == nullptr || control == nullptr) return std::nullopt;
  const BodyId moved = MovedBy(player);
  const std::ptrdiff_t at = parts_->bodies.IndexOf(moved);
  if (at < 0 || !movement->Moves(*parts_->bodies.owned()[static_cast<std::size_t>(at)].def)) return std::nullopt;
  return GameMoved{*movement, StateFor(*movement, moved, control->state)};
}

std::vector<EndedPlayer> Region::ended_players() const {
  std::vector<EndedPlayer> ended;
  for (const BodyId id : parts_->records.hidden()) {
    const game::PlayerRecord* const talk = TalkOf(PlayerOf(id));
    if (talk != nullptr && talk->ended()) ended.push_back({PlayerOf(id), talk->reason});
  }
  return ended;
}

bool Region::IsHidden(BodyId body) const {
  if (!parts_->output.empty() && parts_->output.IsHidden(body)) return true;
  return std::ranges::binary_search(parts_->records.hidden(), body);
}

Region::Audience Region::AudienceOf(BodyId body) const {
  const RegionParts& parts = *parts_;
  const std::ptrdiff_t place = parts.bodies.PlaceOf(body);
  if (place < 0) return {};
  const BodyDef& def = parts.bodies.DefAt(static_cast<std::size_t>(place));
  const KeptRecord* const kept = parts.records.Find(body);
  const Ghost* const ghost = parts.bodies.FindGhost(body);
  static const BodyTuning kUntuned;
  const BodyTuning& tuning = ghost != nullptr ? ghost->record.tuning : kept != nullptr ? kept->game.tuning : kUntuned;
  Audience audience{VisibilityOf(def, tuning), 0};
  const Scene& scene = parts.scene();
  if (scene.team_property.empty()) return audience;
  const std::vector<std::uint8_t>* const bytes =
      kept != nullptr ? parts.output.PropertiesOf(*kept).get() : parts.shared.Find(body);
  const PropertySet changed = bytes == nullptr || bytes->empty()
                                  ? PropertySet()
                                  : PropertySet::Decode(*bytes, scene.properties).value_or(PropertySet());
  audience.team = TeamOf(*ValueOf(scene.properties, def.properties, changed, scene.team_property));
  return audience;
}

}  // namespace tessera::region

// Events of bodies and players, each in its turn: see game_host.h.
#include <algorithm>
#include <array>
#include <utility>

#include "core/game/calls.h"
#include "core/game/control_calls.h"
#include "core/game/game_host.h"
#include "core/game/host_values.h"
#include "core/game/joint_calls.h"
#include "core/game/message_calls.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

// Whether the other body, which is gone, said so itself before it went: its message waits, or is still under way.
bool WasTold(const GameEvent& event, const GameWorld& world) {
  if (!world.Owns(event.self)) return false;
  const Mail from = world.RecordOf(event.other).mail, to = world.RecordOf(event.self).mail;
  const auto says_it = [&](const Message& what) { return what.verb == kEventVerbs + event.callback; };
  return std::ranges::any_of(
             from.outbox, [&](const SentMessage& sent) { return sent.target == event.self && says_it(sent.what); }) ||
         std::ranges::any_of(to.inbox,
                             [&](const HeldMessage& held) { return held.sender == event.other && says_it(held.what); });
}

}  // namespace

void GameHost::SettleAllJoints(GameWorld& world) {
  for (const BodyId id : world.Jointed()) {
    if (!MustSettleJoints(world, id)) continue;
    Transaction transaction = Begin(world);
    SettleJoints(transaction, id, tick_);
    transaction.Commit();
    for (const std::string& line : transaction.lines()) Say({tick_, id, true, line});
  }
}

void GameHost::SettleAllControl(GameWorld& world) {
  for (const BodyId id : world.Steering()) {
    if (!MustSettleControl(world, id, tick_)) continue;
    Transaction transaction = Begin(world);
    const std::vector<ControlNews> news = SettleControl(transaction, id, tick_);
    transaction.Commit();
    for (const std::string& line : transaction.lines()) Say({tick_, id, true, line});
    TellOfControl(news, world);
  }
}

// An event that is told has happened, whether the callback fails or not.
void GameHost::TellOfControl(std::span<const ControlNews> news, GameWorld& world) {
  for (const ControlNews& one : news) {
    const std::array<tessera_game_value, 3> arguments{
        ToInterface(GameValue(one.player)), one.body == BodyId() ? tessera_game_value{} : BodyResult(one.body),
        TextResult(one.reason)};
    Call(world, kOnControl, PlayerBodyId(one.player), 0, arguments);
  }
}

// Also of bodies that come later with an older record: from a region that was cut off, or from a copy of a dead one.
void GameHost::RunMigrations(GameWorld& world) {
  std::vector<std::pair<BodyId, std::uint16_t>> older;
  if (Has(kOnWorldMigrate) && world.Owns(kInstanceBody) && world.RecordOf(kInstanceBody).game < number_) {
    older.emplace_back(kInstanceBody, 0);
  }
  world.ForEachOwned([&](BodyId id, const BodyDef& def) {
    if (def.kind == 0 || !HandlerOf(kOnBodyMigrate, def.kind).there) return;
    if (world.RecordOf(id).game < number_) older.emplace_back(id, def.kind);
  });
  for (const auto& [id, kind] : older) {
    if (Exhausted()) return;
    if (!world.Owns(id)) continue;  // another one's callback removed it
    const std::array<tessera_game_value, 2> arguments{
        BodyResult(id), ToInterface(GameValue(static_cast<std::int64_t>(world.RecordOf(id).game)))};
    // The record is this game's from now on whether the callback fails or not: it keeps its values then.
    const auto adopt = [&, body = id](Transaction& transaction) {
      transaction.Own(body)->record.game = number_;
      return true;
    };
    if (id == kInstanceBody) {
      Call(world, kOnWorldMigrate, id, 0, std::span(arguments).subspan(1), adopt);
    } else {
      Call(world, kOnBodyMigrate, id, kind, arguments, adopt);
    }
  }
}

void GameHost::RunJoins(std::span<const PlayerNumber> joined, GameWorld& world) {
  for (const PlayerNumber player : joined) {
    const tessera_game_value argument = ToInterface(GameValue(player));
    Call(world, kOnJoin, PlayerBodyId(player), 0, {&argument, 1});
  }
}

// A command is over whether its callback fails or not. One that goes with an input waits for it, and what comes after
// it waits too; not for longer than commands ever do, nor if the player goes now.
void GameHost::RunCommands(std::span<const PlayerNumber> leaving, GameWorld& world) {
  for (const BodyId id : world.Commanded()) {
    const SharedPlayerRecord record = world.RecordOf(id).player;
    const std::vector<WaitingCommand> commands = record->commands;
    const PlayerInput* const input = world.InputOf(PlayerOf(id));
    const std::uint32_t acted = input == nullptr ? 0 : input->number;
    const bool leaves = std::ranges::find(leaving, PlayerOf(id)) != leaving.end();
    const auto waits = [&](const WaitingCommand& command) {
      return command.with_input > acted && tick_ < command.due && command.due <= tick_ + kMaxCommandWait_ticks;
    };
    std::uint32_t number = record->last_command - static_cast<std::uint32_t>(commands.size());
    for (const WaitingCommand& command : commands) {
      ++number;
      if (Exhausted()) return;
      if (!leaves && waits(command)) break;
      std::array<tessera_game_value, 2> arguments{ToInterface(GameValue(PlayerOf(id)))};
      arguments[1].type = TESSERA_GAME_TEXT;
      arguments[1].count = static_cast<std::uint32_t>(command.bytes.size());
      arguments[1].as.text = command.bytes.data();
      shown_at_ = command.shown_at;
      claim_ = command.with_input == 0 ? 0 : number;
      // One that came before it may have sent the player away, and its commands with it.
      Call(world, kOnCommand, id, 0, arguments, [&](Transaction& transaction) {
        std::vector<WaitingCommand>& waiting = transaction.Own(id)->record.player.Change().commands;
        if (waiting.empty()) return false;
        waiting.erase(waiting.begin());
        return true;
      });
      shown_at_ = 0;
      claim_ = 0;
    }
  }
}

// Those that were refused never came.
void GameHost::RunLeaves(std::span<const PlayerNumber> leaving, GameWorld& world) {
  for (const PlayerNumber player : leaving) {
    const BodyId id = PlayerBodyId(player);
    const tessera_game_value argument = ToInterface(GameValue(player));
    if (world.RecordOf(id).player->stage != PlayerStage::kRefused) Call(world, kOnLeave, id, 0, {&argument, 1});
    Transaction transaction = Begin(world);
    ReleaseControl(transaction, player);
    transaction.Commit();
    world.Remove(id);
  }
}

void GameHost::RunEvents(GameWorld& world) {
  while (!waiting_.empty() && !Exhausted()) {
    const GameEvent event = waiting_.front();
    waiting_.pop_front();
    const BodyDef* def = world.Find(event.self);
    if (def == nullptr || (def->motion == Motion::kDynamic && !world.Owns(event.self))) continue;
    // An earlier callback may have removed what it met.
    const bool begins = event.callback == kOnBodyContact || event.callback == kOnBodyEntered;
    if (begins && world.Find(event.other) == nullptr) continue;
    std::array<tessera_game_value, 3> arguments{BodyResult(event.self), BodyResult(event.other)};
    const std::size_t count = event.callback == kOnBodyContact ? 3 : 2;
    std::array<tessera_game_field, 4> fields;
    const auto field = [](std::string_view name, const GameValue& value) {
      return tessera_game_field{name.data(), name.size(), ToInterface(value)};
    };
    if (event.blown) {
      fields = {field("at", event.blown->at), tessera_game_field{"by", 2, SenderValue(event.other)},
                tessera_game_field{"name", 4, TextResult(event.blown->name)}, field("share", event.blown->share)};
      arguments[1].type = TESSERA_GAME_FIELDS;
      arguments[1].count = static_cast<std::uint32_t>(fields.size());
      arguments[1].as.fields = fields.data();
    }
    if (event.contact) {
      fields = {field("impulse", event.contact->impulse),
                field("normal", event.contact->normal),
                field("point", event.contact->point),
                {}};
      arguments[2].type = TESSERA_GAME_FIELDS;
      arguments[2].count = 3;
      arguments[2].as.fields = fields.data();
    }
    Call(world, event.callback, event.self, def->kind, std::span(arguments).first(count));
  }
}

// The owner of a pair's lower body has the reports of both, and each report becomes one message, in the tick that has
// it. Both are in that tick's state, so a death takes back both or none.
bool GameHost::TellByMessage(const GameEvent& event, GameWorld& world) {
  if (event.callback < kOnBodyContact || event.callback > kOnBodyLeft) return false;
  if (event.self < event.other) return false;
  if (!world.Owns(event.other)) return WasTold(event, world);
  const BodyDef* const here = world.Find(event.self);
  const BodyDef* const def = here != nullptr ? here : DefinitionOf(*scene_, event.self);
  if (def == nullptr || def->motion != Motion::kDynamic || def->kind == 0) return false;
  if (!HandlerOf(event.callback, def->kind).there) return false;
  if (world.Owns(event.self)) {
    const auto reports = [](const Message& what) { return what.verb > kEventVerbs; };
    const Mail from = world.RecordOf(event.other).mail, to = world.RecordOf(event.self).mail;
    const bool left = std::ranges::any_of(
        from.outbox, [&](const SentMessage& sent) { return sent.target == event.self && reports(sent.what); });
    const bool waits = std::ranges::any_of(
        to.inbox, [&](const HeldMessage& held) { return held.sender == event.other && reports(held.what); });
    if (!left && !waits) return false;
  }
  Message message;
  message.speaker = event.other;
  message.verb = kEventVerbs + event.callback;
  if (event.contact) {
    const auto values = EncodeFields(
        {{"impulse", event.contact->impulse}, {"normal", event.contact->normal}, {"point", event.contact->point}});
    if (values.ok()) message.values = *values;
  }
  Transaction transaction = Begin(world);
  if (!transaction.Send(event.other, event.self, tick_, std::move(message)).ok()) {
    ++statistics_.dropped_events;
    return true;
  }
  sent_ += transaction.sent();
  statistics_.messages.sent += transaction.sent();
  transaction.Commit();
  return true;
}

// The other body may be out of this region's sight by now.
void GameHost::RunToldEvent(BodyId target, const HeldMessage& message, GameWorld& world) {
  NoteApplied(message);
  const std::uint32_t callback = message.what.verb - kEventVerbs;
  const BodyDef* const def = world.Find(target);
  const bool known = callback >= kOnBodyContact && callback <= kOnBodyLeft && def != nullptr;
  const bool begins = callback == kOnBodyContact || callback == kOnBodyEntered;
  const auto take = [&](Transaction& transaction) {
    return transaction.Own(target)->record.mail.Applied(message.sender, message.number, tick_);
  };
  if (!known || (begins && world.IsRemoved(message.what.speaker))) {
    Transaction transaction = Begin(world);
    take(transaction);
    transaction.Commit();
    return;
  }
  const KeptFields values(message.what.values);
  const std::array<tessera_game_value, 3> arguments{
      BodyResult(target), BodyResult(message.what.speaker),
      message.what.values.empty() ? tessera_game_value{} : values.value()};
  const std::size_t count = callback == kOnBodyContact ? 3 : 2;
  Call(world, callback, target, def->kind, std::span(arguments).first(count), take);
}

void GameHost::RunTimers(GameWorld& world) {
  for (const BodyId id : world.DueBy(tick_)) {
    // An earlier body's callback may have removed it.
    if (!world.Owns(id)) continue;
    const Tick expires = world.RecordOf(id).expires;
    if (expires != Tick() && expires <= tick_) {
      world.Remove(id);
      ++statistics_.expired;
    } else if (!Exhausted()) {
      RunTimersOf(id, world);
    }
  }
}

// Timers that were due when it began; one that a callback sets for now is of the next tick.
void GameHost::RunTimersOf(BodyId id, GameWorld& world) {
  std::vector<GameTimer> due = world.RecordOf(id).timers;
  std::erase_if(due, [this](const GameTimer& timer) { return timer.due > tick_; });
  for (const GameTimer& timer : due) {
    if (Exhausted() || !world.Owns(id)) return;
    const KeptFields values(timer.values);
    const std::array<tessera_game_value, 3> arguments{BodyResult(id), TextResult(timer.name), values.value()};
    // It is over whether the callback fails or not, and an earlier callback may have taken it back.
    bool there = false;
    const auto take = [&](Transaction& transaction) {
      std::vector<GameTimer>& timers = transaction.Own(id)->record.timers;
      there = std::erase_if(timers, [&](const GameTimer& other) { return other.number == timer.number; }) > 0;
      return there;
    };
    if (id == kInstanceBody) {
      Call(world, kOnWorldTimer, id, 0, std::span(arguments).subspan(1), take);
    } else {
      Call(world, kOnBodyTimer, id, world.Find(id)->kind, arguments, take);
    }
  }
}

}  // namespace tessera::game

// Messages and answers that are due, in their turn: see game_host.h.
#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/calls.h"
#include "core/game/game_host.h"
#include "core/game/host_values.h"
#include "core/game/query_calls.h"
#include "core/game/question.h"
#include "game_sdk/api/api.h"

namespace tessera::game {

void GameHost::RunMessages(GameWorld& world) {
  std::vector<std::pair<BodyId, HeldMessage>> due;
  for (const BodyId id : world.DueBy(tick_)) {
    for (HeldMessage& message : world.RecordOf(id).mail.Due(tick_)) due.emplace_back(id, std::move(message));
  }
  std::ranges::sort(due, {}, [](const auto& one) {
    const HeldMessage& message = one.second;
    return std::tuple(message.due, message.sender, message.number);
  });
  for (const auto& [target, message] : due) {
    if (Exhausted()) return;
    // An earlier callback may have removed it.
    if (world.Owns(target)) RunMessage(target, message, world);
  }
}

void GameHost::RunMessage(BodyId target, const HeldMessage& message, GameWorld& world) {
  if (message.what.verb == kWorldPublish && target == kInstanceBody) return RunPublish(message, world);
  if (message.what.verb > kEventVerbs) return RunToldEvent(target, message, world);
  if (message.what.verb != 0) return RunVerb(target, message, world);
  const KeptFields values(message.what.values);
  const std::array<tessera_game_value, 4> arguments{BodyResult(target), TextResult(message.what.name), values.value(),
                                                    SenderValue(message.what.speaker)};
  const auto take = [&](Transaction& transaction) {
    return transaction.Own(target)->record.mail.Applied(message.sender, message.number, tick_);
  };
  NoteApplied(message);
  const bool of_world = target == kInstanceBody;
  const std::uint32_t callback = of_world ? kOnWorldMessage : kOnBodyMessage;
  const std::uint16_t kind = of_world ? std::uint16_t{0} : world.Find(target)->kind;
  if (!HandlerOf(callback, kind).there) NoteUnheard(target, kind, message);
  Call(world, callback, target, kind, of_world ? std::span(arguments).subspan(1) : std::span(arguments), take);
}

void GameHost::RunAnswers(GameWorld& world) {
  for (const BodyId asker : world.DueBy(tick_)) {
    const std::vector<GameQuestion> questions = world.RecordOf(asker).questions;
    for (const GameQuestion& question : questions) {
      if (question.due > tick_) continue;
      if (Exhausted()) return;
      if (!world.Owns(asker)) break;  // another one's callback removed it
      if (const std::optional<Answer> answer = world.AnswerTo(asker, question)) {
        RunAnswer(asker, question, *answer, world);
      }
    }
  }
}

void GameHost::RunAnswer(BodyId asker, const GameQuestion& question, const Answer& answer, GameWorld& world) {
  const auto decoded = DecodeQuestion(question.query, *scene_);
  const double length_m = decoded.ok() ? Length(decoded->query.to - decoded->query.from) : 0;
  const KeptFields values(question.values);
  std::vector<tessera_game_value> hits;
  std::vector<tessera_game_field> fields;
  const tessera_game_value list = HitsValue(answer.hits, length_m, hits, fields);
  const bool of_world = asker == kInstanceBody;
  const std::array<tessera_game_value, 6> arguments{BodyResult(asker),
                                                    TextResult(question.name),
                                                    list,
                                                    ToInterface(GameValue(answer.complete)),
                                                    values.value(),
                                                    of_world ? tessera_game_value{} : BodyResult(asker)};
  const auto take = [&](Transaction& transaction) {
    return std::erase_if(transaction.Own(asker)->record.questions,
                         [&](const GameQuestion& other) { return other.number == question.number; }) > 0;
  };
  const std::uint16_t kind = of_world ? std::uint16_t{0} : world.Find(asker)->kind;
  if (kind != 0 && HandlerOf(kOnBodyAnswer, kind).there) {
    Call(world, kOnBodyAnswer, asker, kind, std::span(arguments).first(5), take);
  } else {
    Call(world, kOnWorldAnswer, asker, 0, std::span(arguments).subspan(1), take);
  }
}

void GameHost::RunVerb(BodyId target, const HeldMessage& message, GameWorld& world) {
  NoteApplied(message);
  Transaction transaction = Begin(world);
  transaction.Own(target)->record.mail.Applied(message.sender, message.number, tick_);
  tessera_game_call call(transaction, tick_, target, seed_, settings_.instructions_per_callback);
  const absl::Status status = CarryOut(call, target, message.what);
  if (const auto effect = EffectOf(message.what.verb)) {
    EffectCount& count = statistics_.effects[static_cast<std::size_t>(*effect)];
    ++(status.ok() ? count.done : count.refused);
  }
  ++used_;
  ++statistics_.instructions;
  if (status.ok()) {
    transaction.Commit();
    for (const std::string& line : transaction.lines()) Say({tick_, target, true, line});
    return TellOfControl(call.control_news, world);
  }
  Transaction nothing = Begin(world);
  nothing.Own(target)->record.mail.Applied(message.sender, message.number, tick_);
  nothing.Commit();
  ++statistics_.errors;
  ++statistics_.messages.failed;
  Say({tick_, target, true, absl::StrCat("asked for by body ", message.what.speaker.value(), ": ", status.message())});
}

void GameHost::RunPublish(const HeldMessage& message, GameWorld& world) {
  NoteApplied(message);
  Transaction transaction = Begin(world);
  GameRecord& record = transaction.Own(kInstanceBody)->record;
  record.mail.Applied(message.sender, message.number, tick_);
  PublishedEvent event;
  event.tick = tick_;
  event.source = message.what.speaker;
  event.name = message.what.name;
  event.values = message.what.values;
  const bool first_left_out = record.published.left_out == 0;
  const bool kept = record.published.Add(std::move(event));
  transaction.Commit();
  ++used_;
  ++statistics_.instructions;
  ++(kept ? statistics_.published : statistics_.unpublished);
  if (!kept && first_left_out) {
    Say({tick_, message.what.speaker, true,
         absl::StrCat("publish: events wait for the control plane, and no more are kept; \"", message.what.name,
                      "\" and what follows are left out")});
  }
}

void GameHost::NoteUnheard(BodyId target, std::uint16_t kind, const HeldMessage& message) {
  ++statistics_.messages.unheard;
  Handler& handler = HandlerOf(target == kInstanceBody ? kOnWorldMessage : kOnBodyMessage, kind);
  if (std::exchange(handler.missed, true)) return;
  const std::string why = target == kInstanceBody ? absl::StrCat(file_.name, " has no function on_message")
                          : kind == 0             ? std::string("the body has no kind")
                                                  : absl::StrCat("kinds.", scene_->kinds[kind], " has no on_message");
  Say({tick_, target, false, absl::StrCat("nobody hears the message \"", message.what.name, "\": ", why)});
}

void GameHost::NoteApplied(const HeldMessage& message) {
  MessageStatistics& messages = statistics_.messages;
  ++messages.applied;
  if (tick_ > message.due) ++messages.late;
  ++messages.by_hops[std::min<std::size_t>(message.hops, MessageStatistics::kHops - 1)];
  const auto ticks = static_cast<std::uint64_t>(tick_ - message.made);
  messages.ticks += ticks;
  messages.most_ticks = std::max(messages.most_ticks, ticks);
}

}  // namespace tessera::game

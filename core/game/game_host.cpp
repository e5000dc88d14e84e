#include "core/game/game_host.h"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/calls.h"
#include "core/game/control_calls.h"
#include "core/game/joint_calls.h"
#include "core/game/query_calls.h"
#include "core/game/question.h"
#include "core/world/utf8.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

tessera_game_value BodyValue(BodyId id) {
  tessera_game_value value;
  value.type = TESSERA_GAME_BODY, value.count = 0, value.as.id = id.value();
  return value;
}

tessera_game_value TextValue(const std::string& text) {
  tessera_game_value value{};
  value.type = TESSERA_GAME_TEXT;
  value.count = static_cast<std::uint32_t>(text.size());
  value.as.text = text.data();
  return value;
}

// Gives the sender of a message as on_message is told of it.
tessera_game_value SenderValue(BodyId speaker) {
  static const std::string kBackend = "backend";
  if (speaker == kBackendSender) return TextValue(kBackend);
  return speaker == BodyId() ? tessera_game_value{} : BodyValue(speaker);
}

// Named values as a record keeps them, for an argument.
class KeptFields {
 public:
  explicit KeptFields(std::span<const std::uint8_t> bytes) : kept_(DecodeFields(bytes, kMaxMessageBytes)) {
    if (!kept_.ok()) return;
    fields_.reserve(kept_->size());
    for (const auto& [name, value] : *kept_) fields_.push_back({name.data(), name.size(), ToInterface(value)});
  }
  tessera_game_value value() const {
    tessera_game_value value{};
    value.type = TESSERA_GAME_FIELDS;
    value.count = static_cast<std::uint32_t>(fields_.size());
    value.as.fields = fields_.data();
    return value;
  }

 private:
  const absl::StatusOr<GameFields> kept_;
  std::vector<tessera_game_field> fields_;
};

std::string TextOf(const tessera_game_error& error) {
  const auto end = std::ranges::find(error.text, '\0');
  return ValidUtf8({std::begin(error.text), end});
}

}  // namespace

absl::StatusOr<std::unique_ptr<GameHost>> GameHost::Load(const tessera_game_module& module, GameFile file,
                                                         std::shared_ptr<const Scene> scene, GameSettings settings,
                                                         std::uint64_t seed, std::uint32_t number) {
  if (module.abi != TESSERA_GAME_ABI || module.size < sizeof(tessera_game_module)) {
    return absl::InvalidArgumentError(absl::StrCat(file.name, ": is made for version ", module.abi,
                                                   " of the interface, and this is version ", TESSERA_GAME_ABI));
  }
  auto host =
      std::unique_ptr<GameHost>(new GameHost(module, std::move(file), std::move(scene), settings, seed, number));
  if (absl::Status status = host->Renew(); !status.ok()) return status;
  return host;
}

GameHost::GameHost(const tessera_game_module& module, GameFile file, std::shared_ptr<const Scene> scene,
                   GameSettings settings, std::uint64_t seed, std::uint32_t number)
    : module_(module),
      file_(std::move(file)),
      scene_(std::move(scene)),
      settings_(settings),
      seed_(seed),
      number_(number) {}

GameHost::~GameHost() {
  if (game_ != nullptr) module_.unload(game_);
}

absl::Status GameHost::Renew() {
  const tessera_game_source source{sizeof source, file_.name.c_str(), file_.bytes.data(), file_.bytes.size()};
  tessera_game_error error{};
  void* game = nullptr;
  if (module_.load(&GameFunctions(), &source, &game, &error) != 0) return absl::InvalidArgumentError(TextOf(error));
  if (game_ != nullptr) module_.unload(game_);
  game_ = game;
  FindHandlers();
  return absl::OkStatus();
}

void GameHost::TakeOver(GameHost& other) {
  waiting_ = std::exchange(other.waiting_, {});
  lines_ = other.TakeLines();
  statistics_ = other.statistics_;
  statistics_.callbacks_off = 0;
  counters_ = other.counters_;
}

HostState GameHost::State() const {
  HostState state;
  const std::size_t kept = std::min(waiting_.size(), kMaxKeptEvents);
  state.waiting.assign(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(kept));
  state.next_ticked = next_ticked_;
  for (const Callback& callback : Callbacks()) {
    for (std::size_t kind = 0; kind < scene_->kinds.size(); ++kind) {
      const auto index = static_cast<std::size_t>(&callback - Callbacks().data());
      const Handler& handler = handlers_[index * scene_->kinds.size() + kind];
      if (handler.failures == 0) continue;
      state.failed.push_back({callback.number, static_cast<std::uint16_t>(kind), handler.failures, handler.off});
    }
  }
  return state;
}

void GameHost::Adopt(const HostState& state, absl::FunctionRef<bool(const GameEvent&)> has) {
  for (const GameEvent& event : state.waiting) {
    if (!has(event)) continue;
    if (waiting_.size() < kMaxWaitingEvents) {
      waiting_.push_back(event);
    } else {
      ++statistics_.dropped_events;
    }
  }
  for (const FailedCallback& failed : state.failed) {
    Handler& handler = HandlerOf(failed.callback, failed.kind);
    if (failed.off && !handler.off) ++statistics_.callbacks_off;
    handler.failures = std::max(handler.failures, failed.failures);
    handler.off = handler.off || failed.off;
  }
  if (next_ticked_ == BodyId()) next_ticked_ = state.next_ticked;
}

void GameHost::Inspect(Tick tick, GameWorld& world, Inspection act) const {
  Transaction transaction = Begin(world);
  tessera_game_call call(transaction, tick, BodyId(), seed_, settings_.instructions_per_callback);
  act(GameFunctions(), &call);
}

// Those that failed too often stay off.
void GameHost::FindHandlers() {
  handlers_.resize(Callbacks().size() * scene_->kinds.size());
  ticks_ = migrates_ = false;
  for (const Callback& callback : Callbacks()) {
    for (std::size_t kind = 0; kind < scene_->kinds.size(); ++kind) {
      const bool world = callback.receiver == Receiver::kWorld;
      if (world ? kind != 0 : kind == 0) continue;  // bodies without a kind have no callbacks
      Handler& handler = HandlerOf(callback.number, static_cast<std::uint16_t>(kind));
      handler.there = module_.handles(game_, callback.number, world ? nullptr : scene_->kinds[kind].c_str()) != 0;
      if (callback.number == kOnBodyTick) ticks_ = ticks_ || handler.there;
      if (callback.number == kOnBodyMigrate) migrates_ = migrates_ || handler.there;
    }
  }
}

GameHost::Handler& GameHost::HandlerOf(std::uint32_t callback, std::uint16_t kind) {
  const auto index = static_cast<std::size_t>(FindCallback(callback) - Callbacks().data());
  return handlers_[index * scene_->kinds.size() + kind];
}

bool GameHost::Has(std::uint32_t world_callback) const {
  const auto index = static_cast<std::size_t>(FindCallback(world_callback) - Callbacks().data());
  return handlers_[index * scene_->kinds.size()].there;
}

void GameHost::Run(Tick tick, std::span<const GameEvent> events, GameWorld& world, const PlayerChanges& players) {
  tick_ = tick;
  used_ = 0;
  made_ = 0;
  sent_ = 0;
  lines_this_tick_ = 0;
  for (const GameEvent& event : events) {
    if (waiting_.size() < kMaxWaitingEvents) {
      waiting_.push_back(event);
    } else {
      ++statistics_.dropped_events;
    }
  }
  if (number_ > 0 && migrates_) RunMigrations(world);
  SettleAllJoints(world);
  SettleAllControl(world);
  Call(world, kOnTick, BodyId(), 0, {});
  RunJoins(players.joined, world);
  RunCommands(world);
  RunLeaves(players.leaving, world);
  RunEvents(world);
  RunMessages(world);
  RunAnswers(world);
  RunTimers(world);
  if (ticks_) RunBodyTicks(world);
}

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

// The control has changed already, whether the callback fails or not.
void GameHost::TellOfControl(std::span<const ControlNews> news, GameWorld& world) {
  for (const ControlNews& one : news) {
    const std::array<tessera_game_value, 3> arguments{ToInterface(GameValue(one.player)),
                                                      one.body == BodyId() ? tessera_game_value{} : BodyValue(one.body),
                                                      TextValue(one.reason)};
    Call(world, kOnControl, PlayerBodyId(one.player), 0, arguments);
  }
}

// Also of bodies that come later with an older record: from a region that was cut off, or from a copy of a dead one.
void GameHost::RunMigrations(GameWorld& world) {
  std::vector<std::pair<BodyId, std::uint16_t>> older;
  world.ForEachOwned([&](BodyId id, const BodyDef& def) {
    if (def.kind == 0 || !HandlerOf(kOnBodyMigrate, def.kind).there) return;
    if (world.RecordOf(id).game < number_) older.emplace_back(id, def.kind);
  });
  for (const auto& [id, kind] : older) {
    if (Exhausted()) return;
    if (!world.Owns(id)) continue;  // another one's callback removed it
    const std::array<tessera_game_value, 2> arguments{
        BodyValue(id), ToInterface(GameValue(static_cast<std::int64_t>(world.RecordOf(id).game)))};
    // The record is this game's from now on whether the callback fails or not: it keeps its values then.
    const auto adopt = [&, body = id](Transaction& transaction) {
      transaction.Own(body)->record.game = number_;
      return true;
    };
    Call(world, kOnBodyMigrate, id, kind, arguments, adopt);
  }
}

void GameHost::RunJoins(std::span<const PlayerNumber> joined, GameWorld& world) {
  for (const PlayerNumber player : joined) {
    const tessera_game_value argument = ToInterface(GameValue(player));
    Call(world, kOnJoin, PlayerBodyId(player), 0, {&argument, 1});
  }
}

// A command is over whether its callback fails or not.
void GameHost::RunCommands(GameWorld& world) {
  for (const BodyId id : world.Commanded()) {
    const std::vector<WaitingCommand> commands = world.RecordOf(id).player->commands;
    for (const WaitingCommand& command : commands) {
      if (Exhausted()) return;
      std::array<tessera_game_value, 2> arguments{ToInterface(GameValue(PlayerOf(id)))};
      arguments[1].type = TESSERA_GAME_TEXT;
      arguments[1].count = static_cast<std::uint32_t>(command.bytes.size());
      arguments[1].as.text = command.bytes.data();
      shown_at_ = command.shown_at;
      // One that came before it may have sent the player away, and its commands with it.
      Call(world, kOnCommand, id, 0, arguments, [&](Transaction& transaction) {
        std::vector<WaitingCommand>& waiting = transaction.Own(id)->record.player.Change().commands;
        if (waiting.empty()) return false;
        waiting.erase(waiting.begin());
        return true;
      });
      shown_at_ = 0;
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
    std::array<tessera_game_value, 3> arguments{BodyValue(event.self), BodyValue(event.other)};
    const std::size_t count = event.callback == kOnBodyContact ? 3 : 2;
    std::array<tessera_game_field, 4> fields;
    const auto field = [](std::string_view name, const GameValue& value) {
      return tessera_game_field{name.data(), name.size(), ToInterface(value)};
    };
    if (event.blown) {
      fields = {field("at", event.blown->at), tessera_game_field{"by", 2, SenderValue(event.other)},
                tessera_game_field{"name", 4, TextValue(event.blown->name)}, field("share", event.blown->share)};
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
  if (message.what.verb != 0) return RunVerb(target, message, world);
  const KeptFields values(message.what.values);
  const std::array<tessera_game_value, 4> arguments{BodyValue(target), TextValue(message.what.name), values.value(),
                                                    SenderValue(message.what.speaker)};
  const auto take = [&](Transaction& transaction) {
    return transaction.Own(target)->record.mail.Applied(message.sender, message.number, tick_);
  };
  NoteApplied(message);
  if (target == kInstanceBody) {
    Call(world, kOnWorldMessage, target, 0, std::span(arguments).subspan(1), take);
  } else {
    Call(world, kOnBodyMessage, target, world.Find(target)->kind, arguments, take);
  }
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
  const std::array<tessera_game_value, 6> arguments{BodyValue(asker),
                                                    TextValue(question.name),
                                                    list,
                                                    ToInterface(GameValue(answer.complete)),
                                                    values.value(),
                                                    of_world ? tessera_game_value{} : BodyValue(asker)};
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

void GameHost::NoteApplied(const HeldMessage& message) {
  MessageStatistics& messages = statistics_.messages;
  ++messages.applied;
  if (tick_ > message.due) ++messages.late;
  ++messages.by_hops[std::min<std::size_t>(message.hops, MessageStatistics::kHops - 1)];
  const auto ticks = static_cast<std::uint64_t>(tick_ - message.made);
  messages.ticks += ticks;
  messages.most_ticks = std::max(messages.most_ticks, ticks);
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

Transaction GameHost::Begin(GameWorld& world) const {
  return Transaction(
      world, {settings_.spawns_per_tick - made_, settings_.bodies_per_region, settings_.messages_per_tick - sent_},
      number_);
}

// Timers that were due when it began; one that a callback sets for now is of the next tick.
void GameHost::RunTimersOf(BodyId id, GameWorld& world) {
  std::vector<GameTimer> due = world.RecordOf(id).timers;
  std::erase_if(due, [this](const GameTimer& timer) { return timer.due > tick_; });
  for (const GameTimer& timer : due) {
    if (Exhausted() || !world.Owns(id)) return;
    const KeptFields values(timer.values);
    const std::array<tessera_game_value, 3> arguments{BodyValue(id), TextValue(timer.name), values.value()};
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

// As many as the tick's budget lets; the next tick goes on where this one ended.
void GameHost::RunBodyTicks(GameWorld& world) {
  std::vector<std::pair<BodyId, const BodyDef*>> ticked;
  const Handler* const handlers = &HandlerOf(kOnBodyTick, 0);
  world.ForEachOwned([&](BodyId id, const BodyDef& def) {
    if (handlers[def.kind].there) ticked.emplace_back(id, &def);
  });
  const auto from = std::ranges::lower_bound(ticked, next_ticked_, {}, [](const auto& entry) { return entry.first; });
  std::rotate(ticked.begin(), from, ticked.end());
  removed_ = false;
  for (const auto& [id, def] : ticked) {
    next_ticked_ = id;
    if (Exhausted()) return;
    if (removed_ && !world.Owns(id)) continue;  // by another one's callback
    const tessera_game_value self = BodyValue(id);
    Call(world, kOnBodyTick, id, def->kind, {&self, 1}, [about = id, known = def](Transaction& transaction) {
      transaction.Know(about, *known, true);
      return true;
    });
  }
  next_ticked_ = BodyId();
}

void GameHost::Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
                    std::span<const tessera_game_value> arguments) {
  Call(world, callback, self, kind, arguments, [](Transaction&) { return true; });
}

template <class Prepare>
void GameHost::Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
                    std::span<const tessera_game_value> arguments, const Prepare& prepare) {
  Transaction transaction = Begin(world);
  if (!prepare(transaction)) return;
  Handler& handler = HandlerOf(callback, kind);
  if (!handler.there || handler.off) {
    transaction.Commit();
    return;
  }
  tessera_game_call call(transaction, tick_, self, seed_, settings_.instructions_per_callback);
  if (arguments.size() >= 2 && arguments[1].type == TESSERA_GAME_BODY) call.other = BodyId(arguments[1].as.id);
  call.callback = callback;
  call.shown_at = shown_at_;
  const tessera_game_event event{sizeof event, callback, kind == 0 ? nullptr : scene_->kinds[kind].c_str(),
                                 arguments.data(), static_cast<std::uint32_t>(arguments.size())};
  tessera_game_error error;
  error.text[0] = '\0';
  const bool failed = module_.run(game_, &call, &event, &error) != 0 || call.instructions > call.budget;
  // A call costs something even where the module counts nothing.
  const std::uint64_t instructions = std::min(call.instructions, call.budget) + 1;
  used_ += instructions;
  statistics_.instructions += instructions;
  ++statistics_.calls;
  NoteCost(handler, callback, kind, instructions, failed);
  if (failed) {
    Transaction nothing = Begin(world);
    prepare(nothing);
    nothing.Commit();
    NoteFailure(handler, callback, self, kind, error.text[0] == '\0' ? "too much work" : TextOf(error));
    return;
  }
  handler.failures = 0;
  removed_ = removed_ || transaction.removes();
  const std::size_t made = transaction.Commit();
  made_ += made;
  statistics_.spawned += made;
  sent_ += transaction.sent();
  statistics_.messages.sent += transaction.sent();
  for (const std::string& line : transaction.lines()) Say({tick_, self, false, line});
  for (const auto& [name, more] : transaction.counts()) {
    if (counters_.size() >= kMaxCounters && !counters_.contains(name)) {
      ++statistics_.dropped_counts;
    } else {
      counters_[name] += more;
    }
  }
}

void GameHost::NoteCost(Handler& handler, std::uint32_t callback, std::uint16_t kind, std::uint64_t instructions,
                        bool failed) {
  if (handler.cost == nullptr) handler.cost = &costs_[NameOf(callback, kind)];
  ++handler.cost->calls;
  handler.cost->errors += failed ? 1 : 0;
  handler.cost->instructions += instructions;
}

std::string GameHost::NameOf(std::uint32_t callback, std::uint16_t kind) const {
  return absl::StrCat(kind == 0 ? "" : absl::StrCat("kinds.", scene_->kinds[kind], "."),
                      std::string(FindCallback(callback)->name));
}

void GameHost::NoteFailure(Handler& handler, std::uint32_t callback, BodyId self, std::uint16_t kind,
                           std::string text) {
  ++statistics_.errors;
  Say({tick_, self, true, std::move(text)});
  if (++handler.failures < settings_.failures_until_off) return;
  handler.off = true;
  ++statistics_.callbacks_off;
  Say({tick_, self, true,
       absl::StrCat(NameOf(callback, kind), " failed ", handler.failures, " times in a row and is off"), true});
}

void GameHost::Say(GameLine line) {
  // That a callback is off is said once, so it is never left out.
  if (lines_this_tick_ >= kMaxLogLinesPerTick && !line.off) {
    ++statistics_.dropped_lines;
    return;
  }
  ++lines_this_tick_;
  if (line.self == kInstanceBody) line.self = BodyId();
  line.text = ValidUtf8(line.text);
  lines_.push_back(std::move(line));
}

std::vector<GameLine> GameHost::TakeLines() { return std::exchange(lines_, {}); }

}  // namespace tessera::game

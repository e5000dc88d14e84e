#include "core/game/game_host.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/calls.h"
#include "core/world/utf8.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

tessera_game_value BodyValue(BodyId id) { return ToInterface(GameValue(id)); }

std::string TextOf(const tessera_game_error& error) {
  const auto end = std::ranges::find(error.text, '\0');
  return ValidUtf8({std::begin(error.text), end});
}

}  // namespace

absl::StatusOr<std::unique_ptr<GameHost>> GameHost::Load(const tessera_game_module& module, GameFile file,
                                                         std::shared_ptr<const Scene> scene, GameSettings settings,
                                                         std::uint64_t seed) {
  if (module.abi != TESSERA_GAME_ABI || module.size < sizeof(tessera_game_module)) {
    return absl::InvalidArgumentError(absl::StrCat(file.name, ": is made for version ", module.abi,
                                                   " of the interface, and this is version ", TESSERA_GAME_ABI));
  }
  auto host = std::unique_ptr<GameHost>(new GameHost(module, std::move(file), std::move(scene), settings, seed));
  if (absl::Status status = host->Renew(); !status.ok()) return status;
  return host;
}

GameHost::GameHost(const tessera_game_module& module, GameFile file, std::shared_ptr<const Scene> scene,
                   GameSettings settings, std::uint64_t seed)
    : module_(module), file_(std::move(file)), scene_(std::move(scene)), settings_(settings), seed_(seed) {}

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

void GameHost::Inspect(Tick tick, GameWorld& world, Inspection act) const {
  Transaction transaction = Begin(world);
  tessera_game_call call(transaction, tick, BodyId(), seed_, settings_.instructions_per_callback);
  act(GameFunctions(), &call);
}

// Those that failed too often stay off.
void GameHost::FindHandlers() {
  handlers_.resize(Callbacks().size() * scene_->kinds.size());
  ticks_ = false;
  for (const Callback& callback : Callbacks()) {
    for (std::size_t kind = 0; kind < scene_->kinds.size(); ++kind) {
      const bool world = callback.receiver == Receiver::kWorld;
      if (world ? kind != 0 : kind == 0) continue;  // bodies without a kind have no callbacks
      Handler& handler = HandlerOf(callback.number, static_cast<std::uint16_t>(kind));
      handler.there = module_.handles(game_, callback.number, world ? nullptr : scene_->kinds[kind].c_str()) != 0;
      if (callback.number == kOnBodyTick) ticks_ = ticks_ || handler.there;
    }
  }
}

GameHost::Handler& GameHost::HandlerOf(std::uint32_t callback, std::uint16_t kind) {
  const auto index = static_cast<std::size_t>(FindCallback(callback) - Callbacks().data());
  return handlers_[index * scene_->kinds.size() + kind];
}

void GameHost::Run(Tick tick, std::span<const GameEvent> events, GameWorld& world) {
  tick_ = tick;
  used_ = 0;
  made_ = 0;
  lines_this_tick_ = 0;
  for (const GameEvent& event : events) {
    if (waiting_.size() < kMaxWaitingEvents) {
      waiting_.push_back(event);
    } else {
      ++statistics_.dropped_events;
    }
  }
  Call(world, kOnTick, BodyId(), 0, {});
  RunEvents(world);
  RunTimers(world);
  if (ticks_) RunBodyTicks(world);
}

void GameHost::RunEvents(GameWorld& world) {
  while (!waiting_.empty() && !Exhausted()) {
    const GameEvent event = waiting_.front();
    waiting_.pop_front();
    const BodyDef* def = world.Find(event.self);
    if (def == nullptr || (def->motion == Motion::kDynamic && !world.Owns(event.self))) continue;
    const std::array<tessera_game_value, 2> arguments{BodyValue(event.self), BodyValue(event.other)};
    Call(world, event.callback, event.self, def->kind, arguments);
  }
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
  return Transaction(world, {settings_.spawns_per_tick - made_, settings_.bodies_per_region});
}

// Timers that were due when it began; one that a callback sets for now is of the next tick.
void GameHost::RunTimersOf(BodyId id, GameWorld& world) {
  std::vector<GameTimer> due = world.RecordOf(id).timers;
  std::erase_if(due, [this](const GameTimer& timer) { return timer.due > tick_; });
  for (const GameTimer& timer : due) {
    if (Exhausted() || !world.Owns(id)) return;
    const auto values = DecodeFields(timer.values);
    std::vector<tessera_game_field> fields;
    if (values.ok()) {
      fields.reserve(values->size());
      for (const auto& [name, value] : *values) fields.push_back({name.data(), name.size(), ToInterface(value)});
    }
    std::array<tessera_game_value, 3> arguments{BodyValue(id)};
    arguments[1].type = TESSERA_GAME_TEXT;
    arguments[1].count = static_cast<std::uint32_t>(timer.name.size());
    arguments[1].as.text = timer.name.data();
    arguments[2].type = TESSERA_GAME_FIELDS;
    arguments[2].count = static_cast<std::uint32_t>(fields.size());
    arguments[2].as.fields = fields.data();
    // It is over whether the callback fails or not, and an earlier callback may have taken it back.
    bool there = false;
    const auto take = [&](Transaction& transaction) {
      std::vector<GameTimer>& timers = transaction.Own(id)->record.timers;
      there = std::erase_if(timers, [&](const GameTimer& other) { return other.number == timer.number; }) > 0;
      return there;
    };
    Call(world, kOnBodyTimer, id, world.Find(id)->kind, arguments, take);
  }
}

// As many as the tick's budget lets; the next tick goes on where this one ended.
void GameHost::RunBodyTicks(GameWorld& world) {
  std::vector<std::pair<BodyId, std::uint16_t>> ticked;
  world.ForEachOwned([&](BodyId id, const BodyDef& def) {
    if (def.kind != 0 && HandlerOf(kOnBodyTick, def.kind).there) ticked.emplace_back(id, def.kind);
  });
  const auto from = std::ranges::lower_bound(ticked, next_ticked_, {}, [](const auto& entry) { return entry.first; });
  std::rotate(ticked.begin(), from, ticked.end());
  for (const auto& [id, kind] : ticked) {
    next_ticked_ = id;
    if (Exhausted()) return;
    if (!world.Owns(id)) continue;  // another one's callback removed it
    const tessera_game_value self = BodyValue(id);
    Call(world, kOnBodyTick, id, kind, {&self, 1});
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
  const tessera_game_event event{sizeof event, callback, kind == 0 ? nullptr : scene_->kinds[kind].c_str(),
                                 arguments.data(), static_cast<std::uint32_t>(arguments.size())};
  tessera_game_error error{};
  const bool failed = module_.run(game_, &call, &event, &error) != 0 || call.instructions > call.budget;
  // A call costs something even where the module counts nothing.
  const std::uint64_t instructions = std::min(call.instructions, call.budget) + 1;
  used_ += instructions;
  statistics_.instructions += instructions;
  ++statistics_.calls;
  if (failed) {
    Transaction nothing = Begin(world);
    prepare(nothing);
    nothing.Commit();
    NoteFailure(handler, callback, self, kind, error.text[0] == '\0' ? "too much work" : TextOf(error));
    return;
  }
  handler.failures = 0;
  const std::size_t made = transaction.Commit();
  made_ += made;
  statistics_.spawned += made;
  for (const std::string& line : transaction.lines()) Say({tick_, self, false, line});
}

void GameHost::NoteFailure(Handler& handler, std::uint32_t callback, BodyId self, std::uint16_t kind,
                           std::string text) {
  ++statistics_.errors;
  Say({tick_, self, true, std::move(text)});
  if (++handler.failures < settings_.failures_until_off) return;
  handler.off = true;
  ++statistics_.callbacks_off;
  const std::string name(FindCallback(callback)->name);
  Say({tick_, self, true,
       absl::StrCat(kind == 0 ? "" : absl::StrCat("kinds.", scene_->kinds[kind], "."), name, " failed ",
                    handler.failures, " times in a row and is off"),
       true});
}

void GameHost::Say(GameLine line) {
  // That a callback is off is said once, so it is never left out.
  if (lines_this_tick_ >= kMaxLogLinesPerTick && !line.off) {
    ++statistics_.dropped_lines;
    return;
  }
  ++lines_this_tick_;
  line.text = ValidUtf8(line.text);
  lines_.push_back(std::move(line));
}

std::vector<GameLine> GameHost::TakeLines() { return std::exchange(lines_, {}); }

}  // namespace tessera::game

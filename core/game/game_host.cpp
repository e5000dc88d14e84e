#include "core/game/game_host.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/game/arguments.h"
#include "core/game/calls.h"
#include "core/game/control_calls.h"
#include "core/game/joint_calls.h"
#include "core/world/utf8.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

std::string TextOfError(const tessera_game_error& error) {
  const auto end = std::ranges::find(error.text, '\0');
  return ValidUtf8({std::begin(error.text), end});
}

// Modules that were built before there were movements have a shorter table.
constexpr std::size_t kLeastModuleBytes = offsetof(tessera_game_module, movement);
}  // namespace

const tessera_movement* OwnMovement(const tessera_game_module& module) {
  return module.size >= kLeastModuleBytes + sizeof module.movement ? module.movement : nullptr;
}

BodyId CarrierOf(const GameEvent& event, const GameWorld& world) {
  const BodyDef* const def = world.Find(event.self);
  return def != nullptr && def->motion == Motion::kStatic ? event.other : event.self;
}

absl::StatusOr<std::unique_ptr<GameHost>> GameHost::Load(const tessera_game_module& module, GameFile file,
                                                         std::shared_ptr<const Scene> scene, GameSettings settings,
                                                         std::uint64_t seed, std::uint32_t number) {
  if (module.abi != TESSERA_GAME_ABI || module.size < kLeastModuleBytes) {
    return absl::InvalidArgumentError(absl::StrCat(file.name, ": is made for version ", module.abi,
                                                   " of the interface, and this is version ", TESSERA_GAME_ABI));
  }
  auto host =
      std::unique_ptr<GameHost>(new GameHost(module, std::move(file), std::move(scene), settings, seed, number));
  const tessera_movement* const own = OwnMovement(module);
  if (own != nullptr && host->file_.movement != nullptr) {
    return absl::InvalidArgumentError(
        absl::StrCat(host->file_.name, ": movement: the game has one of its own, and takes no other"));
  }
  if (const tessera_movement* const table = own != nullptr ? own : host->file_.movement; table != nullptr) {
    absl::StatusOr<GameMovement> movement = MovementIn(*host->scene_, *table);
    if (!movement.ok()) {
      return absl::InvalidArgumentError(absl::StrCat(host->file_.name, ": ", movement.status().message()));
    }
    host->movement_ = *std::move(movement);
  }
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
  if (module_.load(&GameFunctions(), &source, &game, &error) != 0)
    return absl::InvalidArgumentError(TextOfError(error));
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
    if (has(event)) Wait({&event, 1});
  }
  for (const FailedCallback& failed : state.failed) {
    Handler& handler = HandlerOf(failed.callback, failed.kind);
    if (failed.off && !handler.off) ++statistics_.callbacks_off;
    handler.failures = std::max(handler.failures, failed.failures);
    handler.off = handler.off || failed.off;
  }
  if (next_ticked_ == BodyId()) next_ticked_ = state.next_ticked;
}

void GameHost::Wait(std::span<const GameEvent> events) {
  for (const GameEvent& event : events) {
    if (waiting_.size() < kMaxWaitingEvents) {
      waiting_.push_back(event);
    } else {
      ++statistics_.dropped_events;
    }
  }
}

std::vector<GameEvent> GameHost::TakeWaiting(BodyId body, const GameWorld& world) {
  std::vector<GameEvent> taken;
  std::erase_if(waiting_, [&](const GameEvent& event) {
    if (CarrierOf(event, world) != body) return false;
    if (taken.size() < kMaxCarriedEvents) {
      taken.push_back(event);
    } else {
      ++statistics_.dropped_events;
    }
    return true;
  });
  return taken;
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
      const bool migration = callback.number == kOnBodyMigrate || callback.number == kOnWorldMigrate;
      if (migration) migrates_ = migrates_ || handler.there;
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
    if (!TellByMessage(event, world)) Wait({&event, 1});
  }
  if (number_ > 0 && migrates_) RunMigrations(world);
  SettleAllJoints(world);
  SettleAllControl(world);
  Call(world, kOnTick, BodyId(), 0, {});
  RunJoins(players.joined, world);
  RunCommands(players.leaving, world);
  RunLeaves(players.leaving, world);
  RunEvents(world);
  RunMessages(world);
  RunAnswers(world);
  RunTimers(world);
  if (ticks_) RunBodyTicks(world);
}

Transaction GameHost::Begin(GameWorld& world) const {
  return Transaction(
      world, {settings_.spawns_per_tick - made_, settings_.bodies_per_region, settings_.messages_per_tick - sent_},
      number_);
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
    const tessera_game_value self = BodyResult(id);
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

void GameHost::Call(GameWorld& world, std::uint32_t callback, BodyId self, std::uint16_t kind,
                    std::span<const tessera_game_value> arguments, Prepare prepare) {
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
  call.claim = claim_;
  const tessera_game_callback event{sizeof event, callback, kind == 0 ? nullptr : scene_->kinds[kind].c_str(),
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
  if (call.effects) NoteEffects(*call.effects, failed);
  if (failed) {
    Transaction nothing = Begin(world);
    prepare(nothing);
    nothing.Commit();
    NoteFailure(handler, callback, self, kind, error.text[0] == '\0' ? "too much work" : TextOfError(error));
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

void GameHost::NoteEffects(const EffectCounts& of_call, bool failed) {
  for (std::size_t i = 0; i < kEffects; ++i) {
    EffectCount& count = statistics_.effects[i];
    (failed ? count.discarded : count.done) += of_call[i].done;
    count.refused += of_call[i].refused;
  }
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

void GameHost::NoteMoved(Tick tick, PlayerNumber player, const std::string& error) {
  if (error.empty() && movement_failed_.empty()) return;
  std::erase_if(movement_failed_, [&](const auto& failed) { return failed.second + kMovementSilence < tick; });
  if (error.empty()) return;
  ++statistics_.errors;
  const bool known = !movement_failed_.insert_or_assign(player, tick).second;
  if (known) return;
  Say({tick, PlayerBodyId(player), true,
       absl::StrCat(file_.name, ": player ", player.value(), " is not moved: ", error)});
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

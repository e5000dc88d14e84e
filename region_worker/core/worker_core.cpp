#include "region_worker/core/worker_core.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/rules.h"
#include "core/replication/snapshot_settings.h"
#include "core/world/limits.h"
#include "game_sdk/lua/lua_module.h"
#include "region_worker/core/client_map.h"
#include "region_worker/core/initial_state.h"
#include "region_worker/core/reason.h"

namespace tessera::worker {

Actions& WorkerCore::TakeActions() {
  taken_.clear();
  taken_.swap(actions_);
  return taken_;
}

// --- Orders ----------------------------------------------------------------------------------------------------------

void WorkerCore::TakeOrder(const v1::WorkerOrder& message, TimePoint now) {
  if (stopping()) return;
  absl::StatusOr<Order> order = CheckOrder(message, setup_.identity, setup_.borders);
  if (!order.ok()) {
    return LogError(actions_,
                    absl::StrCat("order refused from=agent revision=", message.revision(), Reason(order.status())));
  }
  // The file of a next game, and the list of revocations, come later than the order, which the agent sends again then.
  const bool fuller =
      order->revision == order_.revision && (order->next_game != order_.next_game || order->revoked != order_.revoked);
  if (order->revision <= order_.revision && !fuller) return;
  if (order->players_since != 0) {
    if (order->players_since != order_.revision) {
      LogError(actions_,
               absl::StrCat("order refused from=agent revision=", order->revision, ": its players are changes since ",
                            order->players_since, ", and the last is ", order_.revision, "; asks for a whole one"));
      actions_.emplace_back(AskWholeOrder{});
      return;
    }
    CompletePlayers(std::move(order_.players), *order);
  }
  order_ = *std::move(order);
  LogInfo(actions_,
          absl::StrCat("order from=agent revision=", order_.revision, " peers=", order_.peers.size(),
                       " players=", order_.players.size(), " map=", order_.map ? order_.map->version().value() : 0,
                       " planned=", order_.planned ? order_.planned->map.version().value() : 0,
                       " standby=", order_.standby.value(), " primaries=", order_.primaries.size(),
                       " run=", order_.run ? "true" : "false", " stop=", order_.stop ? "true" : "false",
                       " op=", order_.operation));
  if (order_.stop && order_.goes_on) return StopHere("the region goes on elsewhere, or from a checkpoint");
  if (order_.stop) return Stop("the instance ends");
  if (run_) {
    FollowOrder(now);
  } else {
    Progress(now);
  }
}

void WorkerCore::StartStandalone(Order order, std::shared_ptr<const Scene> scene, TimePoint now) {
  order_ = std::move(order);
  scene_ = std::move(scene);
  if (setup_.game_module != nullptr) game_ = game::GameFile{setup_.game_module_name, ""};
  Progress(now);
}

// Repeating it does nothing.
void WorkerCore::FollowOrder(TimePoint now) {
  if (MustRebuild()) {
    if (const absl::Status built = Build(); !built.ok()) return Fail(built);
    if (phase_ == v1::WORKER_PHASE_RUNNING) run_->Run(now, actions_);
  }
  links_.SetAddresses(order_.peers, actions_);
  for (const DeadRegion& life : order_.revoked) links_.Fence(life.region, life.incarnation, actions_);
  if (const absl::Status followed = run_->Follow(order_, now, links_, actions_); !followed.ok()) return Fail(followed);
  if (run_->failovers().fenced()) return StopHere("fenced: another region has taken its place");
  links_.SetPartners(run_->Partners(order_), actions_);
  FollowNextGame();
  ReportInventory(now);
  if (phase_ != v1::WORKER_PHASE_LOADING) actions_.emplace_back(PublishMap{ClientMap()});
}

// A region that is to join, and was not asked to step yet, joins by another map or at another tick.
bool WorkerCore::MustRebuild() const {
  if (!order_.joins_running || !order_.planned) return false;
  const region::Region& region = run_->region();
  const Tick begins(order_.planned->effective.value() - 1);
  if (run_->ticks().stepped() || region.map().version() > order_.planned->map.version()) return false;
  return region.map().version() != order_.planned->map.version() || region.tick() != begins;
}

// --- From loading to running -----------------------------------------------------------------------------------------

void WorkerCore::Progress(TimePoint now) {
  if (!links_.health().ok()) return Fail(links_.health());
  if (phase_ == v1::WORKER_PHASE_LOADING && CanLoad()) Load();
  if (phase_ == v1::WORKER_PHASE_LOADING && CanLoad() && !loading_ && CanOpen()) {
    if (const absl::Status built = Build(); !built.ok()) return Fail(built);
    actions_.emplace_back(OpenPorts{*order_.certified, region::RulesOf(order_.borders),
                                    std::min(order_.snapshot_rate_hz, scene_->tick_rate_hz), ClientMap()});
    FollowOrder(now);
    if (stopping()) return;
    phase_ = v1::WORKER_PHASE_BOUND;
  }
  if (phase_ == v1::WORKER_PHASE_BOUND && links_.AllLinked()) phase_ = v1::WORKER_PHASE_LINKED;
  if (phase_ == v1::WORKER_PHASE_LINKED && StartIsDue()) {
    running_since_ = now;
    run_->Run(now, actions_);
    phase_ = v1::WORKER_PHASE_RUNNING;
    LogInfo(actions_, "running");
    // One that is started by hand stays as its shell wants it.
    if (!setup_.standalone) actions_.emplace_back(RaisePriority{});
  }
  const std::optional<Duration> runtime = setup_.standalone ? setup_.standalone->runtime : std::nullopt;
  if (phase_ == v1::WORKER_PHASE_RUNNING && runtime && now >= running_since_ + *runtime) Stop("its time is over");
}

bool WorkerCore::CanLoad() const {
  return order_.map && (scene_ || !order_.scene_path.empty()) &&
         (!order_.game || game_ || !order_.game->path.empty()) &&
         (!order_.movement || setup_.movement != nullptr || !order_.movement->path.empty()) &&
         (!order_.joins_running || order_.planned);
}

// A certificate for another key was made for a process before this one.
bool WorkerCore::CanOpen() const { return order_.certified && order_.certified->worker_key == setup_.key; }

// Asks for the files that are still needed, one after the other.
void WorkerCore::Load() {
  if (loading_) return;
  const bool restores = order_.initial_state && !order_.joins_running;
  if (!scene_) {
    actions_.emplace_back(RequestScene{order_.scene_path, order_.scene_hash});
    loading_ = true;
  } else if (order_.movement && setup_.movement == nullptr) {
    actions_.emplace_back(RequestMovement{order_.movement->path, order_.movement->name, order_.movement->hash});
    loading_ = true;
  } else if (order_.game && !game_) {
    const OrderedGame& game = *order_.game;
    if (game.native) {
      actions_.emplace_back(RequestModule{game.path, game.name, game.hash});
    } else {
      actions_.emplace_back(RequestGame{game.path, game.hash});
    }
    loading_ = true;
  } else if (restores && !initial_) {
    actions_.emplace_back(RequestState{order_.initial_state->path});
    loading_ = true;
  }
}

void WorkerCore::SceneLoaded(absl::StatusOr<std::shared_ptr<const Scene>> scene, TimePoint now) {
  loading_ = false;
  if (stopping()) return;
  if (!scene.ok()) return Fail(scene.status());
  scene_ = *std::move(scene);
  Progress(now);
}

void WorkerCore::GameLoaded(const absl::StatusOr<std::string>& bytes, TimePoint now) {
  if (run_) {
    if (stopping() || !order_.next_game || next_game_.hash != order_.next_game->hash) return;
    absl::StatusOr<std::shared_ptr<game::GameHost>> next = LoadNext(bytes);
    next_game_.known = true;
    next_game_.failure = next.ok() ? "" : std::string(next.status().message());
    LogInfo(actions_, absl::StrCat("next game number=", order_.next_game->number, " hash=", next_game_.hash,
                                   next.ok() ? " loaded" : Reason(next.status())));
    if (next.ok()) run_->PrepareGame(*std::move(next));
    return;
  }
  loading_ = false;
  if (stopping() || !order_.game) return;
  if (!bytes.ok()) return Fail(bytes.status());
  game::GameFile file{order_.game->name, *bytes, setup_.movement};
  if (const absl::Status status = game::CheckGameFile(file); !status.ok()) {
    return Fail(absl::InvalidArgumentError(absl::StrCat("game ", order_.game->path, ": ", status.message())));
  }
  if (const std::string hash = game::GameHash(file.bytes); !order_.game->hash.empty() && hash != order_.game->hash) {
    return Fail(absl::InvalidArgumentError(
        absl::StrCat("game ", order_.game->path, ": has hash ", hash, ", not ", order_.game->hash)));
  }
  game_ = std::move(file);
  Progress(now);
}

void WorkerCore::ModuleLoaded(const absl::StatusOr<const tessera_game_module*>& module, TimePoint now) {
  loading_ = false;
  if (stopping() || !order_.game || !order_.game->native) return;
  if (!module.ok()) return Fail(module.status());
  setup_.game_module = *module;
  game_ = game::GameFile{order_.game->name, ""};
  Progress(now);
}

void WorkerCore::MovementLoaded(const absl::StatusOr<const tessera_movement*>& movement, TimePoint now) {
  loading_ = false;
  if (stopping() || !order_.movement) return;
  if (!movement.ok()) return Fail(movement.status());
  setup_.movement = *movement;
  Progress(now);
}

void WorkerCore::StateLoaded(const absl::StatusOr<region::Bytes>& bytes, TimePoint now) {
  loading_ = false;
  if (stopping() || !order_.initial_state) return;
  if (!bytes.ok()) return Fail(bytes.status());
  absl::StatusOr<region::RegionState> state =
      ReadInitialState(*order_.initial_state, *bytes, region::Catalog(scene_, game_.has_value()));
  if (!state.ok()) return Fail(state.status());
  initial_ = std::make_shared<const region::RegionState>(*std::move(state));
  Progress(now);
}

absl::StatusOr<std::shared_ptr<game::GameHost>> WorkerCore::LoadNext(const absl::StatusOr<std::string>& bytes) const {
  if (!bytes.ok()) return bytes.status();
  const OrderedGame& next = *order_.next_game;
  const game::GameFile file{next.name, *bytes, setup_.movement};
  if (absl::Status status = game::CheckGameFile(file); !status.ok()) return status;
  if (const std::string hash = game::GameHash(file.bytes); hash != next.hash) {
    return absl::DataLossError(absl::StrCat("game ", next.path, ": has hash ", hash, ", not ", next.hash));
  }
  if (run_->game() == nullptr) return absl::FailedPreconditionError("this world runs no game");
  if (setup_.game_module != nullptr) return absl::FailedPreconditionError("this world runs a native game");
  auto host = game::GameHost::Load(*game::LuaGameModule(), file, scene_, {},
                                   game::GameSeed(setup_.identity.instance_id), next.number);
  if (!host.ok()) return host.status();
  return std::shared_ptr<game::GameHost>(*std::move(host));
}

// Asks for the file of the game that is to be next, once it is here.
void WorkerCore::FollowNextGame() {
  if (!order_.next_game) return;
  const OrderedGame& next = *order_.next_game;
  if (next_game_.hash != next.hash) next_game_ = {.hash = next.hash, .failure = {}};
  if (next_game_.known) return;
  if (!next.failure.empty()) {
    next_game_.known = true;
    next_game_.failure = next.failure;
  } else if (!next.path.empty() && !next_game_.asked) {
    next_game_.asked = true;
    actions_.emplace_back(RequestGame{next.path, next.hash});
  }
}

// Again: with the newest order's map, for a region that has not stepped yet.
absl::Status WorkerCore::Build() {
  absl::StatusOr<region::Config> config = MakeConfig();
  if (!config.ok()) return config.status();
  const bool views_have_a_radius = replication::SnapshotSettingsFor(*scene_).interest_radius_m > 0;
  next_game_ = {};
  run_.reset();
  run_.emplace(setup_.identity, *std::move(config), views_have_a_radius);
  links_.ForgetFrames();
  run_->Begin(links_, actions_);
  initial_.reset();
  return absl::OkStatus();
}

// Null without a game. All regions give their games the same seed.
absl::StatusOr<std::shared_ptr<game::GameHost>> WorkerCore::MakeGame(std::uint32_t number) const {
  if (!game_) return std::shared_ptr<game::GameHost>();
  const tessera_game_module& module = setup_.game_module != nullptr ? *setup_.game_module : *game::LuaGameModule();
  auto host = game::GameHost::Load(module, *game_, scene_, {}, game::GameSeed(setup_.identity.instance_id), number);
  if (!host.ok()) return host.status();
  return std::shared_ptr<game::GameHost>(*std::move(host));
}

absl::StatusOr<region::Config> WorkerCore::MakeConfig() const {
  const Identity& self = setup_.identity;
  region::Config config = {.self = self.region,
                           .incarnation = self.incarnation,
                           .scene = scene_,
                           .map = order_.joins_running ? order_.planned->map : *order_.map,
                           .settings = order_.borders,
                           .initial = initial_};
  if (!config.map.HasRegion(self.region)) {
    return absl::InvalidArgumentError(absl::StrCat("region ", self.region.value(), " is not in the map"));
  }
  absl::StatusOr<std::shared_ptr<game::GameHost>> game = MakeGame(config.map.terms().game);
  if (!game.ok()) return game.status();
  config.game = *std::move(game);
  if (order_.joins_running) {
    region::RegionState nothing;
    nothing.region = self.region;
    nothing.incarnation = self.incarnation;
    nothing.tick = Tick(order_.planned->effective.value() - 1);
    config.initial = std::make_shared<const region::RegionState>(std::move(nothing));
  }
  return config;
}

bool WorkerCore::StartIsDue() const {
  return setup_.standalone ? connected_.size() >= setup_.standalone->players : order_.run;
}

// --- Other regions and clients ---------------------------------------------------------------------------------------

void WorkerCore::LinkUp(RegionId region, Incarnation incarnation, TimePoint now) {
  links_.Up(region, incarnation, now, actions_);
}

void WorkerCore::Receive(RegionId from, const LinkMessage& message, TimePoint now) {
  links_.Heard(from, now);
  if (run_ && !stopping()) run_->Receive(from, message, now, links_, actions_);
}

// One of a higher generation than the order's is as good as named: the control plane has signed it, and the order is on
// its way.
Admission WorkerCore::Admit(PlayerNumber player, net::Generation generation) {
  if (const OrderedPlayer* known = FindPlayer(order_.players, player); known != nullptr) {
    if (known->left) return Admission::kLeft;
    return generation < known->generation ? Admission::kReplaced : Admission::kWelcome;
  }
  const bool comes_by_itself =
      setup_.standalone && player != PlayerNumber() && player.value() <= kUsualPlayers && run_.has_value();
  if (!comes_by_itself) return Admission::kNotYet;
  const auto place = std::ranges::lower_bound(order_.players, player, {}, &OrderedPlayer::number);
  order_.players.insert(place, setup_.standalone->make_player(player));
  run_->SetPlayers(order_.players, order_.joins_running, actions_);
  return Admission::kWelcome;
}

absl::Status WorkerCore::TakeInput(const PlayerInput& input) {
  if (!run_) return absl::FailedPreconditionError("the world is not built yet");
  return run_->TakeInput(input);
}

absl::Status WorkerCore::TakeCommand(PlayerNumber player, const region::PlayerCommand& command) {
  if (!run_) return {absl::StatusCode::kNotFound, ""};
  return run_->TakeCommand(player, command);
}

void WorkerCore::AcknowledgeEvents(PlayerNumber player, std::uint32_t event) {
  if (run_) run_->AcknowledgeEvents(player, event);
}

std::string WorkerCore::EndedBecause(PlayerNumber player) const {
  const OrderedPlayer* known = FindPlayer(order_.players, player);
  return known == nullptr ? "" : known->ended_because;
}

// Without a control plane the worker itself notes that the game has sent a player away.
void WorkerCore::RemoveEnded() {
  bool any = false;
  for (const region::EndedPlayer& ended : run_->region().ended_players()) {
    const auto known = std::ranges::lower_bound(order_.players, ended.player, {}, &OrderedPlayer::number);
    if (known == order_.players.end() || known->number != ended.player || known->left) continue;
    known->left = any = true;
    known->ended_because = ended.reason;
  }
  if (any) run_->SetPlayers(order_.players, order_.joins_running, actions_);
}

// --- Time ------------------------------------------------------------------------------------------------------------

bool WorkerCore::Advance(TimePoint now) {
  if (!stopping()) {
    Progress(now);
    if (!stopping() && run_ && run_->Advance(now, links_, actions_)) return true;
  }
  Settle(now);
  return false;
}

void WorkerCore::Step(TimePoint now, const region::PhaseObserver& observer) {
  run_->Step(now, observer, links_, actions_);
}

void WorkerCore::StepEnded(TimePoint end, Duration work) {
  run_->StepEnded(end, work);
  Settle(end);
}

// Consequences of any event.
void WorkerCore::Settle(TimePoint now) {
  if (run_ && !stopping()) {
    FollowMaps();
    KeepLease(now);
    checkpoints_.Follow(order_.checkpoint, run_->region(), actions_);
    if (setup_.standalone) RemoveEnded();
  }
  if (!setup_.standalone) Report(now);
}

void WorkerCore::FollowMaps() {
  if (!run_->MapCameIntoForce(actions_)) return;
  if (const std::uint32_t game = run_->region().map().terms().game; run_->game() && run_->game()->number() != game) {
    return Fail(absl::InternalError(absl::StrCat("game ", game, " is in force and is not loaded here")));
  }
  links_.SetPartners(run_->Partners(order_), actions_);
  actions_.emplace_back(PublishMap{ClientMap()});
}

v1::RegionMap WorkerCore::ClientMap() const {
  return MakeClientMap(run_->region().map(), setup_.address, order_.peers);
}

void WorkerCore::ReportInventory(TimePoint now) {
  if (setup_.standalone) return;
  std::optional<v1::InventoryReport> report;
  if (std::optional<v1::Inventory> inventory = run_->failovers().InventoryAt(now, run_->copies())) {
    report.emplace();
    *report->mutable_identity() = ToProto(setup_.identity);
    *report->mutable_inventory() = *std::move(inventory);
  }
  if (!report && !inventory_sent_) return;
  inventory_sent_ = report.has_value();
  actions_.emplace_back(SendInventory{std::move(report)});
}

void WorkerCore::TakeLease(const v1::LeaseRenewal& renewal) {
  if (!run_ || renewal.identity().incarnation() != setup_.identity.incarnation.value()) return;
  run_->LeaseGranted(renewal.number(), std::chrono::milliseconds(renewal.ttl_ms()));
}

void WorkerCore::KeepLease(TimePoint now) {
  if (setup_.standalone) return;
  const std::optional<std::uint64_t> number = run_->AskForLease(now, links_, actions_);
  if (!number) return;
  v1::LeaseRequest request;
  *request.mutable_identity() = ToProto(setup_.identity);
  request.set_number(*number);
  actions_.emplace_back(AskForLease{std::move(request)});
}

// --- Reports ---------------------------------------------------------------------------------------------------------

ReportedState WorkerCore::State() const {
  ReportedState state = {.phase = phase_,
                         .order_revision = order_.revision,
                         .linked = run_ ? run_->HeardLinks(links_) : links_.Linked(),
                         .players = connected_,
                         .failure = failure_,
                         .checkpoint_tick = checkpoints_.tick(),
                         .checkpoint_failure = checkpoints_.failure()};
  if (run_) {
    state.map = run_->region().map().version();
    state.planned = run_->planned();
    state.refused = run_->refused();
    state.paused = run_->paused();
    state.unprotected = run_->standby_log().unprotected();
    state.world_paused = run_->clock().paused();
    if (next_game_.known) {
      state.next_game = next_game_.hash;
      state.next_game_failure = next_game_.failure;
    }
    state.property_answers = run_->PropertyAnswers();
    state.backend_answers = run_->BackendAnswers();
    state.ended_players = run_->region().ended_players();
  }
  return state;
}

void WorkerCore::Report(TimePoint now) {
  ReportedState state = State();
  const auto events = run_ ? run_->region().published() : std::vector<game::Published::Event>();
  const std::uint64_t published = events.empty() ? 0 : events.back()->number;
  if (!report_gate_.Due(now, state, published)) return;
  v1::WorkerIdentity identity = ToProto(setup_.identity);
  identity.set_pid(setup_.pid);
  actions_.emplace_back(
      SendReport{MakeReport(identity, setup_.address, setup_.key, state, run_ ? &*run_ : nullptr, now)});
  report_gate_.Sent(now, std::move(state), published);
}

// --- The end ---------------------------------------------------------------------------------------------------------

void WorkerCore::Stop(std::string reason) {
  if (stopping()) return;
  LogInfo(actions_, absl::StrCat("stopping", Reason(reason)));
  phase_ = v1::WORKER_PHASE_STOPPING;
  stop_reason_ = std::move(reason);
}

void WorkerCore::StopHere(std::string reason) {
  if (stopping()) return;
  goes_on_ = true;
  Stop(std::move(reason));
}

void WorkerCore::Fail(const absl::Status& status) {
  failure_ = std::string(status.message());
  actions_.emplace_back(PrintFailure{failure_});
  StopHere("it failed");
}

}  // namespace tessera::worker

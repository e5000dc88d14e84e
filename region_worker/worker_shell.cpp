#include "region_worker/worker_shell.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "game_sdk/native/native_module.h"
#include "net/protocol.h"
#include "region_worker/input_files.h"
#include "region_worker/priority.h"
#include "region_worker/standalone.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"
#include "telemetry/process_metrics.h"

namespace tessera::worker {
namespace {

// ENet has timers of its own, for what was lost; they are looked at this often when nothing comes.
constexpr Duration kServiceInterval = std::chrono::milliseconds(20);
// While the game port is flooded what comes there wakes nobody, and is looked at so often. Longer, and honest players'
// inputs wait as long; shorter, and ten thousand hellos a second wake the loop as often.
constexpr Duration kFloodedInterval = std::chrono::milliseconds(2);
constexpr Duration kStatusInterval = std::chrono::seconds(1);
// For the last words to clients, neighbours and the agent.
constexpr Duration kFarewell = std::chrono::milliseconds(500);
constexpr std::chrono::milliseconds kAgentFarewell{500};
// Neighbours, those that bodies can reach, and some connections that are not proven yet.
constexpr std::size_t kLinkPeers = 128;
// Players, some of them once more while they come back, and some refused.
constexpr std::size_t kMorePeers = 256;

std::size_t GamePeers(std::uint32_t max_players) {
  return std::min<std::size_t>(max_players + kMorePeers, net::Acceptor::kMaxSessions);
}

absl::Status PortError(const absl::Status& status, const char* what) {
  return {status.code(), absl::StrCat(what, ": ", status.message())};
}

bool IsPortInUse(const absl::Status& status) {
  return status.code() == absl::StatusCode::kAlreadyExists || absl::StrContains(status.message(), "in use");
}

void PrintError(const std::string& reason) { std::fprintf(stderr, "tessera-region: %s\n", reason.c_str()); }

}  // namespace

WorkerShell::WorkerShell(WorkerOptions options, const SignalWatch& signals)
    : options_(std::move(options)), signals_(signals) {}

int WorkerShell::Run() {
  absl::StatusOr<StandaloneWorld> world = StandaloneWorld{};
  if (options_.standalone) world = PrepareStandalone(*options_.standalone, options_.identity, key_.verification_key());
  absl::Status status = world.status();
  if (status.ok()) status = Bind(*world);
  if (!status.ok()) {
    PrintError(std::string(status.message()));
    return IsPortInUse(status) ? kExitPortInUse : kExitFailure;
  }
  if (options_.standalone) core_->StartStandalone(std::move(world->order), world->scene, Clock::now());
  if (!options_.agent_socket.empty()) agent_ = std::make_unique<AgentLink>(options_.agent_socket);
  while (!core_->stopping()) {
    TakeFromAgent(Clock::now());
    ServiceNetwork();
    const TimePoint now = Clock::now();
    const bool steps = core_->Advance(now);
    CarryOut();
    if (steps) Step(now);
    if (const RegionRun* run = core_->run()) {
      clients_->GreetInPause(*run);
      figures_.SendIfDue(run->region(), clients_->port(), Clock::now());
    }
    PrintStatus(Clock::now());
    Wait(steps);
  }
  SayFarewell();
  return core_->failure().empty() ? kExitOk : kExitFailure;
}

// --- Start -----------------------------------------------------------------------------------------------------------

absl::Status WorkerShell::Bind(const StandaloneWorld& world) {
  auto game = net::Endpoint::Create({.bind_address = options_.bind_address,
                                     .port = options_.game_port,
                                     .max_peers = GamePeers(options_.max_players),
                                     .accept_reliable_messages = false,
                                     .accepted = net::kPlayerLimits,
                                     .datagrams_per_service = net::kDatagramsPerService,
                                     .datagrams_per_peer = net::kDatagramsPerSession});
  if (!game.ok()) return PortError(game.status(), "game port");
  auto links = net::Endpoint::Create({.bind_address = options_.bind_address,
                                      .port = options_.link_port,
                                      .max_peers = kLinkPeers,
                                      .max_message_bytes = net::kMaxFrameBytes});
  if (!links.ok()) return PortError(links.status(), "link port");
  auto server = telemetry::MetricsServer::Start(options_.metrics_host, options_.metrics_port, metrics_.registry(),
                                                options_.metrics_token, options_.metrics_tls);
  if (!server.ok()) return PortError(server.status(), "metrics port");
  clients_.emplace(*std::move(game), metrics_);
  links_.emplace(*std::move(links), metrics_);
  metrics_server_ = *std::move(server);

  WorkerSetup setup{.identity = options_.identity, .pid = getpid(), .address = {}, .borders = {}, .standalone = {}};
  if (world.module != nullptr) {
    setup.game_module = &world.module->module();
    setup.game_module_name = world.module->name();
  }
  if (world.movement != nullptr) setup.movement = world.movement->movement();
  setup.address.set_region(options_.identity.region.value());
  setup.address.set_incarnation(options_.identity.incarnation.value());
  setup.address.set_host(options_.advertise_address);
  setup.address.set_game_port(clients_->port().port());
  setup.address.set_link_port(links_->port());
  setup.address.set_metrics_port(metrics_server_->port());
  setup.key = key_.verification_key();
  if (options_.standalone) setup.standalone = RulesOf(*options_.standalone, world);
  core_.emplace(std::move(setup));
  spdlog::info("listening instance={} region={} at={} game={} links={} metrics={}",
               telemetry::LogValue(options_.identity.instance_id), options_.identity.region.value(),
               options_.bind_address, clients_->port().port(), links_->port(), metrics_server_->address());
  return absl::OkStatus();
}

// --- One round of the loop -------------------------------------------------------------------------------------------

void WorkerShell::TakeFromAgent(TimePoint now) {
  if (const std::optional<CheckpointWriter::Written> written = checkpoint_writer_.Take()) {
    core_->CheckpointWritten(written->tick, written->status);
    CarryOut();
  }
  if (agent_ == nullptr) return;
  if (const std::optional<v1::WorkerOrder> order = agent_->TakeOrder()) core_->TakeOrder(*order, now);
  if (const std::optional<v1::LeaseRenewal> renewal = agent_->TakeLease()) core_->TakeLease(*renewal);
  if (agent_->refused()) core_->StopHere("the agent does not know this worker");
  CarryOut();
}

void WorkerShell::ServiceNetwork() {
  const TimePoint begin = Clock::now();
  const RegionRun* run = core_->run();
  const MapVersion map_version = run != nullptr ? run->region().map().version() : MapVersion();
  links_->Service(begin, core_->links(), map_version,
                  {.up =
                       [&](RegionId region, Incarnation incarnation) {
                         core_->LinkUp(region, incarnation, begin);
                         CarryOut();
                       },
                   .down = [&](RegionId region) { core_->LinkDown(region); },
                   .message =
                       [&](RegionId from, const LinkMessage& message) {
                         core_->Receive(from, message, begin);
                         CarryOut();
                       }});
  clients_->Service(*core_, begin);
  // Also where nothing came of what was received: a flood of what is refused takes the tick's time too.
  if (run != nullptr) meter_.AddReceiveTime(Clock::now() - begin);
}

void WorkerShell::Step(TimePoint now) {
  meter_.Begin(now);
  core_->Step(now, meter_.observer());
  meter_.Stepped(core_->run()->ticks());
  CarryOut();
  const TimePoint end = Clock::now();
  core_->StepEnded(end, meter_.End(end));
  CarryOut();
  metrics_.Show(*core_->run(), core_->links());
}

// An agent's reports say the same.
void WorkerShell::PrintStatus(TimePoint now) {
  const RegionRun* run = core_->run();
  if (agent_ != nullptr || run == nullptr || now < next_status_) return;
  next_status_ = now + kStatusInterval;
  if (run->game() != nullptr) metrics_.ShowGame(*run->game());
  const region::Region& region = run->region();
  const TimeSummary step = run->statistics().step_times();
  const TickCounts& counts = run->statistics().counts();
  const std::string_view phase = v1::WorkerPhase_Name(core_->phase());
  spdlog::info(
      "{} tick={} rate_hz={:.1f} step_p50_ms={:.2f} step_p99_ms={:.2f} late={} owned={} ghosts={} asleep={} in={} "
      "out={} "
      "links={} clients={}",
      phase.substr(std::string_view("WORKER_PHASE_").size()), region.tick().value(), run->statistics().rate_hz(now),
      step.p50_s * 1e3, step.p99_s * 1e3, counts.late_ticks, region.owned().size(), region.ghost_count(),
      region.asleep_count(), counts.handovers_in, counts.handovers_out, links_->linked(),
      clients_->port().clients().size());
}

void WorkerShell::Wait(bool stepped) {
  const TimePoint now = Clock::now();
  TimePoint deadline = now;
  if (!stepped) {
    deadline = now + kServiceInterval;
    if (const auto due = core_->wake_at(now)) deadline = std::min(deadline, *due);
    if (const auto dial = links_->NextDial(core_->links())) deadline = std::min(deadline, *dial);
  }
  const bool flooded = clients_->port().flooded();
  if (flooded) deadline = std::min(deadline, now + kFloodedInterval);
  std::array<pollfd, 4> fds = {{{.fd = signals_.fd(), .events = POLLIN, .revents = 0},
                                {.fd = links_->socket(), .events = POLLIN, .revents = 0},
                                {.fd = flooded ? -1 : clients_->port().socket(), .events = POLLIN, .revents = 0},
                                {.fd = agent_ ? agent_->wake_fd() : -1, .events = POLLIN, .revents = 0}}};
  WaitReadable(fds, now, deadline);
  if ((fds[0].revents & POLLIN) == 0) return;
  if (const int signal = signals_.Take(); signal != 0) core_->Stop(absl::StrCat("signal ", signal));
}

// --- The core's actions ----------------------------------------------------------------------------------------------

void WorkerShell::CarryOut() {
  for (Actions* actions = &core_->TakeActions(); !actions->empty(); actions = &core_->TakeActions()) {
    for (Action& action : *actions) std::visit([this](auto& what) { Do(what); }, action);
  }
}

void WorkerShell::Do(const SendMessage& action) { links_->Send(action.to, *action.message); }
void WorkerShell::Do(const FlushLinks&) { links_->Flush(); }
void WorkerShell::Do(const CutLink& action) { links_->Cut(action.region, action.why); }

void WorkerShell::Do(const RequestScene& action) {
  scene_hash_ = action.hash;
  core_->SceneLoaded(LoadSceneFile(action.path, action.hash), Clock::now());
  malloc_trim(0);  // gives back the memory that parsing took
}

void WorkerShell::Do(const RequestGame& action) { core_->GameLoaded(ReadGameFile(action.path), Clock::now()); }

// The agent has put the folder and the name together; the name is checked once more.
void WorkerShell::Do(const RequestModule& action) {
  const std::string folder = std::filesystem::path(action.path).parent_path().string();
  const auto module = game::NativeModule::Load(folder, action.name, action.hash);
  if (!module.ok()) return core_->ModuleLoaded(module.status(), Clock::now());
  spdlog::info("game module loaded name={} hash={}", (*module)->name(), (*module)->hash());
  core_->ModuleLoaded(&(*module)->module(), Clock::now());
}

void WorkerShell::Do(const RequestMovement& action) {
  const std::string folder = std::filesystem::path(action.path).parent_path().string();
  const auto module = game::NativeModule::LoadMovement(folder, action.name, action.hash);
  if (!module.ok()) return core_->MovementLoaded(module.status(), Clock::now());
  spdlog::info("movement loaded name={} hash={}", (*module)->name(), (*module)->hash());
  core_->MovementLoaded((*module)->movement(), Clock::now());
}

void WorkerShell::Do(const RequestState& action) { core_->StateLoaded(ReadStateFile(action.path), Clock::now()); }

void WorkerShell::Do(WriteCheckpoint& action) {
  checkpoint_writer_.Begin(action.tick, std::move(action.path), std::move(action.state));
}

void WorkerShell::Do(const OpenPorts& action) {
  const net::EndpointIdentity self{.instance_id = options_.identity.instance_id,
                                   .region = options_.identity.region,
                                   .incarnation = options_.identity.incarnation,
                                   .instance_key = action.certified.instance_key,
                                   .certificate = action.certified.certificate,
                                   .key = key_};
  links_->Open({self, action.rules});
  clients_->Open(action, self, *core_, scene_hash_);
  metrics_.Show(*core_->run(), core_->links());
}

void WorkerShell::Do(const PublishMap& action) { clients_->port().SetMap(action.map); }
void WorkerShell::Do(const PublishStart& action) { clients_->port().SendStarted(action.tick); }
void WorkerShell::Do(const PublishClock& action) { clients_->Publish(action); }
void WorkerShell::Do(const PublishStep& action) { clients_->Publish(action, *core_->run()); }

void WorkerShell::Do(const ExpelPlayer& action) { clients_->port().Expel(action.player, action.ended_because); }

void WorkerShell::Do(const ReplacePlayer& action) { clients_->port().Replace(action.player, action.generation); }

void WorkerShell::Do(SendReport& action) {
  if (const RegionRun* run = core_->run()) {
    metrics_.Show(*run, core_->links());
    if (run->game() != nullptr) metrics_.ShowGame(*run->game());
  }
  if (agent_ == nullptr) return;
  action.report.set_resident_bytes(telemetry::ReadMemory().process_physical_bytes);
  agent_->Report(action.report);
}

void WorkerShell::Do(const SendInventory& action) {
  if (agent_ != nullptr) agent_->SetInventory(action.inventory);
}

void WorkerShell::Do(const AskForLease& action) {
  if (agent_ != nullptr) agent_->AskLease(action.request);
}

void WorkerShell::Do(const AskWholeOrder&) {
  if (agent_ != nullptr) agent_->Reattach();
}

// Only once it steps: while it loads the scene it yields to those that step.
void WorkerShell::Do(const RaisePriority&) {
  const absl::Status first = GoFirst();
  if (!first.ok()) spdlog::info("steps without priority reason={}", telemetry::LogValue(std::string(first.message())));
}

void WorkerShell::Do(const Log& action) {
  constexpr std::array kLevels = {spdlog::level::info, spdlog::level::warn, spdlog::level::err};
  spdlog::log(kLevels[static_cast<std::size_t>(action.severity)], "{}", action.line);
}

void WorkerShell::Do(const PrintFailure& action) { PrintError(action.reason); }

// --- End -------------------------------------------------------------------------------------------------------------

void WorkerShell::SayFarewell() {
  (void)core_->Advance(Clock::now());  // the last report
  CarryOut();
  clients_->port().Close(core_->stop_reason(), core_->goes_on());
  links_->Close();
  const TimePoint until = Clock::now() + kFarewell;
  for (TimePoint now = Clock::now(); now < until && (clients_->port().draining() || links_->draining());
       now = Clock::now()) {
    (void)clients_->port().Service(now, Tick(), false);
    links_->Service(now, core_->links(), MapVersion(), {});
    std::array<pollfd, 2> fds = {{{.fd = links_->socket(), .events = POLLIN, .revents = 0},
                                  {.fd = clients_->port().socket(), .events = POLLIN, .revents = 0}}};
    WaitReadable(fds, now, std::min(until, now + std::chrono::milliseconds(5)));
  }
  if (agent_ != nullptr) agent_->Close(kAgentFarewell);
}

}  // namespace tessera::worker

#include "region_worker/worker.h"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/partition_io.h"
#include "net/protocol.h"
#include "region_worker/by_hand.h"
#include "region_worker/priority.h"
#include "region_worker/scene_file.h"
#include "spdlog/fmt/ranges.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"

namespace tessera::worker {
namespace {

// ENet has timers of its own, for what was lost; they are looked at this often when nothing comes.
constexpr Duration kServiceInterval = std::chrono::milliseconds(20);
constexpr Duration kStatusInterval = std::chrono::seconds(1);
// For the last words to clients, neighbours and the agent.
constexpr Duration kFarewell = std::chrono::milliseconds(500);
constexpr std::chrono::milliseconds kAgentFarewell{500};
// Neighbours, those that bodies can reach, and some connections that are not proven yet.
constexpr std::size_t kLinkPeers = 128;
// Players, each once more while it comes back, and some refused.
constexpr std::size_t kGamePeers = kMaxPlayers + 256;

absl::Status PortError(const absl::Status& status, const char* what) {
  return {status.code(), absl::StrCat(what, ": ", status.message())};
}

bool IsPortInUse(const absl::Status& status) {
  return status.code() == absl::StatusCode::kAlreadyExists || absl::StrContains(status.message(), "in use");
}

void PrintError(const absl::Status& status) {
  std::fprintf(stderr, "tessera-region: %s\n", std::string(status.message()).c_str());
}

}  // namespace

Worker::Worker(WorkerOptions options, const SignalWatch& signals) : options_(std::move(options)), signals_(signals) {}

int Worker::Run() {
  absl::Status status = options_.by_hand ? PrepareByHand() : absl::OkStatus();
  if (status.ok()) status = Bind();
  if (!status.ok()) {
    PrintError(status);
    return IsPortInUse(status) ? kExitPortInUse : kExitFailure;
  }
  if (!options_.agent_socket.empty()) agent_ = std::make_unique<AgentLink>(options_.agent_socket);
  while (phase_ != v1::WORKER_PHASE_STOPPING) {
    TakeOrder();
    ServiceNetwork();
    Progress();
    const bool stepped = ticks_ && ticks_->Advance();
    if (ticks_) {
      FollowMaps();
      KeepLease(Clock::now());
      KeepCheckpoint();
    }
    Report(Clock::now());
    Wait(stepped);
  }
  SayFarewell();
  return failure_.empty() ? kExitOk : kExitFailure;
}

// --- Start -----------------------------------------------------------------------------------------------------------

absl::Status Worker::Bind() {
  auto game = net::Endpoint::Create({.bind_address = options_.bind_address,
                                     .port = options_.game_port,
                                     .max_peers = kGamePeers,
                                     .guests_speak_reliably = false});
  if (!game.ok()) return PortError(game.status(), "game port");
  auto links = net::Endpoint::Create({.bind_address = options_.bind_address,
                                      .port = options_.link_port,
                                      .max_peers = kLinkPeers,
                                      .max_message_bytes = net::kMaxFrameBytes});
  if (!links.ok()) return PortError(links.status(), "link port");
  auto server = telemetry::MetricsServer::Start(options_.bind_address, options_.metrics_port, metrics_.registry());
  if (!server.ok()) return PortError(server.status(), "metrics port");
  game_.emplace(*std::move(game), metrics_);
  links_.emplace(*std::move(links), metrics_);
  metrics_server_ = *std::move(server);

  address_.set_region(options_.identity.region.value());
  address_.set_incarnation(options_.identity.incarnation.value());
  address_.set_host(options_.advertise_address);
  address_.set_game_port(game_->port());
  address_.set_link_port(links_->port());
  address_.set_metrics_port(metrics_server_->port());
  spdlog::info("listening instance={} region={} at={} game={} links={} metrics={}",
               telemetry::LogValue(options_.identity.instance_id), options_.identity.region.value(),
               options_.bind_address, game_->port(), links_->port(), metrics_server_->port());
  return absl::OkStatus();
}

absl::Status Worker::PrepareByHand() {
  absl::StatusOr<std::shared_ptr<const Scene>> scene = LoadSceneFile(options_.by_hand->scene_path);
  if (!scene.ok()) return scene.status();
  scene_ = *std::move(scene);
  absl::StatusOr<Order> order = HandOrder(*options_.by_hand, *scene_);
  if (!order.ok()) return order.status();
  order_ = *std::move(order);
  return absl::OkStatus();
}

// --- One round of the loop -------------------------------------------------------------------------------------------

void Worker::ServiceNetwork() {
  const TimePoint begin = Clock::now();
  const bool from_links =
      links_->Service(begin, [&](RegionId from, const LinkMessage& message) { OnLinkMessage(from, message, begin); });
  bool from_clients = false;
  const Tick tick = ticks_ ? ticks_->region().tick() : Tick();
  for (const ClientInput& input : game_->Service(begin, tick, ticks_ && ticks_->running(), &from_clients)) {
    if (ticks_) ticks_->OnInput(input, begin);
  }
  if (ticks_ && (from_links || from_clients)) ticks_->AddReceiveTime(Clock::now() - begin);
}

void Worker::OnLinkMessage(RegionId from, const LinkMessage& message, TimePoint now) {
  if (!ticks_) return;
  switch (message.kind) {
    case LinkMessageKind::kFrame:
      return ticks_->OnFrame(from, message.bytes, now);
    case LinkMessageKind::kLog:
      return wards_->OnLog(from, message, now);
    case LinkMessageKind::kLogTaken:
      return ticks_->heir_log().OnTaken(from, Tick(message.number));
    case LinkMessageKind::kLogAgain:
      return ticks_->heir_log().OnAgain(from);
    case LinkMessageKind::kLeaseAsk:
      return wards_->OnLeaseAsk(from, message.number, now);
    case LinkMessageKind::kLeaseGiven:
      if (from == ticks_->heir_log().heir()) ticks_->lease().Answered(message.number, Lease::kTtl);
      return;
    case LinkMessageKind::kPlaces:
      return ticks_->OnPlaces(from, message.bytes, now);
    case LinkMessageKind::kAlive:
      return;  // that something came is all
  }
}

void Worker::Progress() {
  if (!links_->health().ok()) return Fail(links_->health());
  if (phase_ == v1::WORKER_PHASE_LOADING && CanBuild()) {
    if (const absl::Status built = Build(); !built.ok()) return Fail(built);
    OpenPorts();
    ApplyOrder();
    phase_ = v1::WORKER_PHASE_BOUND;
  }
  if (phase_ == v1::WORKER_PHASE_BOUND && links_->AllLinked()) phase_ = v1::WORKER_PHASE_LINKED;
  if (phase_ == v1::WORKER_PHASE_LINKED && StartIsDue()) {
    running_since_ = Clock::now();
    ticks_->Run(running_since_);
    phase_ = v1::WORKER_PHASE_RUNNING;
    spdlog::info("running");
    if (!options_.by_hand) TakePriority();
  }
}

// Only now: what loads a scene yields to those that step. One that is started by hand stays as its shell wants it.
void Worker::TakePriority() {
  const absl::Status first = GoFirst();
  if (!first.ok()) spdlog::info("steps without priority reason={}", telemetry::LogValue(std::string(first.message())));
}

bool Worker::StartIsDue() const {
  return options_.by_hand ? game_->clients().size() >= options_.by_hand->players : order_.run;
}

ReportedState Worker::State() const {
  ReportedState state = {.phase = phase_,
                         .order_revision = order_.revision,
                         .linked = links_->linked(),
                         .players = game_->players(),
                         .failure = failure_,
                         .checkpoint_tick = checkpoint_tick_,
                         .checkpoint_failure = checkpoint_failure_};
  if (ticks_) {
    state.map = ticks_->region().map().version();
    state.planned = follower_->planned();
    state.refused = follower_->refused();
    state.paused = ticks_->paused();
    state.unprotected = ticks_->heir_log().unprotected();
    state.property_answers = ticks_->PropertyAnswers();
  }
  return state;
}

void Worker::Report(TimePoint now) {
  if (agent_ == nullptr) return PrintStatus(now);
  ReportedState state = State();
  if (!report_gate_.Due(now, state)) return;
  agent_->Report(
      MakeReport(options_.identity, address_, state, ticks_ ? &*ticks_ : nullptr, wards_ ? &*wards_ : nullptr));
  report_gate_.Sent(now, state);
}

void Worker::PrintStatus(TimePoint now) {
  if (now < next_status_ || !ticks_) return;
  next_status_ = now + kStatusInterval;
  const auto& ticks = *ticks_;
  const auto& region = ticks.region();
  const TimeSummary step = ticks.step_times();
  const std::string_view phase = v1::WorkerPhase_Name(phase_);
  spdlog::info(
      "{} tick={} rate_hz={:.1f} step_p50_ms={:.2f} step_p99_ms={:.2f} late={} owned={} ghosts={} asleep={} in={} "
      "out={} "
      "links={} clients={}",
      phase.substr(std::string_view("WORKER_PHASE_").size()), region.tick().value(), ticks.rate_hz(now),
      step.p50_s * 1e3, step.p99_s * 1e3, ticks.counts().late_ticks, region.owned_count(), region.ghost_count(),
      region.asleep_count(), ticks.counts().handovers_in, ticks.counts().handovers_out, links_->linked().size(),
      game_->clients().size());
}

void Worker::Wait(bool stepped) {
  const TimePoint now = Clock::now();
  TimePoint deadline = now;
  if (!stepped) {
    deadline = now + kServiceInterval;
    if (ticks_) {
      if (const auto due = ticks_->wake_at(now)) deadline = std::min(deadline, *due);
    }
    if (const auto dial = links_->next_dial()) deadline = std::min(deadline, *dial);
  }
  std::array<pollfd, 4> fds = {{{.fd = signals_.fd(), .events = POLLIN, .revents = 0},
                                {.fd = links_->socket(), .events = POLLIN, .revents = 0},
                                {.fd = game_->socket(), .events = POLLIN, .revents = 0},
                                {.fd = agent_ ? agent_->wake_fd() : -1, .events = POLLIN, .revents = 0}}};
  WaitReadable(fds, now, deadline);
  if ((fds[0].revents & POLLIN) != 0) {
    if (const int signal = signals_.Take(); signal != 0) Stop(absl::StrCat("signal ", signal));
  }
  const auto& hand = options_.by_hand;
  if (phase_ == v1::WORKER_PHASE_RUNNING && hand && hand->seconds &&
      now >= running_since_ + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*hand->seconds))) {
    Stop("its time is over");
  }
}

Admission Worker::Admit(PlayerNumber player) {
  const auto known = std::find_if(order_.players.begin(), order_.players.end(),
                                  [&](const OrderedPlayer& ordered) { return ordered.number == player; });
  if (known != order_.players.end()) return known->left ? Admission::kLeft : Admission::kWelcome;
  if (!options_.by_hand || player == PlayerNumber() || player.value() > kMaxPlayers) return Admission::kNotYet;
  order_.players.push_back(HandPlayer(player, *scene_, *order_.map));
  ticks_->SetPlayers(order_.players, order_.joins_running);
  return Admission::kWelcome;
}

// --- End -------------------------------------------------------------------------------------------------------------

void Worker::Stop(std::string reason) {
  if (phase_ == v1::WORKER_PHASE_STOPPING) return;
  spdlog::info("stopping reason={}", telemetry::LogValue(reason));
  phase_ = v1::WORKER_PHASE_STOPPING;
  stop_reason_ = std::move(reason);
}

void Worker::Fail(const absl::Status& status) {
  PrintError(status);
  failure_ = std::string(status.message());
  Stop("it failed");
}

void Worker::SayFarewell() {
  if (agent_ != nullptr) Report(Clock::now());
  game_->Close(stop_reason_);
  links_->Close();
  const TimePoint until = Clock::now() + kFarewell;
  for (TimePoint now = Clock::now(); now < until && (game_->draining() || links_->draining()); now = Clock::now()) {
    bool any = false;
    (void)game_->Service(now, Tick(), false, &any);
    (void)links_->Service(now, [](RegionId, const LinkMessage&) {});
    std::array<pollfd, 2> fds = {{{.fd = links_->socket(), .events = POLLIN, .revents = 0},
                                  {.fd = game_->socket(), .events = POLLIN, .revents = 0}}};
    WaitReadable(fds, now, std::min(until, now + std::chrono::milliseconds(5)));
  }
  if (agent_ != nullptr) agent_->Close(kAgentFarewell);
}

}  // namespace tessera::worker

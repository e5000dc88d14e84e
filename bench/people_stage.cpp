#include "bench/people_stage.h"

#include <fmt/format.h>
#include <pthread.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "bench/statistics.h"
#include "core/world/bytes.h"
#include "gateway/viewer_format.h"
#include "host/files.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kPatience = 30s;
constexpr auto kSettling = 5s;
constexpr std::chrono::nanoseconds kPoll{16'666'667};  // as the gateway polls
// Several viewers share a thread, which looks at each so often; one alone is waited for.
constexpr auto kLookAgain = 2ms, kWait = 5ms;
// Reading less than this at once would measure system calls.
constexpr double kLeastRead_bytes = 1024;

double Seconds(const timespec& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) * 1e-9;
}

double ClockSeconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return Seconds(now);
}

}  // namespace

double ProcessCpuSeconds(pid_t pid) {
  clockid_t clock{};
  if (clock_getcpuclockid(pid, &clock) != 0) throw local::CommandError(fmt::format("process {} has ended", pid));
  return ClockSeconds(clock);
}

double ResidentBytes(pid_t pid) {
  std::ifstream statm(fmt::format("/proc/{}/statm", pid));
  double all = 0, resident = 0;
  if (!(statm >> all >> resident)) throw local::CommandError(fmt::format("process {} has ended", pid));
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

local::RunOptions PlazaOptions(std::uint32_t bodies) {
  return {.scene = local::FindScene("plaza"), .regions = 1, .bodies = bodies, .bots = 0};
}

void SettlePlaza(local::WorldRun& run) {
  std::this_thread::sleep_for(kSettling);
  RequireRunning(run);
}

void RequireRunning(local::WorldRun& run) {
  if (!run.Frame()) throw local::CommandError("the world ended: " + run.WhyOver());
}

void AddSpread(Report& report, const std::string& scene, const std::string& config, const std::string& metric,
               const std::vector<double>& values, const std::string& unit) {
  report.Add(scene, kPeopleEngine, config, metric, Median(values), unit);
  report.Add(scene, kPeopleEngine, config, metric + "_p10", Quantile(values, 0.1), unit);
  report.Add(scene, kPeopleEngine, config, metric + "_p90", Quantile(values, 0.9), unit);
}

// --- The gateway -----------------------------------------------------------------------------------------------------

GatewayProcess::GatewayProcess(const std::string& control_address) {
  const std::string ready = folder_.path() + "/ready.json";
  process_ = local::OrThrow(host::ChildProcess::Start(
      {.argv = {local::ProgramPath("tessera-gateway"), "--control", control_address, "--listen", "127.0.0.1:0",
                "--metrics-listen", "127.0.0.1:0", "--ready-file", ready},
       .log_path = folder_.path() + "/log"}));
  if (!process_->WaitForFile(ready, kPatience)) throw local::CommandError("tessera-gateway did not become ready");
  address_ = nlohmann::json::parse(local::OrThrow(host::ReadFile(ready, 4096))).at("http").get<std::string>();
}

// --- The SDK's client ------------------------------------------------------------------------------------------------

SdkViewer::SdkViewer(const std::string& control_address, const std::string& instance, Options options)
    : options_(std::move(options)),
      client_(local::OrThrow(client::Client::Join(
          {.control_address = control_address, .instance_id = instance, .player_name = "", .watch = true}))),
      thread_([this] { Run(); }) {}

SdkViewer::~SdkViewer() {
  stop_ = true;
  thread_.join();
}

void SdkViewer::Run() {
  auto next = Clock::now();
  for (int polls = 1; !stop_; ++polls) {
    next = std::max(next + kPoll, Clock::now());
    std::this_thread::sleep_until(next);
    const std::lock_guard lock(mutex_);
    const auto now = Clock::now();
    client_->Poll(now);
    ended_ = client_->state() == client::ClientState::kEnded;
    if (ended_) return;
    if (polls % options_.polls_a_read != 0) continue;
    const std::vector<client::ShownBody> shown = client_->Interpolated(now);
    if (options_.on_read) options_.on_read(*client_, shown, now);
  }
}

double SdkViewer::cpu_s() const {
  clockid_t clock{};
  pthread_getcpuclockid(const_cast<std::thread&>(thread_).native_handle(), &clock);
  return ClockSeconds(clock);
}

client::ClientStats SdkViewer::Stats() const {
  const std::lock_guard lock(mutex_);
  if (ended_) throw local::CommandError("the SDK client ended: " + std::string(client_->reason().message()));
  return client_->Stats();
}

// --- Viewers ---------------------------------------------------------------------------------------------------------

Viewers::Viewers(const std::string& address, const std::string& instance, std::size_t count, int receive_buffer_bytes) {
  for (std::size_t i = 0; i < count; ++i) {
    auto viewer = std::make_unique<Viewer>();
    viewer->socket = std::make_unique<gateway::ViewerSocket>(
        address, instance,
        gateway::ViewerSocket::Options{
            .receive_buffer_bytes = receive_buffer_bytes,
            .on_binary = [read = &viewer->read](std::span<const std::uint8_t> message) { Count(message, *read); }});
    viewers_.push_back(std::move(viewer));
  }
  thread_ = std::thread([this] { Run(); });
}

Viewers::~Viewers() {
  stop_ = true;
  thread_.join();
}

void Viewers::Count(std::span<const std::uint8_t> message, Tally& tally) {
  ByteReader in(message);
  if (in.U8() != static_cast<std::uint8_t>(gateway::MessageKind::kFrame)) return;
  in.Varint();  // the tick
  const double taken_at_s = in.F64();
  ++tally.frames;
  tally.delay_sum_s += std::chrono::duration<double>(Clock::now().time_since_epoch()).count() - taken_at_s;
}

void Viewers::Run() {
  auto before = Clock::now();
  while (!stop_) {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - std::exchange(before, now)).count();
    for (const auto& viewer : viewers_) Read(*viewer, seconds);
    if (viewers_.size() > 1) std::this_thread::sleep_for(kLookAgain);
  }
}

void Viewers::Read(Viewer& viewer, double seconds) {
  const auto wait = viewers_.size() > 1 ? 0ms : kWait;
  const double rate = bytes_per_s_;
  std::size_t got = 0;
  if (rate == 0) {
    viewer.allowance = 0;
    got = viewer.socket->Take(wait);
  } else {
    viewer.allowance = std::min(viewer.allowance + rate * seconds, rate);
    if (viewer.allowance < kLeastRead_bytes) return;
    got = viewer.socket->Take(wait, static_cast<std::size_t>(viewer.allowance));
    viewer.allowance -= static_cast<double>(got);
  }
  viewer.read.bytes += got;
  const std::lock_guard lock(mutex_);
  viewer.tally = viewer.read;
  viewer.closed = viewer.socket->closed;
}

void Viewers::AwaitFrames() {
  const auto deadline = Clock::now() + kPatience;
  const auto all_have = [this] {
    const std::lock_guard lock(mutex_);
    return std::ranges::all_of(viewers_, [](const auto& viewer) { return viewer->tally.frames > 0; });
  };
  while (!all_have()) {
    if (Clock::now() > deadline) throw local::CommandError("a viewer was sent no frame");
    std::this_thread::sleep_for(kWait);
  }
}

void Viewers::Send(const nlohmann::json& message) {
  for (const auto& viewer : viewers_) viewer->socket->Send(message);  // which reading does not touch
}

Viewers::Tally Viewers::Sum() const {
  const std::lock_guard lock(mutex_);
  Tally sum;
  for (const auto& viewer : viewers_) {
    if (viewer->closed) throw local::CommandError("the gateway closed a viewer: " + *viewer->closed);
    sum.frames += viewer->tally.frames;
    sum.bytes += viewer->tally.bytes;
    sum.delay_sum_s += viewer->tally.delay_sum_s;
  }
  return sum;
}

}  // namespace tessera::bench

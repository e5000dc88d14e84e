#include "bench/lasting_witness.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "bench/scrape.h"
#include "core/world/partition_io.h"
#include "local_cluster/bot.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

// Between two of a witness's looks; a call that is not answered in time counts as not answered.
constexpr auto kChangePause = 100ms, kClaimPause = 200ms, kReadPause = 100ms, kWritesPause = 300ms, kFrame = 16ms;
constexpr auto kChangeDeadline = 1500ms, kClaimDeadline = 1500ms, kScrapeDeadline = 400ms;
// So many hosts stand besides those of the world, which the changes add and remove.
constexpr std::uint64_t kStanding = 10;

void SetDeadline(grpc::ClientContext& context, std::chrono::milliseconds span) {
  context.set_deadline(std::chrono::system_clock::now() + span);
}

// The page of a program at this port of loopback; empty: it does not answer in time. A program that stands still
// answers nobody, and nobody may wait for it.
std::string PageOf(std::uint16_t port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return "";
  const timeval patience{.tv_sec = 0, .tv_usec = std::chrono::microseconds(kScrapeDeadline).count()};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(port);
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  constexpr std::string_view kRequest = "GET /metrics HTTP/1.0\r\nHost: localhost\r\n\r\n";
  std::string page;
  bool whole = false;
  if (connect(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 &&
      send(fd, kRequest.data(), kRequest.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(kRequest.size())) {
    char part[16384];
    ssize_t came = 0;
    while ((came = recv(fd, part, sizeof part, 0)) > 0) page.append(part, static_cast<std::size_t>(came));
    whole = came == 0;
  }
  close(fd);
  return whole ? page : "";
}

// Each write of a leader writes this key.
etcdserverpb::RangeRequest HeadOfStore() {
  etcdserverpb::RangeRequest request;
  request.set_key(absl::StrCat(LastingStage::prefix(), "/head"));
  return request;
}

// Those of the map in force, as far as it is said who runs them.
std::vector<Border> BordersOf(const v1::Instance& world) {
  std::map<std::uint32_t, std::string> hosts;
  for (const v1::RegionStatus& status : world.region_status()) hosts[status.region()] = status.host();
  std::vector<Border> borders;
  const auto map = FromProto(world.map());
  if (!map.ok()) return borders;
  for (const MapRegion& region : map->regions()) {
    const std::uint32_t one = region.id.value();
    for (const RegionId neighbor : map->Neighbors(region.id)) {
      const std::uint32_t other = neighbor.value();
      if (one > other || hosts[one].empty() || hosts[other].empty()) continue;
      borders.push_back({.one = one, .other = other, .host_of_one = hosts[one], .host_of_other = hosts[other]});
    }
  }
  return borders;
}

}  // namespace

// One for each witness, for as long as it lives: whoever leads is found by the channel.
struct LastingWitnesses::Channels {
  std::unique_ptr<v1::HostService::Stub> changes, asked_at_the_end;
  std::unique_ptr<v1::InstanceService::Stub> world;
};

LastingWitnesses::LastingWitnesses(const LastingStage& stage, std::string instance)
    : stage_(stage),
      instance_(std::move(instance)),
      begin_(std::chrono::steady_clock::now()),
      channels_(std::make_unique<Channels>()) {}

absl::StatusOr<std::unique_ptr<LastingWitnesses>> LastingWitnesses::Begin(const LastingStage& stage,
                                                                          const std::string& instance,
                                                                          std::uint32_t players) {
  std::unique_ptr<LastingWitnesses> result(new LastingWitnesses(stage, instance));
  LastingWitnesses& self = *result;
  for (auto* hosts : {&self.channels_->changes, &self.channels_->asked_at_the_end}) {
    const auto channel = trust::Dial(stage.control().address, stage.control().credentials);
    if (!channel.ok()) return channel.status();
    *hosts = v1::HostService::NewStub(*channel);
  }
  const auto channel = trust::Dial(stage.control().address, stage.control().credentials);
  if (!channel.ok()) return channel.status();
  self.channels_->world = v1::InstanceService::NewStub(*channel);
  self.threads_.emplace_back([&self] { self.MakeChanges(); });
  self.threads_.emplace_back([&self] { self.AskForTheWorld(); });
  self.threads_.emplace_back([&self] { self.Doze(); });
  if (stage.etcd() != nullptr) self.threads_.emplace_back([&self] { self.FollowWrites(); });
  for (std::uint32_t i = 0; i < kLastingHosts; ++i) self.threads_.emplace_back([&self, i] { self.ReadWorkers(i); });
  self.LetPlay(players);
  return result;
}

void LastingWitnesses::LetPlay(std::uint32_t players) {
  for (std::uint32_t i = 0; i < players; ++i) {
    threads_.emplace_back([this, number = ++players_] { Play(number); });
  }
}

LastingWitnesses::~LastingWitnesses() { (void)End(); }

double LastingWitnesses::Now() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

History LastingWitnesses::End() {
  ended_ = true;
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  const std::lock_guard lock(mutex_);
  history_.until = Now();
  return history_;
}

// --- Changes.

bool LastingWitnesses::MakeChange(const std::string& name, bool add) {
  ChangeRecord record{.name = name, .added = add, .asked = Now()};
  grpc::ClientContext context;
  SetDeadline(context, kChangeDeadline);
  grpc::Status status;
  if (add) {
    v1::AddHostRequest request;
    request.set_name(name);
    v1::AddHostResponse response;
    status = channels_->changes->AddHost(&context, request, &response);
  } else {
    v1::RemoveHostRequest request;
    request.set_name(name);
    v1::RemoveHostResponse response;
    status = channels_->changes->RemoveHost(&context, request, &response);
  }
  record.acknowledged = status.ok();
  record.answered = Now();
  const std::lock_guard lock(mutex_);
  history_.changes.push_back(record);
  return status.ok();
}

void LastingWitnesses::MakeChanges() {
  std::vector<std::string> standing;
  for (std::uint64_t number = 1; !ended_; ++number) {
    const std::string name = absl::StrCat("w-", number);
    if (MakeChange(name, true)) standing.push_back(name);
    if (standing.size() > kStanding) {
      MakeChange(standing.front(), false);
      standing.erase(standing.begin());
    }
    std::this_thread::sleep_for(kChangePause);
  }
}

absl::StatusOr<std::set<std::string>> LastingWitnesses::KnownHosts() const {
  grpc::ClientContext context;
  SetDeadline(context, 10s);
  context.set_wait_for_ready(true);  // it was not used before, and its first attempt may fall into the last fault
  v1::ListHostsResponse response;
  const grpc::Status status = channels_->asked_at_the_end->ListHosts(&context, {}, &response);
  if (!status.ok()) return absl::UnavailableError(status.error_message());
  std::set<std::string> names;
  for (const v1::Host& host : response.hosts()) names.insert(host.name());
  return names;
}

std::optional<double> LastingWitnesses::AcknowledgedAfter(double since, std::chrono::seconds patience) {
  std::optional<double> at;
  WaitFor(
      [&] {
        const std::lock_guard lock(mutex_);
        const auto found = std::ranges::find_if(
            history_.changes, [&](const ChangeRecord& change) { return change.acknowledged && change.asked >= since; });
        if (found != history_.changes.end()) at = found->answered;
        return at.has_value();
      },
      patience);
  return at;
}

// --- What is said of the world.

void LastingWitnesses::AskForTheWorld() {
  while (!ended_) {
    const double asked = Now();
    grpc::ClientContext context;
    SetDeadline(context, kClaimDeadline);
    v1::GetInstanceRequest request;
    request.set_id(instance_);
    v1::GetInstanceResponse response;
    if (channels_->world->GetInstance(&context, request, &response).ok()) {
      const v1::Instance& world = response.instance();
      ClaimRecord claim{.asked = asked,
                        .running = world.state() == v1::INSTANCE_STATE_RUNNING,
                        .degraded = world.state() == v1::INSTANCE_STATE_DEGRADED,
                        .reason = world.reason(),
                        .map = world.map().version(),
                        .borders = BordersOf(world)};
      for (const auto& region : world.map().regions()) claim.regions.push_back(region.id());
      const std::lock_guard lock(mutex_);
      history_.claims.push_back(std::move(claim));
      latest_ = world;
      latest_asked_ = asked;
    } else {
      // Nobody said anything: neither true nor false.
      const std::lock_guard lock(mutex_);
      history_.claims.push_back({.asked = asked, .reason = {}});
    }
    std::this_thread::sleep_for(kClaimPause);
  }
}

std::vector<Border> LastingWitnesses::Borders() const {
  const std::lock_guard lock(mutex_);
  return latest_ ? BordersOf(*latest_) : std::vector<Border>();
}

std::optional<v1::Instance> LastingWitnesses::LatestAfter(double since) const {
  const std::lock_guard lock(mutex_);
  return latest_asked_ >= since ? latest_ : std::nullopt;
}

// --- What workers do.

void LastingWitnesses::ReadWorkers(std::uint32_t host) {
  if (!stage_.network().EnterThread(LastingStage::MachineOf(host)).ok()) return;
  const std::string wanted = instance_ + "/";
  while (!ended_) {
    for (const LastingStage::Worker& worker : stage_.WorkersOn(host)) {
      if (!worker.name.starts_with(wanted)) continue;
      const std::string page = PageOf(worker.metrics_port);
      if (page.empty()) continue;
      // Another one may have taken the port meanwhile.
      const auto still = stage_.WorkersOn(host);
      if (std::ranges::none_of(still, [&](const auto& one) {
            return one.name == worker.name && one.pid == worker.pid && one.metrics_port == worker.metrics_port;
          })) {
        continue;
      }
      const Samples samples = ParseMetrics(page);
      const auto value = [&](const char* name) {
        const auto found = samples.find(name);
        return found == samples.end() ? std::uint64_t{0} : static_cast<std::uint64_t>(found->second);
      };
      const std::lock_guard lock(mutex_);
      history_.steps.push_back({.worker = worker.name,
                                .region = worker.region,
                                .at = Now(),
                                .steps = value("tessera_region_ticks_total"),
                                .tick = value("tessera_region_tick"),
                                .map = value("tessera_region_map_version")});
    }
    std::this_thread::sleep_for(kReadPause);
  }
}

std::optional<double> LastingWitnesses::SteppedAfter(double since, std::uint64_t map, std::chrono::seconds patience) {
  std::optional<double> at;
  WaitFor(
      [&] {
        const std::lock_guard lock(mutex_);
        at = AllStepped(history_, since, map);
        return at.has_value();
      },
      patience);
  return at;
}

void LastingWitnesses::Play(std::uint32_t number) {
  auto joined = local::Bot::Join(stage_.players(), instance_, absl::StrCat("player-", number), number);
  if (!joined.ok()) return Drop(number, joined.status());
  const std::unique_ptr<local::Bot> bot = *std::move(joined);
  bool out = false;
  while (!ended_) {
    if (!bot->Frame(client::Clock::now())) {
      if (!out) Drop(number, bot->client().reason());
      out = !bot->ComeBack().ok();
    }
    std::this_thread::sleep_for(kFrame);
  }
}

void LastingWitnesses::Drop(std::uint32_t number, const absl::Status& why) {
  const double at = Now();
  const std::lock_guard lock(mutex_);
  dropped_.push_back(fmt::format("player {} was dropped at {:.1f} s: {}", number, at, why.ToString()));
}

std::vector<std::string> LastingWitnesses::PlayersDropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

// --- Who wrote.

// From the newest write back to the last that is known: etcd has what every key was at each revision.
void LastingWitnesses::FollowWrites() {
  std::int64_t known = 0;
  bool last_round = false;
  while (!last_round) {
    last_round = ended_;
    std::vector<WriteRecord> found;
    etcdserverpb::RangeRequest request = HeadOfStore();
    bool whole = false;
    while (!whole) {
      const auto head = stage_.etcd()->Range(request, 3s);
      if (!head.ok() || head->kvs_size() == 0) break;
      const std::int64_t revision = head->kvs(0).mod_revision();
      whole = revision <= known;
      if (whole) break;
      // "tessera 1 TOKEN-NUMBER"
      const std::vector<std::string> words = absl::StrSplit(head->kvs(0).value(), absl::ByAnyChar(" -"));
      WriteRecord write{.revision = revision};
      if (words.size() == 4 && absl::SimpleAtoi(words[2], &write.token)) found.push_back(write);
      if (head->kvs(0).version() == 1) whole = true;
      request.set_revision(revision - 1);
    }
    if (whole && !found.empty()) {
      known = found.front().revision;
      const std::lock_guard lock(mutex_);
      history_.writes.insert(history_.writes.end(), found.rbegin(), found.rend());
      written_up_to_ = known;
    }
    if (!last_round) std::this_thread::sleep_for(kWritesPause);
  }
}

absl::Status LastingWitnesses::AwaitWrites(std::chrono::seconds patience) {
  const auto head = stage_.etcd()->Range(HeadOfStore(), patience);
  if (!head.ok()) return head.status();
  const std::int64_t newest = head->kvs_size() == 0 ? 0 : head->kvs(0).mod_revision();
  const auto written = [&] {
    const std::lock_guard lock(mutex_);
    return written_up_to_ >= newest;
  };
  if (WaitFor(written, patience)) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("nobody has written down the store's revision ", newest));
}

// --- How late witnesses are, on a machine that is busy.

void LastingWitnesses::Doze() {
  while (!ended_) {
    const double slept = Now();
    std::this_thread::sleep_for(kReadPause);
    const double late = Now() - slept - std::chrono::duration<double>(kReadPause).count();
    const std::lock_guard lock(mutex_);
    history_.late_s = std::max(history_.late_s, late);
  }
}

bool LastingWitnesses::WaitFor(const std::function<bool()>& holds, std::chrono::seconds patience) const {
  const auto until = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(20ms);
  }
  return true;
}

}  // namespace tessera::bench

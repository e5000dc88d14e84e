// Hosts that are put out of a cluster, and clocks that do not agree, under a world that spans two hosts.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client_sdk/control_session.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/bot.h"
#include "local_cluster/command_error.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/trust_fixture.h"
#include "tests/support/attack_calls.h"
#include "tests/support/knocks.h"
#include "tests/support/recording_relay.h"
#include "tests/support/region_keys.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Answer = support::Knocked::Answer;

// Players on a thread of their own, for as long as it lives.
class Players {
 public:
  explicit Players(std::vector<std::unique_ptr<local::Bot>> bots)
      : bots_(std::move(bots)), thread_([this] { Play(); }) {}
  ~Players() { Stop(); }
  Players(const Players&) = delete;
  Players& operator=(const Players&) = delete;
  // Those whose client has ended since.
  int Stop() {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
    return ended_;
  }

 private:
  void Play() {
    while (!stopped_) {
      ended_ = 0;
      for (const auto& bot : bots_) ended_ += bot->Frame(std::chrono::steady_clock::now()) ? 0 : 1;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));  // the pace of a game's frames; nobody waits by it
    }
  }

  const std::vector<std::unique_ptr<local::Bot>> bots_;
  std::atomic<bool> stopped_ = false;
  int ended_ = 0;
  std::thread thread_;
};

class TwoHostsTest : public TrustTest {
 protected:
  static constexpr int kPlayers = 2;

  void CreateWorld() {
    const support::RunResult running = Tessera({"instance", "create", "--scene", support::ScenePath("plaza"),
                                                "--bodies", "50", "--regions", "4", "--guests", "on", "--wait"});
    ASSERT_EQ(running.exit_code, 0) << running.err;
    ASSERT_EQ(WorkersOf("alpha").size(), 2u) << "its regions are on both";
    ASSERT_EQ(WorkersOf("beta").size(), 2u);
  }
  std::unique_ptr<Players> Join(int count) const {
    std::vector<std::unique_ptr<local::Bot>> bots;
    for (int i = 0; i < count; ++i) {
      auto bot = local::Bot::Join(players_ + "#" + fingerprint_, "inst-1", fmt::format("bot-{}", i), i + 1);
      EXPECT_TRUE(bot.ok()) << bot.status();
      if (bot.ok()) bots.push_back(*std::move(bot));
    }
    return std::make_unique<Players>(std::move(bots));
  }
  static nlohmann::json World() {
    const support::RunResult shown = Tessera({"-o", "json", "instance", "describe", "inst-1"});
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
    return nlohmann::json::parse(shown.out);
  }
  static std::vector<pid_t> WorkersOf(const std::string& host) {
    std::vector<pid_t> pids;
    const support::RunResult shown = Tessera({"-o", "json", "host", "describe", host});
    EXPECT_EQ(shown.exit_code, 0) << shown.err;
    const nlohmann::json described = nlohmann::json::parse(shown.out);
    for (const nlohmann::json& worker : described["workers"]) {
      pids.push_back(static_cast<pid_t>(std::stoll(worker["identity"]["pid"].get<std::string>())));
    }
    return pids;
  }
  // In all regions; while a body changes hands it may be counted twice, or not at all. One that is carried on has no
  // report before its new worker has sent one.
  static int Owned(const nlohmann::json& world) {
    int owned = 0;
    for (const nlohmann::json& region : world.at("region_status")) {
      owned += std::stoi(region.value("report", nlohmann::json::object()).value("owned", std::string("0")));
    }
    return owned;
  }
  // Until it is told three times in a row.
  static int SettledOwned() {
    int owned = Owned(World());
    for (int same = 0; same < 3;) {
      const int now = Owned(World());
      same = now == owned ? same + 1 : 0;
      owned = now;
    }
    return owned;
  }
  static bool Await(const std::function<bool()>& reached) {
    const auto patience_ends = std::chrono::steady_clock::now() + kPatience;
    while (!reached()) {
      if (std::chrono::steady_clock::now() >= patience_ends) return false;
    }
    return true;
  }
};

// One whose agent does not obey: it stands still, and its workers run on as long as they are let.
TEST_F(TwoHostsTest, AHostThatIsEvictedIsCutOffAndPlayersPlayOn) {
  ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
  ASSERT_TRUE(StartSecondAgent(JoinToken("beta"))) << host::LastLinesText(folder_.path() + "/second.log", 5);
  CreateWorld();
  const int bodies = SettledOwned() + kPlayers;
  const auto players = Join(kPlayers);
  ASSERT_TRUE(Await([&] { return Owned(World()) == bodies; }));
  const std::string kept = folder_.path() + "/kept";  // for one who recorded it
  std::filesystem::create_directory(kept);
  std::filesystem::copy_file(folder_.path() + "/agent/host.json", kept + "/host.json");
  agent_->Signal(SIGSTOP);

  const auto begin = std::chrono::steady_clock::now();
  const support::RunResult removed = Tessera({"host", "remove", "alpha", "--force"});
  ASSERT_EQ(removed.exit_code, 0) << removed.err;
  const support::RunResult thief = support::RunProgram(
      "tessera-agent", {"--control", operators_, "--state-dir", kept, "--metrics-listen", "127.0.0.1:0"});
  EXPECT_EQ(thief.exit_code, 1);
  EXPECT_THAT(thief.out + thief.err, HasSubstr("host-1 was removed"));
  EXPECT_TRUE(Await([] {
    const nlohmann::json world = World();
    return world.at("state") == "INSTANCE_STATE_RUNNING" && world.at("regions") == 4 &&
           world.value("failovers", 0) >= 1;
  })) << World().dump(2);
  std::printf("carried on after %.1f s\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  EXPECT_TRUE(Await([&] { return Owned(World()) == bodies; })) << "none is lost: " << World().dump(2);
  EXPECT_EQ(WorkersOf("beta").size(), 4u);
  EXPECT_EQ(players->Stop(), 0) << "no player's client has ended";

  // Its agent hears of it as soon as it hears anything.
  agent_->Signal(SIGCONT);
  const auto ended = agent_->Wait(kPatience);
  ASSERT_TRUE(ended.has_value()) << host::LastLinesText(AgentLog(), 5);
  EXPECT_THAT(*host::ReadFile(AgentLog(), kMaxFileBytes), HasSubstr("host-1 was removed"));
  EXPECT_EQ(World().at("players"), kPlayers);
}

// All that root of a host has, which it may keep when the host is put out: its identity, the keys in the memory of its
// workers, recordings of what went by, and processes that run on while their agent stands still.
class EvictedHostTest : public TwoHostsTest {
 protected:
  void SetUp() override {
    TwoHostsTest::SetUp();
    ASSERT_TRUE(StartAgent(JoinToken("alpha"))) << host::LastLinesText(AgentLog(), 5);
    ASSERT_TRUE(StartSecondAgent(JoinToken("beta"))) << host::LastLinesText(folder_.path() + "/second.log", 5);
    CreateWorld();
    before_ = Described();
    evicted_ = before_.region_status(0).host();  // its region has the lowest id, so it dials all others
    identity_ =
        *host::ReadFile(folder_.path() + (evicted_ == "alpha" ? "/agent" : "/second") + "/host.json", kMaxFileBytes);
    const net::VerificationKey instance_key = support::InstanceKeyOf(socket_, "inst-1");
    for (const v1::RegionStatus& status : before_.region_status()) {
      if (status.host() != evicted_) continue;
      auto taken = support::TakeRegionKeys(status.report(), instance_key);
      if (absl::IsPermissionDenied(taken.status())) GTEST_SKIP() << taken.status();
      ASSERT_TRUE(taken.ok()) << taken.status();
      keys_.push_back(*std::move(taken));
    }
    ASSERT_EQ(keys_.size(), 2u);
  }

  v1::Instance Described() const {
    support::Target target;
    target.socket = socket_;
    return support::GetInstance(target, "inst-1");
  }
  support::Regions Elsewhere() const {
    const v1::Instance now = Described();
    support::Regions regions;
    for (const v1::RegionStatus& status : now.region_status()) {
      if (status.host() != evicted_ && status.report().has_address()) *regions.Add() = status;
    }
    return regions;
  }
  host::ChildProcess& Agent() { return evicted_ == "alpha" ? *agent_ : *second_agent_; }
  // By the identity that was kept.
  absl::Status Fetch() const { return support::FetchSceneByIdentity(operators_, identity_, before_.scene_hash()); }
  // The grant of a guest that has just joined.
  client::Session GuestsGrant(const std::string& name) const {
    client::JoinCall join{.instance_id = "inst-1", .player_name = name, .ticket = {}, .returning = {}};
    join.deadline = kPatience;
    return local::OrThrow(client::JoinInstance(players_ + "#" + fingerprint_, join));
  }
  // A line for each of those that got in.
  static std::vector<std::string> Opened(const std::vector<support::Knock>& knocks) {
    std::vector<std::string> opened;
    for (const support::Knocked& knocked : support::KnockAll(knocks)) {
      if (knocked.answer == Answer::kOpened) opened.push_back(knocked.said);
    }
    return opened;
  }
  static double Ticks(const v1::RegionStatus& status) {
    const v1::RegionAddress& address = status.report().address();
    const auto page = telemetry::HttpGet(fmt::format("{}:{}", address.host(), address.metrics_port()), "/metrics");
    EXPECT_TRUE(page.ok()) << page.status();
    const std::string name = "\ntessera_region_ticks_total ";
    const std::size_t at = page.ok() ? page->body.find(name) : std::string::npos;
    return at == std::string::npos ? -1 : std::stod(page->body.substr(at + name.size()));
  }
  // Until nothing that was kept opens a link, nor the door, twice in a row.
  void Evict() {
    Agent().Signal(SIGSTOP);
    const auto begin = std::chrono::steady_clock::now();
    const support::RunResult removed = Tessera({"host", "remove", evicted_, "--force"});
    ASSERT_EQ(removed.exit_code, 0) << removed.err;
    const auto opens = [this] { return Fetch().ok() || !Opened(support::LinkKnocks(keys_, Elsewhere())).empty(); };
    ASSERT_TRUE(Await([&] { return !opens() && !opens(); }));
    std::printf("nothing opens after %.1f s\n",
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    ASSERT_TRUE(Await([] {
      const nlohmann::json world = World();
      return world.at("state") == "INSTANCE_STATE_RUNNING" && world.at("regions") == 4 &&
             world.value("failovers", 0) >= 1;
    })) << World().dump(2);
    // The map has all four again a moment after they run; who joins before is told fewer.
    ASSERT_TRUE(Await([this] { return Elsewhere().size() == 4 && Described().map().regions_size() == 4; }));
  }

  v1::Instance before_;
  std::string evicted_, identity_;
  std::vector<support::RegionKeys> keys_;
};

TEST_F(EvictedHostTest, ItsKeysAndRecordingsOpenNothing) {
  EXPECT_TRUE(Fetch().ok()) << Fetch();
  const support::Regions neighbours = Elsewhere();
  ASSERT_EQ(neighbours.size(), 2);
  EXPECT_FALSE(Opened(support::LinkKnocks(keys_, neighbours)).empty()) << "they are good as long as it is a host";
  for (const support::Knocked& knocked : support::KnockAll(support::ForgedKnocks(keys_, neighbours), kPatience)) {
    EXPECT_EQ(knocked.by_acceptor, net::Refused::kBadCredential) << "and make nobody else: " << knocked.said;
  }

  // It records traffic as long as it is a host: a link of its own, and a player at a region that stays.
  const v1::RegionStatus& neighbour = neighbours.Get(1);
  support::RecordingRelay at_links(static_cast<std::uint16_t>(neighbour.report().address().link_port()));
  support::RecordingRelay at_game(static_cast<std::uint16_t>(neighbour.report().address().game_port()));
  std::vector<support::Knock> recorded = support::LinkKnocks({keys_.front()}, neighbours);
  recorded.erase(recorded.begin(), recorded.end() - 1);
  recorded.front().port = at_links.port();
  recorded.push_back({.host = "127.0.0.1",
                      .port = at_game.port(),
                      .region = RegionId(neighbour.region()),
                      .credentials = GuestsGrant("ada").credentials});
  // A worker that dials with the same key at the same moment ends the other's handshake.
  for (const support::Knock& knock : recorded) EXPECT_TRUE(Await([&] { return !Opened({knock}).empty(); }));
  at_links.Stop();
  at_game.Stop();
  ASSERT_NO_FATAL_FAILURE(Evict());

  EXPECT_THAT(std::string(Fetch().message()), HasSubstr("was removed"));
  const std::vector<support::Knock> links = support::LinkKnocks(keys_, Elsewhere());
  for (const support::Knocked& knocked : support::KnockAll(links, kPatience)) {
    EXPECT_EQ(knocked.answer, Answer::kRefused) << knocked.said;
  }
  for (const support::Knocked& knocked : support::KnockAll(support::ForgedKnocks(keys_, Elsewhere()), kPatience)) {
    EXPECT_EQ(knocked.by_acceptor, net::Refused::kBadCredential) << knocked.said;
  }
  for (const support::RecordingRelay* relay : {&at_links, &at_game}) {
    const support::RecordingRelay::Replayed replayed = relay->Replay();
    EXPECT_GT(replayed.logins, 0);
    EXPECT_GT(replayed.sealed, 0);
    EXPECT_TRUE(replayed.answered) << "the region is there";
    EXPECT_FALSE(replayed.opened);
  }
}

TEST_F(EvictedHostTest, ItsWorkersServeNobodyAndEndWithTheirAgent) {
  ASSERT_NO_FATAL_FAILURE(Evict());
  std::vector<v1::RegionStatus> left;  // processes that run on
  for (const v1::RegionStatus& status : before_.region_status()) {
    if (status.host() == evicted_) left.push_back(status);
  }
  // Nobody is sent to them, and who knows of a newer life takes none of theirs.
  const client::Session later = GuestsGrant("bob");
  ASSERT_EQ(later.regions.size(), 4u);
  std::vector<support::Knock> old;
  for (const v1::RegionStatus& status : left) {
    const v1::RegionAddress& address = status.report().address();
    for (const client::RegionEndpoint& granted : later.regions) {
      EXPECT_NE(granted.port, address.game_port());
      if (granted.region != RegionId(status.region())) continue;
      EXPECT_GT(granted.incarnation, Incarnation(status.report().identity().incarnation()));
      old.push_back({.host = address.host(),
                     .port = static_cast<std::uint16_t>(address.game_port()),
                     .region = granted.region,
                     .least = granted.incarnation,
                     .credentials = later.credentials});
    }
  }
  ASSERT_EQ(old.size(), 2u);
  EXPECT_THAT(Opened(old), IsEmpty());

  // They have no lease and no neighbours, so they stand still while the world goes on.
  const support::Regions elsewhere = Elsewhere();
  std::vector<double> stood;
  stood.reserve(left.size());
  for (const v1::RegionStatus& status : left) stood.push_back(Ticks(status));
  const double begin = Ticks(elsewhere.Get(0));
  EXPECT_TRUE(Await([&] { return Ticks(elsewhere.Get(0)) >= begin + 60; }));
  for (std::size_t i = 0; i < left.size(); ++i) {
    EXPECT_EQ(Ticks(left[i]), stood[i]);
    EXPECT_GT(stood[i], 0) << "it was there, and made ticks before";
  }

  // Their agent hears of it as soon as it hears anything, and ends them.
  Agent().Signal(SIGCONT);
  ASSERT_TRUE(Agent().Wait(kPatience).has_value());
  for (const v1::RegionStatus& status : left) {
    EXPECT_TRUE(Await([&] { return kill(static_cast<pid_t>(status.report().identity().pid()), 0) != 0; }));
  }
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // a sanitizer wants to be the first library
// One clock is 400 days ahead and the other 400 behind: links, leases, standbys and a failover between the two.
TEST_F(TwoHostsTest, HostsWhoseClocksAre800DaysApartCarryOneWorld) {
  setenv("LD_PRELOAD", TESSERA_BINARY_DIR "/tests/shifted_clock.so", 1);
  setenv("TESSERA_CLOCK_SHIFT_S", "34560000", 1);
  const bool alpha = StartAgent(JoinToken("alpha"));
  setenv("TESSERA_CLOCK_SHIFT_S", "-34560000", 1);
  const bool beta = StartSecondAgent(JoinToken("beta"));
  unsetenv("LD_PRELOAD");
  ASSERT_TRUE(alpha) << host::LastLinesText(AgentLog(), 5);
  ASSERT_TRUE(beta) << host::LastLinesText(folder_.path() + "/second.log", 5);
  CreateWorld();
  const int bodies = SettledOwned() + kPlayers;
  const auto players = Join(kPlayers);
  ASSERT_TRUE(Await([&] { return Owned(World()) == bodies; }));
  ASSERT_EQ(kill(WorkersOf("alpha").front(), SIGKILL), 0);
  EXPECT_TRUE(Await([&] {
    const nlohmann::json world = World();
    return world.value("failovers", 0) == 1 && world.at("state") == "INSTANCE_STATE_RUNNING" && Owned(world) == bodies;
  })) << World().dump(2);
  EXPECT_EQ(players->Stop(), 0) << "no player's client has ended";
}
#endif

}  // namespace
}  // namespace tessera::end_to_end

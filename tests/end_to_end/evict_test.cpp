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
#include <thread>

#include "host/files.h"
#include "host/last_lines.h"
#include "local_cluster/bot.h"
#include "tests/end_to_end/trust_fixture.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using ::testing::HasSubstr;

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

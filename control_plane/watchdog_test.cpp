// A control plane that stands still: /healthz says so, and systemd's watchdog hears nothing more.
#include "control_plane/watchdog.h"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <future>
#include <string>
#include <thread>

#include "control_plane/memory_store.h"
#include "control_plane/secrets.h"
#include "host/temporary_folder.h"
#include "prometheus/registry.h"
#include "telemetry/http_get.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::seconds kWatchdogTestPatience{30};

// A write never ends while it is held: the disk below hangs.
class HangingStore final : public Store {
 public:
  absl::StatusOr<StoreEntry> Get(std::string_view key) const override { return store_.Get(key); }
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix,
                                                      std::string_view without) const override {
    return store_.ListWithout(prefix, without);
  }
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override {
    held.wait(true);
    return store_.Txn(ops);
  }
  Revision revision() const override { return store_.revision(); }

  std::atomic<bool> held{false};

 private:
  MemoryStore store_;
};

class WatchdogTest : public ::testing::Test {
 protected:
  // A timer that is slower than that on a busy machine is taken for one that stands; it comes back, and the tests wait.
  static constexpr std::chrono::milliseconds kPatience{500};

  void SetUp() override {
    auto cluster = Cluster::Load(store_, {}, SystemRandomBytes, ControlPlane::ReadClocks());
    ASSERT_TRUE(cluster.ok()) << cluster.status();
    plane_ = std::make_unique<ControlPlane>(store_, *std::move(cluster), nullptr, LeaderRights{}, kPatience);
    server_ = *telemetry::MetricsServer::Start("127.0.0.1", 0, std::make_shared<prometheus::Registry>());
    AddPages(*server_, gate_);
    gate_->Set(plane_.get());
    const std::string path = folder_.path() + "/notify";
    systemd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    path.copy(name.sun_path, sizeof name.sun_path - 1);
    ASSERT_EQ(bind(systemd_, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
    setenv("WATCHDOG_USEC", "20000000", 1);
    watchdog_ = std::make_unique<Watchdog>(gate_);
  }
  ~WatchdogTest() override {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    gate_->Set(nullptr);
    if (systemd_ >= 0) close(systemd_);
  }
  // Polls: nobody says when a timer has stood for long enough, or runs again.
  static bool Becomes(const std::function<bool()>& condition) {
    const auto until = std::chrono::steady_clock::now() + kWatchdogTestPatience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > until) return false;
      std::this_thread::yield();
    }
    return true;
  }
  std::string Health() {
    const auto reply = telemetry::HttpGet(server_->address(), "/healthz");
    return reply.ok() ? std::to_string(reply->status) + " " + reply->body : std::string(reply.status().message());
  }
  // Whether systemd hears that all is well.
  bool Beats() {
    const bool said = watchdog_->Beat();
    char buffer[64];
    const ssize_t n = recv(systemd_, buffer, sizeof buffer, 0);
    const std::string heard(buffer, static_cast<std::size_t>(std::max<ssize_t>(n, 0)));
    EXPECT_EQ(heard, said ? "WATCHDOG=1" : "");
    return heard == "WATCHDOG=1";
  }
  void ExpectStandsStillUntil(const std::function<void()>& release) {
    EXPECT_TRUE(Becomes([&] { return !plane_->Alive(); }));
    EXPECT_EQ(Health(), "503 the timer stands still: nothing that is due happens\n");
    EXPECT_FALSE(Beats()) << "systemd restarts it then";
    release();
    EXPECT_TRUE(Becomes([&] { return Health() == "200 ok\n"; })) << Health();
    EXPECT_TRUE(Becomes([&] { return Beats(); }));
  }

  host::TemporaryFolder folder_;
  HangingStore store_;
  std::unique_ptr<ControlPlane> plane_;
  std::shared_ptr<PlaneGate> gate_ = std::make_shared<PlaneGate>();
  std::unique_ptr<telemetry::MetricsServer> server_;
  std::unique_ptr<Watchdog> watchdog_;
  int systemd_ = -1;
};

TEST_F(WatchdogTest, HearsThatAllIsWell) {
  EXPECT_TRUE(Becomes([&] { return Beats(); }));
  gate_->Set(nullptr);
  EXPECT_TRUE(Beats()) << "one that follows has no work that could stand still";
  unsetenv("WATCHDOG_USEC");
  EXPECT_FALSE(Watchdog(gate_).Beat()) << "nobody wants to hear it";
}

TEST_F(WatchdogTest, ALockThatIsHeldTooLongIsToldAndStarvesIt) {
  std::promise<void> release;
  std::thread holder([&] {
    plane_->Call([&](Cluster&, Now) {
      release.get_future().wait();
      return 0;
    });
  });
  ExpectStandsStillUntil([&] { release.set_value(); });
  holder.join();
}

// It has the lock itself then: whoever asks waits, and the page does not.
TEST_F(WatchdogTest, ATimerThatHangsInAWriteIsToldAndStarvesIt) {
  v1::AddHostRequest request;
  request.set_name("alpha");
  store_.held = true;
  std::thread command(
      [&] { EXPECT_TRUE(plane_->Call([&](Cluster& c, Now now) { return c.AddHost(now, request).status(); }).ok()); });
  ExpectStandsStillUntil([&] {
    store_.held = false;
    store_.held.notify_all();
  });
  command.join();
}

}  // namespace
}  // namespace tessera::control

// Commands to the real program, as a client sends them that means no good: each is refused with the reason, counted,
// and the region goes on and hears the next one.
#include <gmock/gmock.h>

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/match.h"
#include "core/replication/command.h"
#include "core/replication/datagram.h"
#include "region_worker/testing/worker_cluster.h"

namespace tessera::worker {
namespace {

using ::testing::HasSubstr;

constexpr char kScene[] = R"(
  name: "commands"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { y: 0.5 }
    max_force: 2000
    max_speed: 6
  }
)";
// Says in one line which command it got, but for those of a flood.
constexpr char kGame[] = R"(
  function on_command(player, bytes)
    if bytes ~= "flood" then print("heard", bytes, "of", player:number()) end
  end
)";

class WorkerCommandTest : public ::testing::Test {
 protected:
  WorkerCommandTest() : cluster_(1, kScene, {"--game", WriteTestFile("commands.lua", kGame)}) {
    client_ = cluster_.Join(1, 1);
    EXPECT_TRUE(client_->Until([&] { return client_->bodies.contains(PlayerBodyId(PlayerNumber(1))); }));
  }

  void Send(std::uint32_t number, const std::string& bytes) {
    client_->SendDatagram(replication::EncodeCommands({.base = number, .commands = {bytes}}));
  }
  double Counted(const std::string& result) const {
    return Metric(cluster_.metrics_port(1), "tessera_region_commands_total{result=\"" + result + "\"}");
  }
  std::string Said() { return cluster_.worker(1).said(); }
  // A command that the game gets, and ticks that pass.
  void ExpectThatItGoesOn(std::uint32_t number) {
    const Tick then = client_->tick;
    EXPECT_TRUE(client_->Until([&] {
      Send(number, "well");
      return absl::StrContains(Said(), "heard well of 1") && client_->tick > then + 10;
    })) << Said();
  }

  WorkerCluster cluster_;
  std::unique_ptr<TestClient> client_;
};

// The longest datagram that a client can send has room for one of 1100 bytes; one that says that it has 2048 lies.
TEST_F(WorkerCommandTest, OneThatIsTooLongIsRefusedByItsSizeAndCounted) {
  const auto send = [this](std::vector<std::uint8_t> length, std::size_t bytes, const std::string& detail) {
    // No event, one command, with the number 1.
    std::vector<std::uint8_t> datagram{static_cast<std::uint8_t>(replication::DatagramKind::kCommands), 0, 1, 1};
    datagram.insert(datagram.end(), length.begin(), length.end());
    datagram.insert(datagram.end(), bytes, 'x');
    datagram.insert(datagram.end(), 2, 0);
    client_->command_refused.reset();
    EXPECT_TRUE(client_->Until([&] {
      client_->SendDatagram(datagram);
      return client_->command_refused.has_value() && client_->command_refused->detail() == detail;
    })) << detail;
    EXPECT_TRUE(client_->command_refused->for_good());
  };
  send({0xcc, 0x08}, 1100, "commands: 1100 bytes are more than 1024");
  send({0x80, 0x10}, 1100, "commands: truncated");
  EXPECT_GE(Counted("refused"), 2);
  EXPECT_EQ(Counted("taken"), 0);
  ExpectThatItGoesOn(1);
}

TEST_F(WorkerCommandTest, AFloodIsCutDownAndCountedAndItsReasonIsSaid) {
  constexpr std::uint32_t kFlood = 200;
  for (std::uint32_t number = 1; number <= kFlood; ++number) Send(number, "flood");
  ASSERT_TRUE(client_->Until([&] { return client_->command_refused.has_value() && Counted("limited") >= 100; }));
  EXPECT_THAT(client_->command_refused->detail(), HasSubstr("command"));
  EXPECT_FALSE(client_->command_refused->for_good()) << "it may come later";
  EXPECT_LE(Counted("taken"), 60) << "a burst, and what a second adds";
  EXPECT_FALSE(client_->refusal.has_value()) << "the session goes on";
  ExpectThatItGoesOn(kFlood + 1);
}

// A command is that of who is connected: there is no field for anybody else.
TEST_F(WorkerCommandTest, ACommandIsThatOfItsConnectionAlone) {
  const auto other = cluster_.Join(1, 2);
  const BodyId body = PlayerBodyId(PlayerNumber(2));
  ASSERT_TRUE(Until({client_.get(), other.get()}, [&] { return other->bodies.contains(body); }));
  ASSERT_TRUE(Until({client_.get(), other.get()}, [&] {
    other->SendDatagram(replication::EncodeCommands({.base = 1, .commands = {"I am 1"}}));
    return absl::StrContains(Said(), "heard I am 1 of 2");
  })) << Said();
  EXPECT_FALSE(absl::StrContains(Said(), "heard I am 1 of 1"));
  ExpectThatItGoesOn(1);
}

}  // namespace
}  // namespace tessera::worker

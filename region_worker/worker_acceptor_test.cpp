// SpoofedFlood at the real program's port.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "core/world/byte_view.h"
#include "net/testing/spoofed_flood.h"
#include "region_worker/input_files.h"
#include "region_worker/testing/test_client.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {
namespace {

constexpr char kField[] = R"(
  name: "field"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies { id: 2 mass: 1 shape { sphere { radius: 0.5 } } pose { position { y: 5 } } }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: -5 y: 3 z: 0 }
    max_force: 2000
    max_speed: 6
  }
)";

class WorkerAcceptorTest : public testing::Test {
 protected:
  WorkerAcceptorTest()
      : file_(WriteTestFile("field.textproto", kField)),
        scene_(*LoadSceneFile(file_)),
        worker_({"--scene", file_, "--regions", "1", "--region", "1", "--base-port", std::to_string(port_)}) {
    EXPECT_TRUE(worker_.WaitForLine("listening")) << worker_.said();
  }
  // One dial may drown in a flood. Whoever gets no answer for some seconds dials again, as the client library does.
  std::unique_ptr<TestClient> DialUntilAnswered(std::uint32_t player) const {
    constexpr std::chrono::seconds kOneDial{5};
    std::unique_ptr<TestClient> client;
    for (int dials = 0; dials < 8; ++dials) {
      client = std::make_unique<TestClient>(scene_->bounds);
      client->Dial(port_, RegionId(1), CredentialsFor(player));
      const auto dialled = std::chrono::steady_clock::now();
      client->Until([&] { return client->connected || std::chrono::steady_clock::now() - dialled > kOneDial; });
      if (client->connected) break;
    }
    EXPECT_TRUE(client->connected);
    return client;
  }

  std::uint16_t port_ = FreeBasePort(1);
  std::string file_;
  std::shared_ptr<const Scene> scene_;
  WorkerProcess worker_;
};

TEST_F(WorkerAcceptorTest, PlayersJoinAndPlayWhileStrangersFlood) {
  net::SpoofedFlood flood(256);
  std::atomic<bool> done = false;
  std::thread sender([&] {
    for (std::uint32_t i = 0; !done; ++i) {
      flood.Send(port_, i % 2 == 0 ? net::BlindConnect(i) : net::BlindHello(i));
      if (i % 256 == 0) {
        flood.Drain();
        std::this_thread::yield();
      }
    }
  });
  for (std::uint32_t player = 1; player <= 3; ++player) {
    const auto client = DialUntilAnswered(player);
    EXPECT_TRUE(client->Until([&] { return client->welcome.has_value() && client->bodies.size() >= 2; }));
    const Tick then = client->tick;
    EXPECT_TRUE(client->Until([&] { return client->tick > then + 30; }));
  }
  done = true;
  sender.join();
  flood.Drain();
  EXPECT_GT(flood.datagrams(), 1000u);
  EXPECT_LT(flood.bytes_received(), flood.bytes_sent());
  const std::string metrics = ReadMetrics(static_cast<std::uint16_t>(port_ + 2));
  EXPECT_NE(metrics.find("tessera_region_acceptor_datagrams_total{port=\"game\",result=\"accepted\"} 3"),
            std::string::npos);
}

// The other player's snapshots go on meanwhile.
TEST_F(WorkerAcceptorTest, AClientThatFloodsIsEndedWithTheReasonAndDoesNotComeBack) {
  const net::Credentials credentials = CredentialsFor(1);
  TestClient honest(scene_->bounds), flooder(scene_->bounds);
  EXPECT_TRUE(honest.Connect(port_, RegionId(1), CredentialsFor(2)));
  EXPECT_TRUE(flooder.Connect(port_, RegionId(1), credentials));
  ASSERT_TRUE(Until({&honest, &flooder}, [&] { return honest.welcome && flooder.welcome; }));
  const Tick then = honest.tick;
  const std::vector<std::uint8_t> junk(100, 0x55);
  ASSERT_TRUE(Until({&honest, &flooder}, [&] {
    for (int i = 0; i < 200 && !flooder.disconnected; ++i) flooder.SendDatagram(junk);
    honest.Acknowledge();
    return flooder.refusal.has_value();
  }));
  EXPECT_EQ(flooder.refusal->reason(), v1::REFUSAL_REASON_SESSION_ENDED);
  EXPECT_EQ(flooder.refusal->detail(), "more than 1000 datagrams or 512 KiB a second for 3 s");
  TestClient again(scene_->bounds);
  EXPECT_FALSE(again.Connect(port_, RegionId(1), credentials));
  EXPECT_TRUE(honest.Until([&] { return honest.tick > then + 30; }));
  EXPECT_FALSE(honest.disconnected);
  const std::string metrics = ReadMetrics(static_cast<std::uint16_t>(port_ + 2));
  EXPECT_NE(metrics.find("tessera_region_floods_total{port=\"game\"} 1"), std::string::npos);
  EXPECT_NE(metrics.find("result=\"held_off\"} 1"), std::string::npos);
}

TEST_F(WorkerAcceptorTest, NeitherCredentialsNorKeysAreInTheLog) {
  const net::Credentials credentials = CredentialsFor(1);
  TestClient client(scene_->bounds);
  EXPECT_TRUE(client.Connect(port_, RegionId(1), credentials));
  ASSERT_TRUE(client.Until([&] { return client.welcome.has_value(); }));
  net::Credentials stolen = credentials;
  stolen.key = net::SigningKey::Make();
  TestClient thief(scene_->bounds);
  EXPECT_FALSE(thief.Connect(port_, RegionId(1), stolen));
  const std::string said = worker_.said();
  const auto in_log = [&](const std::uint8_t* bytes, std::size_t size) {
    std::string hex;
    for (std::size_t i = 0; i < size; ++i) {
      constexpr char kDigits[] = "0123456789abcdef";
      hex += kDigits[bytes[i] >> 4];
      hex += kDigits[bytes[i] & 15];
    }
    return said.find(hex) != std::string::npos || said.find(AsText({bytes, size})) != std::string::npos;
  };
  const net::Seed seed = credentials.key.seed();
  EXPECT_FALSE(in_log(seed.data(), 8));
  EXPECT_FALSE(in_log(credentials.statement.data() + credentials.statement.size() - 64, 8));
}

}  // namespace
}  // namespace tessera::worker

// The shared libraries as a game has them, in a program that has our generated messages, gRPC and Abseil as well: each
// keeps to itself. Everything else of the C interface is tested in c_api_test, which links the same sources statically.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "client_sdk/include/tessera/connect.hpp"
#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/testing/instance_door.h"

namespace tessera::client {
namespace {

struct SharedLibraryTest : testing::Test {
  // Until it is so; what the library is told to be the time goes on by itself.
  bool Until(const std::function<bool()>& done) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!done() && std::chrono::steady_clock::now() < limit) {
      instance.Service();
      EXPECT_FALSE(client.Poll()) << tessera_last_error();
    }
    return done();
  }
  bool Sees(std::uint64_t body) {
    const std::vector<tessera::Body> bodies = client.Bodies();
    return std::ranges::any_of(bodies, [&](const tessera::Body& one) { return one.id == body; });
  }

  FakeInstance instance{1};
  tessera::Client client;
};

TEST_F(SharedLibraryTest, PlaysBesideTheGeneratedMessages) {
  ASSERT_FALSE(client.JoinByGrant(instance.Grant())) << tessera_last_error();
  ASSERT_TRUE(Until([&] { return client.state() == TESSERA_WAITING; }));
  EXPECT_STREQ(client.Scene().name, "plaza");
  instance.regions[0]->Start(Tick(0));
  ASSERT_TRUE(Until([&] { return client.state() == TESSERA_PLAYING; }));
  BodyState state;
  state.position = {1, 2, 3};
  const std::vector<replication::BodyRecord> bodies = {{BodyId(1), Epoch(1), state},
                                                       {PlayerBodyId(PlayerNumber(1)), Epoch(1), state}};
  Tick tick;
  ASSERT_TRUE(Until([&] {
    tick = tick + 2;
    instance.regions[0]->Snapshot(tick, bodies);
    return Sees(1) && Sees(client.own_body());
  }));
  const auto ball = client.Find(1);
  ASSERT_TRUE(ball.has_value());
  EXPECT_NEAR(ball->position[1], 2, 0.01);
  client.Move({1, 0, 0});
  ASSERT_TRUE(Until([&] {
    tick = tick + 2;
    instance.regions[0]->Snapshot(tick, bodies);
    return !instance.regions[0]->inputs.empty();
  }));
  EXPECT_EQ(instance.regions[0]->inputs.back().body, PlayerBodyId(PlayerNumber(1)));
}

TEST_F(SharedLibraryTest, JoinsByAnAddressAndLeaves) {
  const InstanceDoor door(instance);
  std::vector<::tessera::InstanceInfo> worlds;
  ASSERT_EQ(::tessera::ListInstances(instance.address, worlds).text, "");
  ASSERT_EQ(client.Join({instance.address, FakeInstance::kId, "ada", std::chrono::seconds(10), "127.0.0.1"}).text, "");
  ASSERT_TRUE(Until([&] { return client.state() == TESSERA_WAITING; }));
  EXPECT_STREQ(client.Scene().name, "plaza");
  EXPECT_FALSE(client.Leave()) << tessera_last_error();
  EXPECT_EQ(instance.left, 1);
  ::tessera::Client nowhere;
  EXPECT_EQ(nowhere.Join({instance.address, "plaza-9", "ada"}).text, "instance plaza-9: no such instance");
}

TEST_F(SharedLibraryTest, SaysWhatIsWrongWithAGrant) {
  std::vector<std::uint8_t> grant = instance.Grant();
  grant.back() ^= 1;
  const tessera::Error error = client.JoinByGrant(grant);
  EXPECT_EQ(error.code, TESSERA_INVALID_ARGUMENT);
  EXPECT_EQ(error.text, "checksum: the grant is damaged");
}

}  // namespace
}  // namespace tessera::client

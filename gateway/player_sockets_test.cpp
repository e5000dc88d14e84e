// A player's WebSocket over the wire, at an instance whose world the test moves by hand: it breaks without a word.
#include <gmock/gmock.h>

#include <chrono>
#include <functional>
#include <optional>
#include <vector>

#include "client_sdk/client_fixture.h"
#include "client_sdk/testing/fake_instance.h"
#include "gateway/testing/viewer_socket.h"
#include "gateway/testing/web_loop.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;

class PlayerSocketsTest : public testing::Test {
 protected:
  PlayerSocketsTest() {
    instance_.regions[0]->started = true;
    GatewayOptions options;
    options.control.address = instance_.address;
    loop_.emplace(WebOptions{.listen = {"127.0.0.1", 0}, .page = {}, .visuals = {}, .allow_origins = {}}, options);
    bodies_ = {{client::kBall, Epoch(1), client::Moving(1, 0)}};
  }
  // The world goes on, 30 snapshots a second, and the viewers read, until it holds; false when time is up.
  bool Until(const std::vector<ViewerSocket*>& viewers, const std::function<bool()>& holds) {
    const auto limit = std::chrono::steady_clock::now() + 60s;
    while (!holds() && std::chrono::steady_clock::now() < limit) {
      instance_.Service();
      if (const auto now = std::chrono::steady_clock::now(); now >= next_snapshot_) {
        next_snapshot_ = now + 2 * client::kTick;
        tick_ = tick_ + 2;
        instance_.regions[0]->Snapshot(tick_, bodies_);
      }
      for (ViewerSocket* viewer : viewers) viewer->Take(1ms);
    }
    return holds();
  }

  client::FakeInstance instance_{1};
  std::optional<WebLoop> loop_;
  std::vector<replication::BodyRecord> bodies_;
  Tick tick_;
  std::chrono::steady_clock::time_point next_snapshot_{};
};

TEST_F(PlayerSocketsTest, APlayerWhoseConnectionBreaksLeavesTheWorldAndOthersSeeOn) {
  std::optional<ViewerSocket> player;
  player.emplace(loop_->address(), client::FakeInstance::kId);
  ViewerSocket other(loop_->address(), client::FakeInstance::kId);
  ASSERT_TRUE(Until({&*player, &other},
                    [&] { return player->decoder.bodies.contains(1) && other.decoder.bodies.contains(1); }));
  player->Send({{"type", "join"}, {"name", "ada"}});
  ASSERT_TRUE(Until({&*player, &other}, [&] { return player->decoder.own_body != 0; }));
  const std::uint64_t own = player->decoder.own_body;
  bodies_.push_back({BodyId(own), Epoch(1), client::Moving(5, 0)});
  ASSERT_TRUE(Until({&*player, &other},
                    [&] { return player->decoder.bodies.contains(own) && other.decoder.bodies.contains(own); }));
  EXPECT_EQ(loop_->metrics.players.Value(), 1);
  EXPECT_EQ(loop_->metrics.viewers.Value(), 2);
  player.reset();  // no closing frame: what it was sent meanwhile is answered by a reset
  EXPECT_TRUE(Until({&other}, [&] {
    return instance_.left == 1 && loop_->metrics.players.Value() == 0 && loop_->metrics.viewers.Value() == 1;
  }));
  const std::size_t frames = other.decoder.frames;
  EXPECT_TRUE(Until({&other}, [&] { return other.decoder.frames >= frames + 10; }));
  EXPECT_FALSE(other.closed.has_value());
}

}  // namespace
}  // namespace tessera::gateway

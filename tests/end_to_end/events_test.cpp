// Contact events as a player of a real cluster receives them: each once, from whichever region.
#include <fstream>
#include <map>
#include <set>

#include "host/temporary_folder.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using client::ClientEvent;

// Balls roll from the west into the east through a gate that stands on the border between two regions, at x = 0.
constexpr char kGate[] = R"(
  name: "gate"
  bounds { min { x: -12 y: -2 z: -12 } max { x: 12 y: 10 z: 12 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies {
    id: 2 name: "gate" motion: MOTION_STATIC trigger: true
    pose { position { y: 1 } }
    shape { box { half_extents { x: 1.5 y: 1 z: 10 } } }
  }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: -8 y: 0.5 z: 11 }
    max_force: 1
    max_speed: 6
  }
)";
constexpr int kBalls = 8;

struct EventsTest : WorldTest {
  void SetUp() override {
    std::string text = kGate;
    for (int i = 0; i < kBalls; ++i) {
      text += "bodies { id: " + std::to_string(100 + i) + " mass: 1 shape { sphere { radius: 0.4 } }" +
              " pose { position { x: " + std::to_string(-6 - 0.5 * i) + " y: 0.4 z: " + std::to_string(2 * i - 9) +
              " } } linear_velocity { x: 4 } }\n";
    }
    scene_ = folder_.path() + "/gate.textproto";
    std::ofstream(scene_) << text;
  }

  host::TemporaryFolder folder_;
  std::string scene_;
};

TEST_F(EventsTest, AGateOnABorderTellsOfEachBallOnceIntoAndOutOfIt) {
  Start({.scene = scene_, .regions = 2, .bots = 1, .hosts = 1, .capacity = 2});
  local::Bot& bot = *run_->bots()[0];
  bot.client().SimulateNetwork({.loss = 0.2, .duplicate = 0.1, .seed = 5});
  const std::string recording = folder_.path() + "/match.tsr";
  ASSERT_TRUE(bot.client().Record(recording).ok());
  std::map<BodyId, int> entered, left;
  std::set<RegionId> tellers;
  const auto count = [&](const std::vector<ClientEvent>& events) {
    for (const ClientEvent& event : events) {
      if (event.body != BodyId(2)) continue;
      if (event.kind == ClientEvent::Kind::kTriggerEntered) ++entered[event.other];
      if (event.kind == ClientEvent::Kind::kTriggerLeft) {
        ++left[event.other];
        tellers.insert(event.region);
        EXPECT_EQ(entered[event.other], left[event.other]) << "no end without its begin";
      }
    }
  };
  ASSERT_TRUE(PlayUntil("all balls are through", [&] {
    count(bot.events());
    return left.size() == kBalls;
  }));
  // No event arrives late, or twice.
  const Tick then = bot.client().tick();
  bool counted = true;
  ASSERT_TRUE(PlayUntil("a second more", [&] {
    if (!std::exchange(counted, false)) count(bot.events());
    return bot.client().tick() > then + 60;
  }));
  for (const auto& [ball, times] : entered) EXPECT_EQ(times, 1) << ball;
  for (const auto& [ball, times] : left) EXPECT_EQ(times, 1) << ball;
  EXPECT_EQ(entered.size(), std::size_t{kBalls});
  EXPECT_TRUE(tellers.contains(RegionId(2))) << "they went over the border within the gate";
  ASSERT_TRUE(bot.client().StopRecording().ok());

  auto again = client::Client::Play(recording);
  ASSERT_TRUE(again.ok()) << again.status();
  entered.clear();
  left.clear();
  const client::TimePoint start = client::Clock::now();
  (*again)->Poll(start);
  count((*again)->Poll(start + std::chrono::hours(1)));
  EXPECT_EQ(entered.size(), std::size_t{kBalls});
  EXPECT_EQ(left.size(), std::size_t{kBalls});
}

}  // namespace
}  // namespace tessera::end_to_end

// A player who holds a crate by a joint of the game, and one who rides what a game moves: both are foreseen together.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>

#include "absl/strings/match.h"
#include "client_sdk/throw_stage.h"

namespace tessera::client {
namespace {

using std::chrono::milliseconds;
using ::testing::IsEmpty;

constexpr BodyId kCrate{10};
constexpr NetworkConditions kAway{.delay = milliseconds(50)};  // 100 ms there and back

// "hold" ties the crate that is nearest to the player, softly; "drop" parts them.
constexpr char kHolding[] = R"lua(
local function crate_of(player)
  local here, nearest, best = player:body():position(), nil, 8
  for _, body in ipairs(world.overlap({ radius = 8 }, here, { static = false })) do
    local distance = (body:position() - here):length()
    if body ~= player:body() and distance < best then nearest, best = body, distance end
  end
  return nearest
end
function on_command(player, command)
  local body = player:body()
  if command == "hold" then
    local crate = crate_of(player)
    body:connect(crate, { kind = "spring", at = body:position(), at_other = crate:position(), stiffness = 600,
                          damping = 100, collide = true })
  else
    for _, crate in ipairs(world.overlap({ radius = 12 }, body:position(), { static = false })) do
      if crate ~= body then body:disconnect(crate) end
    end
  end
end)lua";

class HoldTest : public ::testing::Test {
 protected:
  HoldTest() : stage(kAway, kHolding) {
    stage.player =
        "player { body { mass: 80 shape { capsule { radius: 0.3 half_height: 0.25 } } } "
        "spawn_points { x: 2.5 y: 0.55 } character { walk_speed: 3 run_speed: 5 jump_speed: 4 } }";
    // Round and round, always forward, and away from the other crates' middle.
    stage.steers = [](int frame) {
      Steering steering;
      steering.move = {0, frame < 600 ? 0.0F : 1.0F};
      steering.yaw_rad = 0.012F * static_cast<float>(frame % 523) - 3.14F;
      return steering;
    };
  }
  std::uint64_t Corrections() const { return stage.client->Stats().corrections; }
  bool Foreseen() const {
    const ShownBody* const crate = stage.Find(kCrate);
    return crate != nullptr && crate->predicted;
  }

  ThrowStage stage;
};

TEST_F(HoldTest, WhatIsHeldIsForeseenWithWhoHoldsItUntilItIsLetGo) {
  ASSERT_TRUE(stage.Begin()) << stage.error;
  ASSERT_TRUE(stage.Run(3)) << stage.error;
  EXPECT_FALSE(Foreseen()) << "it stands by itself";
  ASSERT_TRUE(stage.client->Send("hold").ok());
  ASSERT_TRUE(stage.Run(1)) << stage.error;
  EXPECT_TRUE(Foreseen());
  ASSERT_TRUE(stage.Run(8)) << stage.error;
  const std::uint64_t before = Corrections();
  const Vec3d from = stage.Find(kCrate)->pose.position;
  ASSERT_TRUE(stage.Run(10)) << stage.error;
  EXPECT_GT(Length(stage.Find(kCrate)->pose.position - from), 0.5) << "it is drawn along";
  EXPECT_TRUE(Foreseen());
  EXPECT_LE(Corrections() - before, 5U) << "in ten seconds, of more than a centimetre";

  ASSERT_TRUE(stage.client->Send("drop").ok());
  ASSERT_TRUE(stage.Run(3)) << stage.error;
  EXPECT_FALSE(Foreseen());
  EXPECT_THAT(stage.lines, IsEmpty());
}

// A lift and a ferry in one, that a game moves up and away and back again, each way in two seconds. Its client hears a
// tenth of a second late that it starts and that it stops; in between, both know how it goes.
TEST(RideTest, APlatformThatAGameMovesSurprisesItsRiderOnlyWhereItStartsAndStops) {
  ThrowStage stage({.loss = 0.05, .delay = milliseconds(50)}, R"lua(
local HERE, THERE = vec(0, -0.08, 0), vec(6, 1.9, 3)
kinds.lift = {
  on_tick = function(self)
    if world.tick() % 300 ~= 0 then return end
    self:move_to(world.tick() % 600 == 0 and HERE or THERE, nil, 120)
  end,
})lua");
  stage.crates = false;
  stage.player =
      "bodies { id: 50 kind: \"lift\" pose { position { y: -0.08 } } shape { box { half_extents { x: 3 y: 0.1 z: 3 } } "
      "} "
      "kinematic { } } "
      "player { body { mass: 80 shape { capsule { radius: 0.3 half_height: 0.25 } } } spawn_points { y: 0.6 } "
      "character { walk_speed: 3 run_speed: 5 jump_speed: 4 } }";
  // A step this way and one back, now and then.
  stage.steers = [](int frame) {
    Steering steering;
    const int part = frame % 120;
    steering.move = {0, part < 30 ? 0.3F : part >= 60 && part < 90 ? -0.3F : 0.0F};
    return steering;
  };
  // Corrections that follow each other within a round trip and a little are of one surprise. One that comes of an input
  // that acts at another tick than was thought is none of the platform's.
  constexpr double kStart_m = 0.2;  // less than it goes in a round trip
  int surprises = 0, starts = 0, frame = 0, last = -1000;
  stage.hears = [&](const ClientEvent& event) {
    if (event.kind != ClientEvent::Kind::kPredictionCorrected || absl::StrContains(event.detail, "input")) return;
    if (frame - last > 12) ++(std::stod(event.detail) > kStart_m ? starts : surprises);
    last = frame;
  };
  ASSERT_TRUE(stage.Begin()) << stage.error;
  surprises = starts = 0;
  double lowest = 1e9, highest = -1e9;
  for (frame = 1; frame <= 20 * 60; ++frame) {
    ASSERT_TRUE(stage.Frame()) << stage.error;
    const ShownBody* const own = stage.Find(stage.client->own_body());
    ASSERT_NE(own, nullptr);
    lowest = std::min(lowest, own->pose.position.y);
    highest = std::max(highest, own->pose.position.y);
  }
  EXPECT_LT(lowest, 0.7);
  EXPECT_GT(highest, 2.4) << "it was lifted";
  EXPECT_GE(starts, 3) << "of four ways, each of which starts and stops";
  EXPECT_LE(starts, 8);
  EXPECT_LE(surprises, 10) << "five in ten seconds beside those";
  EXPECT_THAT(stage.lines, IsEmpty());
}

}  // namespace
}  // namespace tessera::client

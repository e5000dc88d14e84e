// A character that crosses borders walks as in one region, to the bit.
#include <gmock/gmock.h>

#include "core/world/scene_io.h"
#include "tests/simulation/region_group.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr PlayerNumber kWalker{1};
constexpr BodyId kWalkerBody = PlayerBodyId(kWalker);

// The border of two regions is at x = 0: a step lies across it.
std::shared_ptr<const Scene> Course() {
  const auto written = ParseScene(R"(name: "course" bounds { min { x: -20 y: -5 z: -20 } max { x: 20 y: 20 z: 20 } }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    bodies { id: 2 motion: MOTION_STATIC pose { position { y: 0.1 } } shape { box { half_extents { x: 1 y: 0.1 z: 20 } } } }
    bodies { id: 3 mass: 20 pose { position { x: 0.4 y: 0.61 z: 4 } } shape { box { half_extents { x: 0.4 y: 0.4 z: 0.4 } } } }
    player { body { mass: 80 shape { capsule { radius: 0.35 half_height: 0.55 } } } spawn_points { x: -4 y: 0.9 }
             character { run_speed: 7 jump_speed: 4.5 } })",
                                  "course.textproto");
  EXPECT_TRUE(written.ok()) << written.status();
  return *ResolveScene(*written, "course.textproto");
}

RegionGroup Make(std::uint32_t regions) {
  RegionGroupOptions options;
  options.settings.shared_origin = true;
  const std::shared_ptr<const Scene> scene = Course();
  RegionGroup group(scene, *MakeGridMap(scene->ground(), regions), options);
  group.SpawnPlayer(kWalker, 1);
  group.RunTo(Tick(2));
  return group;
}

// East and back, running and jumping on the way.
PlayerInput InputAt(std::uint32_t number) {
  PlayerInput input;
  input.number = number;
  input.player = kWalker;
  input.body = kWalkerBody;
  input.yaw_rad = number % 240 < 120 ? -1.5F : 1.6F;
  input.move = {0, number % 50 < 45 ? 1.0F : 0.0F};
  input.buttons = (number % 90 < 30 ? kRunButton : 0) | (number % 70 == 33 ? kJumpButton : 0);
  return AsSent(input);
}

TEST(CharacterBorderTest, WalksAcrossABorderAsInOneRegion) {
  RegionGroup one = Make(1), two = Make(2);
  // Inputs come early enough that those on their way to the new owner are there in time.
  for (RegionGroup* group : {&one, &two}) {
    for (std::uint32_t number = 1; number <= 3; ++number) ASSERT_TRUE(group->QueueInput(InputAt(number)).ok());
  }
  int crossings = 0;
  RegionId owner = two.OwnerOf(kWalkerBody);
  for (std::uint32_t number = 4; number <= 900; ++number) {
    for (RegionGroup* group : {&one, &two}) {
      (void)group->QueueInput(InputAt(number));
      group->RunTo(group->tick() + 1);
    }
    crossings += two.OwnerOf(kWalkerBody) != owner ? 1 : 0;
    owner = two.OwnerOf(kWalkerBody);
    ASSERT_EQ(one.StateOf(kWalkerBody), two.StateOf(kWalkerBody)) << number;
  }
  EXPECT_GE(crossings, 4);
  EXPECT_THAT(one.problems(), IsEmpty());
  EXPECT_THAT(two.problems(), IsEmpty());
}

// A character whose player sends nothing any more stops by itself.
TEST(CharacterBorderTest, StopsWhenInputsStop) {
  RegionGroup group = Make(2);
  for (std::uint32_t number = 1; number <= 30; ++number) {
    PlayerInput input = InputAt(1);
    input.number = number;
    ASSERT_TRUE(group.QueueInput(input).ok());
    group.RunTo(group.tick() + 1);
  }
  const double from = group.StateOf(kWalkerBody).position.x;
  group.RunTo(group.tick() + 120);
  EXPECT_LT(Length(group.StateOf(kWalkerBody).linear_velocity), 1e-3F);
  EXPECT_GT(group.StateOf(kWalkerBody).position.x, from + 0.5);  // the last input is held for a quarter of a second
  EXPECT_LT(group.StateOf(kWalkerBody).position.x, from + 3);
}

}  // namespace
}  // namespace tessera::simulation

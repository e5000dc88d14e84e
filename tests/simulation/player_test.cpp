// Players in an instance: made once, steered once, removed wherever they are.
#include <gmock/gmock.h>

#include "tests/simulation/region_group.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;
constexpr PlayerNumber kPlayer{1};
constexpr BodyId kBody = PlayerBodyId(kPlayer);

SceneBuilder World(Vec3d spawn, Vec3f velocity = {}) {
  SceneBuilder builder(kHalf);
  PlayerRules rules;
  rules.body.shape = Ball(0.5);
  rules.body.mass_kg = 2;
  rules.body.initial.linear_velocity = velocity;
  rules.spawn_points = {spawn};
  rules.max_force_n = 50;
  rules.max_speed_m_s = 1e6;  // no fading to speak of: impulses add up
  builder.scene().player = rules;
  return builder;
}

RegionGroup Make(const SceneBuilder& builder, std::uint32_t regions) {
  RegionGroupOptions options;
  options.settings.shared_origin = true;
  const std::shared_ptr<const Scene> scene = builder.Build();
  return RegionGroup(scene, *MakeGridMap(scene->ground(), regions), options);
}

PlayerInput Input(std::uint32_t number, Vec3f force = {0, 0, 6}) {
  return {.number = number, .player = kPlayer, .body = kBody, .force_n = force};
}

TEST(PlayerTest, IsMadeExactlyOnce) {
  RegionGroup group = Make(World({-3, 1, 0}, {4, 0, 0}), 2);
  group.SpawnPlayer(kPlayer, 1);
  group.region(1).SpawnPlayer(kPlayer);
  group.RunTo(Tick(1));
  EXPECT_EQ(group.OwnerOf(kBody), RegionId(1));
  group.RunTo(Tick(100));
  EXPECT_EQ(group.OwnerOf(kBody), RegionId(2));
  group.region(1).SpawnPlayer(kPlayer);  // told again when it has long gone over
  group.RunTo(Tick(120));
  EXPECT_EQ(group.States().size(), 1U);
  EXPECT_THAT(group.problems(), IsEmpty());
}

TEST(PlayerTest, GoesToItsPlacesOwnerWhenMadeElsewhere) {
  RegionGroup group = Make(World({15, 1, 15}), 4);
  group.SpawnPlayer(kPlayer, 1);
  group.RunTo(Tick(10));
  EXPECT_EQ(group.OwnerOf(kBody), RegionId(4));
  EXPECT_THAT(group.problems(), IsEmpty());
}

// Parked just over the border, where the neighbour sees it too: a ball that comes along rolls through it, on both
// sides.
TEST(PlayerTest, TakesNoPartOnEitherSideWhileItIsParked) {
  SceneBuilder builder = World({0.3, 1, 0});
  builder.Add(Ball(0.5), {-4, 1, 0}, {4, 0, 0}, 1);
  RegionGroup group = Make(builder, 2);
  group.SpawnPlayer(kPlayer, 2);
  group.RunTo(Tick(2));
  for (std::uint32_t region = 1; region <= 2; ++region) group.region(region).ParkPlayer(kPlayer, true);
  group.RunTo(Tick(5));
  const BodyState parked = group.StateOf(kBody);
  group.RunTo(Tick(180));
  EXPECT_EQ(group.StateOf(kBody).position, parked.position);
  EXPECT_EQ(group.OwnerOf(BodyId(1)), RegionId(2));
  EXPECT_GT(group.StateOf(BodyId(1)).position.x, 5);
  EXPECT_NEAR(group.StateOf(BodyId(1)).linear_velocity.x, 4, 1e-3);
  EXPECT_TRUE(group.totals().events.empty());
  for (std::uint32_t region = 1; region <= 2; ++region) group.region(region).ParkPlayer(kPlayer, false);
  group.RunTo(group.tick() + 1);
  ASSERT_TRUE(group.QueueInput(Input(1, {0, 0, 30})).ok());
  group.RunTo(group.tick() + 30);
  EXPECT_GT(group.StateOf(kBody).position.z, 0.1);
  EXPECT_THAT(group.problems(), IsEmpty());
}

// Momentum tells how often inputs acted: each adds force * tick.
TEST(PlayerTest, InputsActExactlyOnceThroughHandovers) {
  RegionGroup group = Make(World({-2, 1, 0}, {5, 0, 0}), 2);
  group.SpawnPlayer(kPlayer, 1);
  group.RunTo(Tick(1));
  std::uint32_t number = 0;
  for (std::uint64_t t = 1; t < 60; ++t) {
    // Regions may be a tick apart: offered to the owner of the moment, like a client's.
    ASSERT_TRUE(group.QueueInput(Input(++number)).ok());
    group.RunTo(Tick(t + 1));
  }
  group.RunTo(Tick(80));
  EXPECT_EQ(group.totals().handovers, 1U);
  EXPECT_EQ(group.region(2).LastInput(kPlayer), number);
  EXPECT_NEAR(group.StateOf(kBody).linear_velocity.z, number * 6.0 / 60 / 2, 1e-4);
  EXPECT_THAT(group.problems(), IsEmpty());
}

TEST(PlayerTest, AQueueGoesAlong) {
  RegionGroup group = Make(World({-0.2, 1, 0}, {5, 0, 0}), 2);
  group.SpawnPlayer(kPlayer, 1);
  group.RunTo(Tick(2));
  std::uint32_t number = 0, taken = 0, last_taken = 0;
  while (group.OwnerOf(kBody) == RegionId(1)) {  // the queue is kept full until the body goes
    while (group.region(1).QueueInput(Input(++number)).ok()) {
      ++taken;
      last_taken = number;
    }
    group.RunTo(group.tick() + 1);
  }
  ASSERT_GT(taken, region::kMaxQueuedInputs);
  group.RunTo(group.tick() + 30);
  EXPECT_EQ(group.region(2).LastInput(kPlayer), last_taken);
  EXPECT_NEAR(group.StateOf(kBody).linear_velocity.z, taken * 6.0 / 60 / 2, 1e-4);
  EXPECT_THAT(group.problems(), IsEmpty());
}

TEST(PlayerTest, PushesANeighboursBodyAsInOneWorld) {
  SceneBuilder builder = World({-1.2, 1, 0});
  builder.Add(Ball(0.5), {0.5, 1, 0}, {}, 1);
  RegionGroup one = Make(builder, 1), two = Make(builder, 2);
  for (RegionGroup* group : {&one, &two}) {
    group->SpawnPlayer(kPlayer, 1);
    group->RunTo(Tick(1));
    // One in advance: an input that comes while the body changes hands takes a tick longer.
    ASSERT_TRUE(group->QueueInput(Input(1, {20, 0, 0})).ok());
  }
  for (std::uint64_t t = 2; t < 100; ++t) {
    for (RegionGroup* group : {&one, &two}) {
      ASSERT_TRUE(group->QueueInput(Input(static_cast<std::uint32_t>(t), {20, 0, 0})).ok());
      group->RunTo(Tick(t));
    }
    ASSERT_EQ(one.States(), two.States()) << "tick " << t;
  }
  EXPECT_GT(two.StateOf(BodyId(1)).linear_velocity.x, 0.5);
}

TEST(PlayerTest, IsRemovedWhereverItIs) {
  for (std::uint64_t when = 20; when < 50; ++when) {  // before, during and after the handover
    RegionGroup group = Make(World({-1, 1, 0}, {3, 0, 0}), 2);
    group.SpawnPlayer(kPlayer, 1);
    group.RunTo(Tick(when));
    group.RemovePlayer(kPlayer);
    group.RunTo(Tick(when + 3));
    EXPECT_EQ(group.OwnerOf(kBody), RegionId()) << "removed at tick " << when;
    EXPECT_EQ(group.region(1).ghost_count() + group.region(2).ghost_count(), 0U);
    group.region(1).SpawnPlayer(kPlayer);
    group.RunTo(Tick(when + 6));
    EXPECT_EQ(group.OwnerOf(kBody), RegionId());
    EXPECT_THAT(group.problems(), IsEmpty());
  }
}

TEST(PlayerTest, MayMoveOnlyItsOwnBodyWithFiniteForcesInOrder) {
  SceneBuilder builder = World({-3, 1, 0});
  builder.Add(Ball(0.5), {5, 1, 0});
  RegionGroup group = Make(builder, 2);
  group.SpawnPlayer(kPlayer, 1);
  group.RunTo(Tick(1));
  region::Region& region = group.region(1);
  PlayerInput input = Input(5);
  EXPECT_TRUE(region.QueueInput(input).ok());
  EXPECT_EQ(region.QueueInput(input).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(region.QueueInput(Input(4)).code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(region.QueueInput(Input(4)).code(), absl::StatusCode::kAlreadyExists);
  input.number = 6;
  input.force_n.y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(region.QueueInput(input).message(), "force_n is not finite");
  EXPECT_EQ(region.QueueInput(Input(6)).code(), absl::StatusCode::kAlreadyExists);  // refused once and for all
  input = Input(7);
  input.body = BodyId(1);
  EXPECT_EQ(region.QueueInput(input).message(), "body 1 is not player 1's");
  EXPECT_EQ(group.region(2).QueueInput(Input(8)).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(group.region(2).QueueInput(Input(8)).code(), absl::StatusCode::kNotFound);  // not decided on there
  std::uint32_t number = 8;
  while (region.QueueInput(Input(number)).ok()) ++number;
  EXPECT_EQ(number, 8 + region::kMaxQueuedInputs - 1);  // number 5 waits too
  EXPECT_EQ(region.QueueInput(Input(number + 1)).code(), absl::StatusCode::kResourceExhausted);
}

TEST(PlayerTest, ForcesAreHeldToTheScenesLimits) {
  RegionGroup group = Make(World({-3, 1, 0}), 1);
  group.SpawnPlayer(kPlayer, 1);
  group.RunTo(Tick(1));
  ASSERT_TRUE(group.QueueInput(Input(1, {0, 0, 1e9F})).ok());
  group.RunTo(Tick(4));
  EXPECT_NEAR(group.StateOf(kBody).linear_velocity.z, 50.0 / 60 / 2, 1e-4);
}

}  // namespace
}  // namespace tessera::simulation

#include "core/region/log.h"

#include <gmock/gmock.h>

#include <bit>
#include <cmath>
#include <limits>

#include "core/region/log_wire.h"
#include "core/region/region.h"
#include "core/region/standby_copy.h"
#include "core/world/limits.h"

namespace tessera::region {
namespace {

using ::testing::HasSubstr;

template <class Form>
ShapePtr MakeShape(Form form) {
  return std::make_shared<const Shape>(Shape{std::move(form)});
}

// Balls and boxes that fall on a floor, spin and come to rest; a player.
std::shared_ptr<const Scene> MakeScene(int bodies) {
  auto scene = std::make_shared<Scene>();
  scene->bounds = {{-50, -50, -50}, {50, 50, 50}};
  BodyDef floor;
  floor.id = BodyId(1);
  floor.motion = Motion::kStatic;
  floor.mass_kg = 0;
  floor.shape = MakeShape(PlaneShape{});
  scene->bodies.push_back(floor);
  for (int i = 0; i < bodies; ++i) {
    BodyDef def;
    def.id = BodyId(static_cast<std::uint64_t>(i) + 2);
    def.shape = i % 2 == 0 ? MakeShape(SphereShape{0.4}) : MakeShape(BoxShape{{0.4, 0.3, 0.5}});
    def.initial.position = {-20.0 + i % 20 * 2, 1 + 0.1 * (i % 7), -20.0 + i / 20 * 2.0};
    def.initial.angular_velocity = {0.3F * static_cast<float>(i % 5), 1, -0.5F};
    def.material.rolling_friction = def.material.spinning_friction = 0.02;
    scene->bodies.push_back(def);
  }
  PlayerRules& rules = scene->player.emplace();
  rules.body.shape = MakeShape(SphereShape{0.5});
  rules.spawn_points = {{30, 1, 30}};
  rules.max_force_n = 20;
  rules.max_speed_m_s = 5;
  return scene;
}

Config LogConfig(const std::shared_ptr<const Scene>& scene) {
  Config config;
  config.self = RegionId(1);
  config.incarnation = Incarnation(4);
  config.scene = scene;
  config.map = *MakeGridMap(scene->ground(), 1);
  return config;
}

// Flat ground, on which everything comes to rest.
class LogTest : public ::testing::Test {
 protected:
  LogTest() : scene(MakeScene(60)), region(LogConfig(scene)), standby_copy(RegionId(1), region.catalog()) {
    (void)region.Start();
    region.SetStandby(true);
  }
  Bytes StepOnce() { return region.Step().log; }

  std::shared_ptr<const Scene> scene;
  Region region;
  StandbyCopy standby_copy;
};

TEST_F(LogTest, TheStandbyIsTheRegionToTheBitAtEveryTick) {
  region.SpawnPlayer(PlayerNumber(1));
  for (std::uint32_t t = 1; t <= 200; ++t) {
    (void)region.QueueInput({.number = t,
                             .player = PlayerNumber(1),
                             .body = PlayerBodyId(PlayerNumber(1)),
                             .force_n = {10, 0, 0},
                             .torque_nm = {0, 1, 0}});
    if (t == 120) region.RemovePlayer(PlayerNumber(1));
    ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
    ASSERT_EQ(standby_copy.tick(), Tick(t));
    ASSERT_EQ(EncodeState(standby_copy.state()), region.SaveState()) << "tick " << t;
  }
  EXPECT_TRUE(standby_copy.state().controls.empty());
  EXPECT_FALSE(standby_copy.state().touching.empty());
}

// Numbers are not given again, so they grow beyond as many as may play at one time.
TEST_F(LogTest, PlayersOfAnyNumberAreTold) {
  region.SpawnPlayer(PlayerNumber(kMaxPlayers + 1));
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  region.SpawnPlayer(PlayerNumber(0xffffffff));
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  EXPECT_EQ(standby_copy.state().spawned, (std::vector{PlayerNumber(kMaxPlayers + 1), PlayerNumber(0xffffffff)}));
  region.SetStandby(true);
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  EXPECT_EQ(EncodeState(standby_copy.state()), region.SaveState());
}

// A region that replaces another takes over that it has made them: after a restore nobody makes them again.
TEST_F(LogTest, WhomAnEarlierLifeMadeIsNotMadeAgain) {
  region.MarkSpawned(PlayerNumber(7));
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  EXPECT_EQ(standby_copy.state().spawned, std::vector{PlayerNumber(7)});
  region.SpawnPlayer(PlayerNumber(7));
  (void)StepOnce();
  EXPECT_FALSE(region.Owns(PlayerBodyId(PlayerNumber(7))));
}

TEST_F(LogTest, SleepersCostNothing) {
  Bytes last;
  for (int t = 0; t < 1500 && region.asleep_count() < region.owned().size(); ++t) last = StepOnce();
  ASSERT_EQ(region.asleep_count(), region.owned().size());
  (void)StepOnce();
  last = StepOnce();
  EXPECT_LT(last.size(), 32U) << "header and checksum";
}

TEST_F(LogTest, AGapIsAnErrorAndLeavesTheLastWholeTick) {
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  const Bytes missed = StepOnce(), late = StepOnce();
  EXPECT_THAT(standby_copy.Receive(late).message(), HasSubstr("from tick 2 to 3, here is 1"));
  EXPECT_EQ(standby_copy.tick(), Tick(1));
  EXPECT_TRUE(standby_copy.Receive(missed).ok());
  EXPECT_TRUE(standby_copy.Receive(late).ok());
  EXPECT_TRUE(standby_copy.Receive(missed).ok()) << "what is here already is ignored";
  EXPECT_EQ(standby_copy.tick(), Tick(3));
}

TEST_F(LogTest, AWholeStateHealsAGap) {
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  (void)StepOnce();
  region.SetStandby(true);
  ASSERT_TRUE(standby_copy.Receive(StepOnce()).ok());
  EXPECT_EQ(EncodeState(standby_copy.state()), region.SaveState());
}

TEST_F(LogTest, ChangesNeedAWholeStateFirst) {
  (void)StepOnce();
  EXPECT_THAT(standby_copy.Receive(StepOnce()).message(), HasSubstr("before a whole state"));
  EXPECT_FALSE(standby_copy.whole());
}

TEST_F(LogTest, AnyDamageIsFoundAndChangesNothing) {
  const Bytes whole = StepOnce();
  ASSERT_TRUE(standby_copy.Receive(whole).ok());
  const Bytes changes = StepOnce(), state = region.SaveState();
  const Bytes before = EncodeState(standby_copy.state());
  for (const Bytes& message : {changes, state}) {
    for (std::size_t i = 0; i < message.size(); ++i) {
      Bytes damaged = message;
      damaged[i] ^= static_cast<std::uint8_t>(1 << i % 8);
      EXPECT_FALSE(standby_copy.Receive(damaged).ok()) << "byte " << i;
      const std::span<const std::uint8_t> cut = std::span(message).first(i);
      EXPECT_FALSE(standby_copy.Receive(cut).ok()) << "cut to " << i;
    }
  }
  EXPECT_EQ(EncodeState(standby_copy.state()), before);
}

TEST_F(LogTest, AnotherRegionsLogIsRefused) {
  StandbyCopy other(RegionId(2), region.catalog());
  EXPECT_THAT(other.Receive(StepOnce()).message(), HasSubstr("a log of region 1, here it is 2"));
}

TEST_F(LogTest, ARegionBeginsWithASavedState) {
  region.SpawnPlayer(PlayerNumber(1));
  for (int t = 0; t < 50; ++t) (void)StepOnce();
  const absl::StatusOr<RegionState> saved = DecodeState(region.SaveState(), region.catalog());
  ASSERT_TRUE(saved.ok()) << saved.status();
  Config config = LogConfig(scene);
  config.initial = std::make_shared<const RegionState>(*MergeStates({&*saved, 1}));
  Region again(config);
  (void)again.Start();
  EXPECT_EQ(again.tick(), Tick(50));
  EXPECT_EQ(again.SaveState(), region.SaveState());
  EXPECT_EQ(again.Step().tick, Tick(51));
}

TEST_F(LogTest, ASavedStateIsSharedOutAmongAnyNumberOfRegions) {
  for (int t = 0; t < 50; ++t) (void)StepOnce();
  const RegionState saved = *DecodeState(region.SaveState(), region.catalog());
  const RegionState merged = *MergeStates({&saved, 1});
  std::size_t owned = 0;
  for (std::uint32_t id = 1; id <= 3; ++id) {
    Config config = LogConfig(scene);
    config.self = RegionId(id);
    config.map = *MakeGridMap(scene->ground(), 3);
    config.initial = std::make_shared<const RegionState>(merged);
    owned += Region(config).owned().size();
  }
  EXPECT_EQ(owned, region.owned().size());
}

// A body stays with its owner until it is well beyond its cells: a checkpoint has it in the owner's state alone.
TEST_F(LogTest, ARegionTakesAllOfItsOwnStateWhereverItsBodiesLie) {
  for (int t = 0; t < 50; ++t) (void)StepOnce();
  const RegionState saved = *DecodeState(region.SaveState(), region.catalog());
  ASSERT_EQ(saved.region, region.id());
  Config config = LogConfig(scene);
  config.self = saved.region;
  config.map = *MakeGridMap(scene->ground(), 3);
  config.initial = std::make_shared<const RegionState>(saved);
  EXPECT_EQ(Region(config).owned().size(), region.owned().size());
}

TEST_F(LogTest, StatesOfDifferentTicksAreNotOneWorld) {
  RegionState a, b;
  a.region = RegionId(1), b.region = RegionId(2);
  a.tick = Tick(5), b.tick = Tick(6);
  EXPECT_THAT(MergeStates(std::vector{a, b}).status().message(), HasSubstr("region 2 is of tick 6"));
}

TEST(LogWireTest, EveryStateComesOutAsItWentIn) {
  BodyState base;
  base.position = {1, 2, 3};
  base.linear_velocity = {4, -5, 6};
  std::vector<BodyState> states(6, base);
  states[1].position.x = -0.0;
  states[2].linear_velocity.y = std::numeric_limits<float>::quiet_NaN();
  states[3].position.z = std::numeric_limits<double>::infinity();
  states[3].angular_momentum = {1e27F, -1e-30F, 0};
  states[4].orientation = {-1, 1e-300, 0, std::numeric_limits<double>::lowest()};
  states[5].asleep = true;
  states[5].still_s = 0.5F;
  for (const BodyState& state : states) {
    for (const BodyState* against : {static_cast<const BodyState*>(nullptr), static_cast<const BodyState*>(&base)}) {
      std::vector<std::uint8_t> bytes(kMaxStateBytes + 8);
      const auto* const end = PackState(bytes.data(), state, against, 1.0 / 60);
      const auto size = static_cast<std::size_t>(end - bytes.data());
      ASSERT_LE(size, kMaxStateBytes);
      BodyState read;
      EXPECT_EQ(UnpackState(std::span(bytes).first(size), against, 1.0 / 60, read), size);
      EXPECT_TRUE(SameBits(read, state));
      for (std::size_t cut = 0; cut < size; ++cut) {
        EXPECT_EQ(UnpackState(std::span(bytes).first(cut), against, 1.0 / 60, read), 0U);
      }
    }
  }
}

TEST(LogWireTest, FreeFlightCostsFewBytes) {
  BodyState base, state;
  base.position = {100.123, 20.5, -3.7};
  base.linear_velocity = {3, 0.5F, -2};
  state = base;
  state.linear_velocity.y -= 9.81F / 60;
  state.position += Vec3d(state.linear_velocity) * (1.0 / 60);
  std::vector<std::uint8_t> bytes(kMaxStateBytes + 8);
  EXPECT_LE(PackState(bytes.data(), state, &base, 1.0 / 60) - bytes.data(), 12);
}

}  // namespace
}  // namespace tessera::region

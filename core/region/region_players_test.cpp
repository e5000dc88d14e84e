// Players' queues, and the limits that the scene sets to what a player may do to its body.
#include "core/region/region_players.h"

#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>

#include "core/region/settings.h"

namespace tessera::region {
namespace {

constexpr float kHuge = 3e38F;
constexpr PlayerNumber kMember(3);

PlayerRules Rules() {
  PlayerRules rules;
  rules.max_force_n = 100;
  rules.max_speed_m_s = 8;
  return rules;
}

PlayerInput InputOf(std::uint32_t number) {
  PlayerInput input;
  input.number = number;
  input.player = kMember;
  input.body = PlayerBodyId(kMember);
  return input;
}

PlayerControl ControlWith(std::initializer_list<std::uint32_t> queued) {
  PlayerControl control;
  for (const std::uint32_t number : queued) control.queue.push_back(InputOf(number));
  return control;
}

TEST(PlayerLimitsTest, ForceIsScaledDownAndKeepsItsDirection) {
  EXPECT_EQ(LimitedForce(Rules(), {30, 40, 0}, {}), Vec3f(30, 40, 0));
  const Vec3f force = LimitedForce(Rules(), {kHuge, kHuge, 0}, {});
  EXPECT_NEAR(Length(force), 100, 1e-4);
  EXPECT_FLOAT_EQ(force.x, force.y);
}

TEST(PlayerLimitsTest, NobodyIsLiftedByMoreThanTheSceneAllows) {
  PlayerRules rules = Rules();
  rules.max_force_up_n = 10;
  EXPECT_EQ(LimitedForce(rules, {30, 9, 0}, {}), Vec3f(30, 9, 0));
  EXPECT_EQ(LimitedForce(rules, {30, 40, 0}, {}), Vec3f(30, 10, 0));
  EXPECT_EQ(LimitedForce(rules, {30, -40, 0}, {}), Vec3f(30, -40, 0));
  rules.up = {1, 0, 0};
  EXPECT_EQ(LimitedForce(rules, {30, 40, 0}, {}), Vec3f(10, 40, 0));
}

TEST(PlayerLimitsTest, ForceFadesAlongTheWayItGoesAndNeverBrakesLess) {
  EXPECT_FLOAT_EQ(LimitedForce(Rules(), {100, 0, 0}, {4, 0, 0}).x, 50);
  EXPECT_FLOAT_EQ(LimitedForce(Rules(), {100, 0, 0}, {9, 0, 0}).x, 0);
  EXPECT_FLOAT_EQ(LimitedForce(Rules(), {100, 0, 0}, {-9, 0, 0}).x, 100);
  EXPECT_FLOAT_EQ(LimitedForce(Rules(), {0, 0, 100}, {9, 0, 0}).z, 100);
}

TEST(PlayerLimitsTest, TorqueIsWhatTheForceDoesAtTheSurface) {
  EXPECT_FLOAT_EQ(LimitedTorque(Rules(), 0.5, {0, 20, 0}, {}).y, 20);
  EXPECT_NEAR(Length(LimitedTorque(Rules(), 0.5, {kHuge, -kHuge, kHuge}, {})), 50, 1e-4);
  EXPECT_FLOAT_EQ(LimitedTorque(Rules(), 0.5, {0, 20, 0}, {0, 8, 0}).y, 10);  // the surface moves by half the speed
  EXPECT_FLOAT_EQ(LimitedTorque(Rules(), 0.5, {0, 20, 0}, {0, 17, 0}).y, 0);
  EXPECT_FLOAT_EQ(LimitedTorque(Rules(), 0.5, {0, -20, 0}, {0, 17, 0}).y, -20);
}

// The last input of a character is held for a while when inputs are late, and then nothing is asked.
TEST(PlayersTest, ACharactersLastInputIsHeldForAWhile) {
  RegionPlayers players;
  players.Adopt(kMember, {});
  PlayerInput walk = InputOf(1);
  walk.move = {0, 1};
  walk.yaw_rad = 1;
  ASSERT_TRUE(players.Queue(walk).ok());
  int asked = 0;
  const auto walks = [&](const PlayerInput& input, const MovementState&) {
    asked += input.move == walk.move ? 1 : 0;
    EXPECT_EQ(input.yaw_rad, 1);  // it looks where it looked
    return Moved{{{5, 0, 0}, {}}, {}, {}};
  };
  for (int tick = 0; tick < 100; ++tick) {
    players.Commit(kMember, true, walks);
    EXPECT_EQ(players.Find(kMember)->committed, tick == 0);
    EXPECT_EQ(players.Find(kMember)->next.force_n, Vec3f(5, 0, 0));  // driven in every tick
    players.Applied(kMember);
    EXPECT_EQ(players.Find(kMember)->last_input, 1U);
    EXPECT_EQ(players.Find(kMember)->next.force_n, Vec3f());
  }
  EXPECT_EQ(asked, 1 + kMaxHeldTicks);
  players.Validate();
}

TEST(PlayersTest, AreAsTheyShouldBeWhateverIsAskedOfThem) {
  RegionPlayers players;
  players.Spawn(kMember);
  players.Park(kMember, true);
  players.Park(kMember, false);
  players.Adopt(kMember, ControlWith({2, 5}));
  players.QueueForwarded(InputOf(3));
  EXPECT_TRUE(players.Queue(InputOf(6)).ok());
  players.Validate();
  players.Commit(kMember, false, [](const PlayerInput&, const MovementState&) { return Moved{}; });
  players.Validate();
}

// Between a step and the next one, a body has the state that its last push left, and the one that the next push did.
TEST(PlayersTest, AMovementsStateGoesOnFromTickToTickAndEndsWithIt) {
  RegionPlayers players;
  players.Adopt(kMember, {});
  const auto counts = [](const PlayerInput&, const MovementState& before) {
    Moved moved{.drive = {}, .state = before, .error = {}};
    moved.state.body = BodyId(5);
    moved.state.size = 1;
    ++moved.state.bytes[0];
    return moved;
  };
  for (int tick = 0; tick < 3; ++tick) {
    players.Commit(kMember, true, counts);
    EXPECT_EQ(players.Find(kMember)->state.bytes[0], tick);
    EXPECT_EQ(players.Find(kMember)->next_state.bytes[0], tick + 1);
    players.Applied(kMember);
  }
  EXPECT_EQ(players.Find(kMember)->state.bytes[0], 3);
  players.Commit(kMember, false, counts);
  EXPECT_EQ(players.Find(kMember)->next_state, MovementState());
  EXPECT_EQ(players.Find(kMember)->state.bytes[0], 3) << "it acts until the next step";
}

TEST(PlayersTest, AQueueThatDoesNotAscendIsNoticed) {
  RegionPlayers players;
  players.Adopt(kMember, ControlWith({5, 2}));
  EXPECT_DEBUG_DEATH(players.Validate(), "");
}

// A torque that never ends turns a body no faster than its surface may move.
TEST(PlayerLimitsTest, NobodySpinsABodyUntilItIsAbsurd) {
  const double radius = 0.5, inertia = 0.4 * radius * radius;
  double spin = 0;
  for (int tick = 0; tick < 100'000; ++tick) {
    const Vec3f torque = LimitedTorque(Rules(), radius, {kHuge, 0, 0}, {static_cast<float>(spin), 0, 0});
    spin += static_cast<double>(torque.x) / inertia / 60;
  }
  EXPECT_LE(spin, 8 / radius + 50 / inertia / 60);
}

}  // namespace
}  // namespace tessera::region

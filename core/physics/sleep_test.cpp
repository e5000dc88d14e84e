// Bodies fall asleep and wake.
#include <gmock/gmock.h>

#include "core/physics/testing/bodies.h"
#include "core/physics/world.h"

namespace tessera::physics {
namespace {

std::vector<BodyDef> Tower() {
  return {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0}), Dynamic(3, Cube(), {0, 1.5, 0}),
          Dynamic(4, Cube(), {0, 2.5, 0}), Dynamic(9, Cube(), {2, 0.5, 0})};
}

TEST(SleepTest, TowerFallsAsleepAndAPushWakesAllOfItAndNothingElse) {
  World world({});
  AddAll(world, Tower());
  Simulate(world, 6);
  ASSERT_EQ(world.asleep_count(), 4u);
  EXPECT_EQ(world.StateOf(BodyId(3)).linear_velocity, Vec3f());
  EXPECT_TRUE(world.contacts().empty());  // nothing is solved
  world.ApplyImpulse(BodyId(4), {0.3f, 0, 0}, {});
  world.Step(kDt);
  EXPECT_EQ(world.asleep_count(), 1u);
  EXPECT_TRUE(world.StateOf(BodyId(9)).asleep);  // 1 m away: its bounds are near, it is not touched
}

TEST(SleepTest, RemovingWhatTheyLieOnWakesThem) {
  World world({});
  AddAll(world, Tower());
  Simulate(world, 6);
  world.Remove(BodyId(2));
  Simulate(world, 1.5);
  EXPECT_NEAR(world.StateOf(BodyId(4)).position.y, 1.5, 0.02);
}

TEST(SleepTest, TakingAwayWhatTheyLieOnWakesThem) {
  World world({});
  AddAll(world, Tower());
  Simulate(world, 6);
  BodyState away = world.StateOf(BodyId(2));
  away.position.x += 50;
  away.asleep = false;
  world.SetState(BodyId(2), away);
  Simulate(world, 1.5);
  EXPECT_NEAR(world.StateOf(BodyId(4)).position.y, 1.5, 0.02);
}

TEST(SleepTest, MovedGroundWakesWhatLiesOnIt) {
  World world({});
  AddAll(world, {Static(1, Box(5, 1, 5), {0, -1, 0}), Dynamic(2, Cube(), {0, 0.5, 0})});
  Simulate(world, 6);
  ASSERT_EQ(world.asleep_count(), 1u);
  BodyState lower;
  lower.position = {0, -3, 0};
  world.SetState(BodyId(1), lower);
  Simulate(world, 2);
  EXPECT_NEAR(world.StateOf(BodyId(2)).position.y, -1.5, 0.01);
}

TEST(SleepTest, SameOrCreepingStateLetsThemSleepAndARealOneWakesThem) {
  World world({});
  AddAll(world, Tower());
  Simulate(world, 6);
  BodyState state = world.StateOf(BodyId(3));
  state.asleep = false;
  world.SetState(BodyId(3), state);
  world.Step(kDt);
  EXPECT_EQ(world.asleep_count(), 4u);
  state.position.x += 1e-4;
  state.linear_velocity = {0.001f, 0, 0};
  world.SetState(BodyId(3), state);
  world.Step(kDt);
  EXPECT_EQ(world.asleep_count(), 4u);
  EXPECT_EQ(world.StateOf(BodyId(3)).position, state.position);
  for (int i = 0; i < 60 && world.asleep_count() == 4; ++i) {  // creeping on adds up
    state.position.x += 1e-4;
    world.SetState(BodyId(3), state);
  }
  world.Step(kDt);
  EXPECT_EQ(world.asleep_count(), 1u);
}

TEST(SleepTest, WakeWakesTheIsland) {
  World world({});
  AddAll(world, Tower());
  Simulate(world, 6);
  ASSERT_EQ(world.asleep_count(), 4u);
  world.Wake(BodyId(3));
  world.Step(kDt);
  EXPECT_EQ(world.asleep_count(), 1u);
}

TEST(SleepTest, IsPartOfAState) {
  World world({});
  BodyDef body = Dynamic(2, Ball(), {0, 10, 0});
  body.initial.asleep = true;
  world.Add(body, body.initial);
  Simulate(world, 1);
  EXPECT_EQ(world.asleep_count(), 1u);
  EXPECT_EQ(world.StateOf(body.id), body.initial);
  world.ApplyForce(body.id, {}, {});  // no force is no reason to wake
  EXPECT_EQ(world.asleep_count(), 1u);
  world.ApplyForce(body.id, {0, 0, 1}, {});
  EXPECT_EQ(world.asleep_count(), 0u);
  BodyState asleep = world.StateOf(body.id);
  asleep.asleep = true;
  world.SetState(body.id, asleep);
  EXPECT_EQ(world.asleep_count(), 1u);
}

TEST(SleepTest, NeverForABodyThatMayNotAndNeverInFlight) {
  World world({.gravity_m_s2 = {}});
  BodyDef awake = Dynamic(2, Ball(), {}), drifts = Dynamic(3, Ball(), {5, 0, 0});
  awake.may_sleep = false;
  drifts.initial.linear_velocity = {0.2f, 0, 0};
  AddAll(world, {awake, drifts});
  Simulate(world, 10);
  EXPECT_EQ(world.asleep_count(), 0u);
  EXPECT_NEAR(world.StateOf(drifts.id).position.x, 7, 1e-3);
}

TEST(SleepTest, WhatArrivesWakesWhatItHits) {
  World world({});
  AddAll(world, {Static(1, Ground()), Dynamic(2, Cube(), {0, 0.5, 0})});
  Simulate(world, 4);
  ASSERT_EQ(world.asleep_count(), 1u);
  BodyDef ball = Dynamic(3, Ball(0.3), {-3, 0.5, 0}, 2);
  ball.initial.linear_velocity = {8, 0, 0};
  world.Add(ball, ball.initial);
  Simulate(world, 1);
  EXPECT_GT(world.StateOf(BodyId(2)).position.x, 0.1);
}

}  // namespace
}  // namespace tessera::physics

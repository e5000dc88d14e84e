// Movements that games write: what they are told and asked for, and what is done about those that fail.
#include "core/physics/game_movement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "game_sdk/examples/car/car_movement.h"

namespace tessera::physics {
namespace {

constexpr BodyId kHovercraft = PlayerBodyId(PlayerNumber(1));
constexpr double kTick = 1.0 / 60;

using Act = int (*)(const tessera_movement_tick*, void*, tessera_movement_push*);

BodyDef Plane() {
  BodyDef def;
  def.id = BodyId(1);
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  def.shape = std::make_shared<const Shape>(Shape{PlaneShape{}});
  return def;
}

BodyDef Hull(Vec3d half, double mass_kg) {
  BodyDef def;
  def.id = kHovercraft;
  def.mass_kg = mass_kg;
  def.shape = std::make_shared<const Shape>(Shape{BoxShape{half}});
  return def;
}

// A box above a floor, and a movement of four bytes.
class GameMovementTest : public ::testing::Test {
 protected:
  GameMovementTest() {
    world.Add(Plane(), {});
    BodyState state;
    state.position = {0, 3, 0};
    world.Add(Hull({0.5, 0.5, 0.5}, 2), state);
  }
  MovementRun Run(Act act, const MovementState& before = {}) {
    table = {sizeof table, TESSERA_MOVEMENT_ABI, "hover", 1, 4, nullptr, act, nullptr};
    const GameMovement movement{"hover", 1, 4, std::nullopt, &table};
    return RunMovement(movement, world, {kHovercraft, input, {0, -9.81, 0}, kTick}, before);
  }
  void ExpectContained(Act act, const std::string& why) {
    MovementState before{.body = kHovercraft, .version = 1, .size = 4};
    before.bytes[0] = 7;
    const MovementRun run = Run(act, before);
    EXPECT_EQ(run.error, "movement hover: " + why);
    EXPECT_EQ(run.drive, CharacterDrive());
    EXPECT_EQ(run.state, before);
  }

  World world{WorldSettings{}};
  PlayerInput input;
  tessera_movement table{};
};

TEST_F(GameMovementTest, IsToldOfItsBodyAndAsksWhatIsAround) {
  input.move = {0.25F, -1};
  input.yaw_rad = 1;
  input.buttons = 5;
  const MovementRun run = Run([](const tessera_movement_tick* tick, void* state, tessera_movement_push* push) {
    const bool told = tick->mass_kg == 2 && tick->position[1] == 3 && tick->orientation[3] == 1 &&
                      tick->seconds == 1.0 / 60 && tick->gravity[1] == -9.81 && tick->move[0] == 0.25F &&
                      tick->move[1] == -1 && tick->yaw == 1 && tick->buttons == 5 && tick->body != 0 &&
                      std::abs(tick->inertia[0] - 2.0 / 6) < 1e-9;
    if (!told) return 2;
    const double up[3] = {0, 30, 0}, down[3] = {0, -30, 0};
    tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
    if (tick->sweep(tick->call, tick->position, up, 0.1, &hit) != 0) return 3;
    if (tick->sweep(tick->call, tick->position, down, 0.1, &hit) != 1) return 4;
    if (hit.body != 1 || hit.normal[1] < 0.99 || hit.mass_kg != 0 || std::abs(hit.center[1] - 0.1) > 0.002) return 5;
    push->force[1] = 30;
    push->torque[2] = -0.5;
    static_cast<std::uint8_t*>(state)[3] = 9;
    return 0;
  });
  EXPECT_EQ(run.error, "");
  EXPECT_EQ(run.drive, (CharacterDrive{{0, 30, 0}, {0, 0, -0.5F}}));
  EXPECT_EQ(run.state.body, kHovercraft);
  EXPECT_EQ(run.state.bytes[3], 9);
}

TEST_F(GameMovementTest, WhatItCannotAnswerForIsContained) {
  ExpectContained(
      [](const tessera_movement_tick*, void* state, tessera_movement_push* push) {
        static_cast<std::uint8_t*>(state)[0] = 1;
        push->force[0] = 5;
        return 3;
      },
      "returned 3");
  ExpectContained(
      [](const tessera_movement_tick*, void*, tessera_movement_push* push) {
        push->force[2] = std::numeric_limits<double>::quiet_NaN();
        return 0;
      },
      "force is not finite");
  ExpectContained(
      [](const tessera_movement_tick*, void*, tessera_movement_push* push) {
        push->torque[0] = -std::numeric_limits<double>::infinity();
        return 0;
      },
      "torque is not finite");
  ExpectContained(
      [](const tessera_movement_tick*, void*, tessera_movement_push*) -> int { throw std::runtime_error("no petrol"); },
      "threw no petrol");
  ExpectContained([](const tessera_movement_tick*, void*, tessera_movement_push*) -> int { throw 7; },
                  "threw what is no std::exception");
  ExpectContained(
      [](const tessera_movement_tick*, void* state, tessera_movement_push*) {
        static_cast<std::uint8_t*>(state)[4] = 1;
        return 0;
      },
      "wrote beyond the 4 bytes of its state");
}

TEST_F(GameMovementTest, AWrongSweepFailsTheCallAndSaysWhy) {
  ExpectContained(
      [](const tessera_movement_tick* tick, void*, tessera_movement_push*) {
        const double nowhere[3] = {0, std::numeric_limits<double>::quiet_NaN(), 0};
        tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
        return tick->sweep(tick->call, tick->position, nowhere, 0.1, &hit) == -1 ? 0 : 9;
      },
      "sweep: from or to is not finite");
  ExpectContained(
      [](const tessera_movement_tick* tick, void*, tessera_movement_push*) {
        const double far[3] = {2000, 0, 0};
        tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
        return tick->sweep(tick->call, tick->position, far, 0.1, &hit) == -1 ? 0 : 9;
      },
      "sweep: is longer than 1000 m");
  ExpectContained(
      [](const tessera_movement_tick* tick, void*, tessera_movement_push*) {
        tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
        return tick->sweep(tick->call, tick->position, tick->position, 0, &hit) == -1 ? 0 : 9;
      },
      "sweep: radius_m is not within .001 to 10");
  ExpectContained(
      [](const tessera_movement_tick* tick, void*, tessera_movement_push*) {
        tessera_movement_hit unset{};
        return tick->sweep(tick->call, tick->position, tick->position, 0.1, &unset) == -1 ? 0 : 9;
      },
      "sweep: hit is NULL, or its size is not set");
  ExpectContained(
      [](const tessera_movement_tick* tick, void*, tessera_movement_push*) {
        tessera_movement_hit hit = TESSERA_MOVEMENT_HIT;
        for (int i = 0; i <= TESSERA_MAX_MOVEMENT_SWEEPS; ++i) {
          tick->sweep(tick->call, tick->position, tick->position, 0.1, &hit);
        }
        return 0;
      },
      "sweep: more than 64 in one call");
}

TEST_F(GameMovementTest, ItPushesNoHarderThanTheEngineCanBear) {
  const MovementRun run = Run([](const tessera_movement_tick*, void*, tessera_movement_push* push) {
    push->force[0] = 1e300;
    push->force[1] = -1e300;
    push->torque[1] = 1e308;
    return 0;
  });
  EXPECT_EQ(run.error, "");
  EXPECT_NEAR(Length(run.drive.force_n) / 2e4, 1, 1e-6);
  EXPECT_EQ(run.drive.force_n.x, -run.drive.force_n.y);
  EXPECT_NEAR(static_cast<double>(run.drive.torque_nm.y) / (1e4 * 2 / 6), 1, 1e-6);
}

// Whoever sleeps stays asleep until something is asked.
TEST_F(GameMovementTest, ASleeperIsMovedOnlyWhereSomethingIsAsked) {
  BodyState state;
  state.position = {0, 0.5, 0};
  state.asleep = true;
  world.SetState(kHovercraft, state);
  const Act act = [](const tessera_movement_tick*, void*, tessera_movement_push* push) {
    push->force[0] = 1;
    return 0;
  };
  EXPECT_EQ(Run(act).drive, CharacterDrive());
  input.buttons = 1;
  EXPECT_EQ(Run(act).drive.force_n.x, 1);
  input.buttons = 0;
  world.Park(kHovercraft);
  EXPECT_EQ(Run(act).drive, CharacterDrive());
}

// The example against closed forms.
class CarTest : public ::testing::Test {
 protected:
  CarTest() {
    world.Add(Plane(), {});
    BodyState above;
    above.position = {0, 1, 0};
    world.Add(Hull({0.9, 0.3, 2}, kMass), above);
  }
  void Drive(double seconds) {
    for (int i = 0; i < std::lround(seconds * 60); ++i) {
      const MovementRun run = RunMovement(car, world, {kHovercraft, input, {0, -9.81, 0}, kTick}, state);
      ASSERT_EQ(run.error, "");
      state = run.state;
      world.ApplyForce(kHovercraft, run.drive.force_n, run.drive.torque_nm);
      world.Step(kTick);
    }
  }
  BodyState Now() const { return world.StateOf(kHovercraft); }

  static constexpr double kMass = 1200;
  const GameMovement car{"car", 1, sizeof(car_state), std::nullopt, &car_movement};
  World world{WorldSettings{}};
  PlayerInput input;
  MovementState state;
};

TEST_F(CarTest, StandsOnItsSpringsAsHighAsTheyAreStiff) {
  Drive(4);
  const double pressed = kMass * 9.81 / 4 / car_stiffness;
  EXPECT_NEAR(Now().position.y, car_travel - pressed + car_radius - car_mount, 0.01);
  EXPECT_LT(Length(Vec3d(Now().linear_velocity)), 0.01);
}

TEST_F(CarTest, DrivesForwardTurnsAndStops) {
  Drive(2);
  input.move = {0, 1};
  Drive(2);
  const double fast = -static_cast<double>(Now().linear_velocity.z);
  EXPECT_NEAR(fast, 2 * car_power / kMass, 1.5);  // less what the air takes
  EXPECT_NEAR(Now().position.x, 0, 0.01);
  input.move = {1, 0.5F};
  Drive(1);
  EXPECT_GT(Now().position.x, 0.5);  // to the right
  EXPECT_LT(Now().angular_velocity.y, -0.2F);
  input.move = {0, 0};
  input.buttons = 1;
  Drive(5);
  EXPECT_LT(Length(Vec3d(Now().linear_velocity)), 0.05);
  EXPECT_GT(Rotate(Now().orientation, Vec3d(0, 1, 0)).y, 0.99) << "it has not rolled over";
}

}  // namespace
}  // namespace tessera::physics

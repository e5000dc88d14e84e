// Bodies that a game's own function moves, predicted by the same function: the example's car, over a network as bad as
// the character's in prediction_test.cpp.
#include <gtest/gtest.h>

#include <cstring>

#include "client_sdk/include/tessera/tessera.h"  // a program may be a client and hold a game
#include "client_sdk/prediction_loop.h"
#include "game_sdk/examples/car/car_movement.h"

namespace tessera::client::prediction {
namespace {

constexpr const char* kCar =
    "player { body { kind: \"car\" mass: 1200 shape { box { half_extents { x: 0.9 y: 0.3 z: 2 } } } } "
    "spawn_points { y: 1 } max_force: 1 max_speed: 50 }";

// A game of nothing but a movement.
tessera_game_module ModuleOf(const tessera_movement* movement) {
  return {sizeof(tessera_game_module),
          TESSERA_GAME_ABI,
          [](const tessera_game_host*, const tessera_game_source*, void**, tessera_game_error*) { return 0; },
          [](void*) {},
          [](const void*, std::uint32_t, const char*) { return 0; },
          [](void*, tessera_game_call*, const tessera_game_callback*, tessera_game_error*) { return 0; },
          movement};
}

// Gas, brake and wheel, another way every half second, back to the middle before it gets too far.
PlayerInput DriveStep(int step, const BodyState& own) {
  PlayerInput input;
  const bool far = std::hypot(own.position.x, own.position.z) > 25;
  const Vec3d home = Rotate(Conjugate(own.orientation), Vec3d() - own.position);
  const float wheel = far ? (home.x > 0 ? 1.0F : -1.0F) : std::array{0.6F, -1.0F, 0.0F, 0.9F, -0.4F}[step % 5];
  input.move = {wheel, step % 9 == 8 ? -0.7F : 0.7F};
  // The move vector is at most 1 long.
  if (Length(Vec3d(input.move.x, input.move.y, 0)) > 1) input.move = {wheel * 0.7F, input.move.y};
  input.buttons = step % 11 == 10 ? 1 : 0;
  return input;
}

Figures DriveAbout(Loop& loop, double seconds) {
  loop.Run(3);  // the car settles, and the clock of inputs finds its pace
  const Tick from = loop.region.tick();
  const std::uint64_t before = loop.predictor.corrections();
  for (int step = 0; step < static_cast<int>(seconds * 2); ++step) {
    loop.steering = DriveStep(step, loop.predictor.own());
    loop.Run(0.5, [&] { loop.ShownOwn(); });
  }
  EXPECT_GT(Rotate(loop.region.world().StateOf(kOwn).orientation, Vec3d(0, 1, 0)).y, 0.7) << "it has not rolled over";
  return {seconds, loop.TimesOff(from + 12), loop.predictor.corrections() - before, loop.WorstSince(from + 12)};
}

class MovementPredictionTest : public ::testing::Test {
 protected:
  tessera_game_module module_ = ModuleOf(&car_movement);
};

// Each tick that the client predicts from unrounded states is the server's, to the bit, and so is what the function
// remembers.
TEST_F(MovementPredictionTest, TheSameInputsGiveTheSameBits) {
  Loop loop("", {.delay = milliseconds(50)}, kCar, &module_);
  ASSERT_TRUE(loop.predictor.SetMovement(&car_movement).ok());
  std::map<Tick, MovementState> predicted, came;
  loop.before_step = [&] {
    if (const auto moved = loop.region.MovementOf(kPlayer)) came[loop.region.tick()] = moved->state;
  };
  loop.Run(3);
  const Tick from = loop.region.tick() + 12;
  const std::uint64_t before = loop.predictor.corrections();  // until the clock of inputs has found its pace
  for (int step = 0; step < 20; ++step) {
    loop.steering = DriveStep(step, loop.predictor.own());
    loop.Run(0.5, [&] { predicted[loop.predictor.tick()] = loop.predictor.own_movement(); });
  }
  EXPECT_GT(Length(loop.truth.rbegin()->second), 5) << "it has driven";
  EXPECT_GT(Rotate(loop.region.world().StateOf(kOwn).orientation, Vec3d(0, 1, 0)).y, 0.7) << "it has not rolled over";
  int compared = 0;
  for (auto it = predicted.lower_bound(from); it != predicted.end(); ++it) {
    if (!came.contains(it->first)) continue;
    ++compared;
    ASSERT_EQ(it->second, came.at(it->first)) << it->first;
    ASSERT_EQ(loop.predicted.at(it->first), loop.truth.at(it->first)) << it->first;
  }
  EXPECT_GT(compared, 500);
  EXPECT_EQ(loop.predictor.corrections(), before);
  EXPECT_EQ(loop.refused, 0U);
  EXPECT_TRUE(loop.region.game()->TakeLines().empty());
}

TEST_F(MovementPredictionTest, ACarIsOffAFewTimesInTenSecondsAtMost) {
  for (const bool loses : {false, true}) {
    Loop loop(kCourse, kBadNetwork, kCar, &module_);
    loop.rounds = true;
    loop.loses_movements = loses;
    ASSERT_TRUE(loop.predictor.SetMovement(&car_movement).ok());
    const Figures figures = DriveAbout(loop, 60);
    std::printf("car: %.0f s, off by more than 1 cm %d times, %d corrections, at worst %.3f m\n", figures.seconds,
                figures.off, static_cast<int>(figures.corrections), figures.worst_m);
    EXPECT_LE(figures.off, 18) << loses;
    EXPECT_EQ(loop.refused, 0U);
  }
}

// Without the function, or with another version, nothing is predicted, and that is said once.
TEST_F(MovementPredictionTest, WithoutTheFunctionItIsShownAsTheServerHasIt) {
  tessera_movement newer = car_movement;
  newer.version = 2;
  for (const tessera_movement* has :
       {static_cast<const tessera_movement*>(nullptr), static_cast<const tessera_movement*>(&newer)}) {
    Loop loop("", {.delay = milliseconds(50)}, kCar, &module_);
    ASSERT_TRUE(loop.predictor.SetMovement(has).ok());
    loop.steering.move = {0, 1};
    std::vector<std::string> said;
    bool shown = false;
    loop.Run(2, [&] {
      if (std::string why = loop.predictor.TakeMissingMovement(); !why.empty()) said.push_back(std::move(why));
      shown = shown || !loop.predictor.At(loop.now, 1).empty();
    });
    ASSERT_EQ(said.size(), 1U);
    const std::string world = "the world moves body " + std::to_string(kOwn.value()) +
                              " by movement car version 1 with 20 bytes of state; this program has ";
    EXPECT_EQ(said[0], world + (has == nullptr ? "none" : "car version 2 with 20"));
    EXPECT_FALSE(shown);
    EXPECT_FALSE(loop.predictor.running());
    EXPECT_LT(loop.truth.rbegin()->second.z, -3) << "it drives all the same";
    // It gets the right one later on.
    ASSERT_TRUE(loop.predictor.SetMovement(&car_movement).ok());
    loop.Run(1);
    EXPECT_TRUE(loop.predictor.running());
  }
}

TEST_F(MovementPredictionTest, AWorldWithoutAMovementIsPredictedAsItsSceneSays) {
  Loop loop("", {.delay = milliseconds(50)}, kCharacter);
  EXPECT_EQ(loop.predictor.SetMovement(&car_movement).message(), "movement car: kind: the scene has no kind \"car\"");
  tessera_movement all = car_movement;
  all.kind = nullptr;
  ASSERT_TRUE(loop.predictor.SetMovement(&all).ok());
  loop.steering.move = {0, 1};
  loop.Run(2);
  const Tick from = loop.region.tick();
  loop.Run(2);
  EXPECT_LT(loop.WorstSince(from), 0.001);
  EXPECT_EQ(loop.predictor.own_movement(), MovementState());
}

}  // namespace
}  // namespace tessera::client::prediction

// The causes of corrections, each by the one fact that is different.
#include "client_sdk/correction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client_sdk/predictor.h"
#include "core/world/scene_io.h"

namespace tessera::client {
namespace {

constexpr PlayerNumber kRoller{1};
constexpr BodyId kRollersBody = PlayerBodyId(kRoller);
constexpr BodyId kCrate{2};

// A ball that flies along x at 3 m/s without weight, seen at tick 10, and six inputs that have not acted.
class CorrectionTest : public testing::Test {
 protected:
  CorrectionTest() {
    const auto written = ParseScene(R"(name: "floor"
      bounds { min { x: -50 y: -5 z: -50 } max { x: 50 y: 50 z: 50 } }
      bodies { id: 1 motion: MOTION_STATIC pose { position { y: -0.5 } }
               shape { box { half_extents { x: 50 y: 0.5 z: 50 } } } }
      bodies { id: 2 mass: 1 pose { position { x: 20 y: 0.5 } }
               shape { box { half_extents { x: 0.5 y: 0.5 z: 0.5 } } } }
      player { body { mass: 2 shape { sphere { radius: 0.5 } } } spawn_points { y: 0.5 } max_force: 30
               max_speed: 8 })",
                                    "floor.textproto");
    EXPECT_TRUE(written.ok()) << written.status();
    predictor_.emplace(*ResolveScene(*written, "floor.textproto"), kRoller);
    Put(kRollersBody, 0);
    Put(kCrate, 20);
  }
  void Put(BodyId id, double x, RegionId region = RegionId(1), Tick tick = Tick(10)) {
    SeenBody& body = seen_[id];
    body = {id, region, Epoch(1), tick, {}};
    body.tuning.gravity_scale = 0.0f;
    body.state.position = {x, 5, 0};
    if (id == kRollersBody) body.state.linear_velocity = {3, 0, 0};
  }
  void Begin() {
    WorkBudget budget(100'000);
    predictor_->Prepare(seen_.at(kRollersBody).state, budget);
    predictor_->Correct(Tick(10), 0, seen_);
    for (std::uint32_t number = 1; number <= 6; ++number) {
      PlayerInput input;
      input.number = number;
      input.player = kRoller;
      input.body = kRollersBody;
      predictor_->Add(input);
    }
  }
  // Two ticks later the ball is at x, after so many inputs.
  std::vector<Correction> Later(double x, std::uint32_t last_input, RegionId region = RegionId(1)) {
    Put(kRollersBody, x, region, Tick(12));
    predictor_->Correct(Tick(12), last_input, seen_);
    return predictor_->TakeCorrections();
  }

  static constexpr double kTwoTicks_m = 3 * 2 / 60.0;
  std::optional<Predictor> predictor_;
  std::map<BodyId, SeenBody> seen_;
};

TEST_F(CorrectionTest, ThereIsNoneWhereThePredictionHolds) {
  Begin();
  EXPECT_TRUE(Later(kTwoTicks_m, 2).empty());
}

TEST_F(CorrectionTest, InputsThatActLateAreNamed) {
  Begin();
  const auto corrections = Later(kTwoTicks_m, 0);
  ASSERT_EQ(corrections.size(), 1u);
  EXPECT_EQ(corrections[0].cause, Correction::Cause::kInputs);
  EXPECT_EQ(corrections[0].late, 2);
  EXPECT_EQ(corrections[0].tick, Tick(12));
  EXPECT_NEAR(corrections[0].off_m, kTwoTicks_m, 0.02);
  EXPECT_THAT(Describe(corrections[0]), testing::HasSubstr(" m: 2 inputs acted late"));
  EXPECT_TRUE(predictor_->TakeCorrections().empty()) << "each is given once";
}

TEST_F(CorrectionTest, ANewOwnerIsNamed) {
  Begin();
  const auto corrections = Later(kTwoTicks_m + 0.2, 2, RegionId(3));
  ASSERT_EQ(corrections.size(), 1u);
  EXPECT_EQ(corrections[0].cause, Correction::Cause::kOwner);
  EXPECT_EQ(Describe(corrections[0]), "0.20 m: region 1 moved it before");
}

TEST_F(CorrectionTest, ABodyThatItMetIsNamed) {
  Put(kCrate, 1.05);
  Begin();
  const auto corrections = Later(kTwoTicks_m - 0.2, 2);
  ASSERT_EQ(corrections.size(), 1u);
  EXPECT_EQ(corrections[0].cause, Correction::Cause::kMeeting);
  EXPECT_EQ(corrections[0].met, kCrate);
  EXPECT_THAT(Describe(corrections[0]), testing::HasSubstr("it met body 2"));
}

TEST_F(CorrectionTest, NothingIsInventedWhereTheCauseIsNotKnown) {
  Begin();
  const auto corrections = Later(kTwoTicks_m + 0.2, 2);
  ASSERT_EQ(corrections.size(), 1u);
  EXPECT_EQ(corrections[0].cause, Correction::Cause::kUnknown);
  EXPECT_EQ(Describe(corrections[0]), "0.20 m: nothing known here explains it");
}

TEST_F(CorrectionTest, OnlyTheOldestAreKeptForWhoDoesNotAsk) {
  Begin();
  for (std::uint64_t tick = 12; tick < 212; ++tick) {
    Put(kRollersBody, tick % 2 == 0 ? 1 : -1, RegionId(1), Tick(tick));
    predictor_->Correct(Tick(tick), 0, seen_);
  }
  EXPECT_EQ(predictor_->TakeCorrections().size(), 64u);
  EXPECT_GT(predictor_->corrections(), 64u);
}

}  // namespace
}  // namespace tessera::client

// A client that does not predict has a Prediction all the same.
#include <gtest/gtest.h>

#include <vector>

#include "client_sdk/prediction.h"
#include "client_sdk/testing/test_now.h"

namespace tessera::client {
namespace {

TEST(WithoutPredictionTest, NothingIsShownOtherwiseAndNothingIsDone) {
  Prediction prediction;
  const OwnBody own(PlayerNumber(1));
  const WorldView world(60, 2);
  const WorldClock clock{.paused = false, .ticks_per_second = 60};
  WorkBudget budget(100);
  std::vector<ClientEvent> events;
  prediction.Add({});
  prediction.Heard(kTestNow, std::pair(Tick(10), 1U));
  prediction.Correct(own, world, budget, events);
  prediction.ExpireThrown(kTestNow, clock, world, events);
  prediction.DropThrown(world, events);
  prediction.Forget();
  EXPECT_TRUE(events.empty());
  EXPECT_EQ(budget.spent(), 0);

  std::vector<ShownBody> shown(1);
  shown[0].id = own.id();
  shown[0].pose.position = {1, 2, 3};
  prediction.Show(kTestNow, 0.5, clock, world, shown);
  ASSERT_EQ(shown.size(), 1U);
  EXPECT_EQ(shown[0].pose.position, Vec3d(1, 2, 3));
  EXPECT_FALSE(shown[0].predicted);
  EXPECT_FALSE(shown[0].extrapolated);
}

TEST(WithoutPredictionTest, EveryBodyMayBeTheOwnOne) {
  const Prediction prediction;
  EXPECT_TRUE(prediction.Knows(BodyId(7)));
  EXPECT_FALSE(prediction.on());
  EXPECT_FALSE(prediction.running());
  EXPECT_FALSE(prediction.NeedsInputs());
  EXPECT_EQ(prediction.thrown(), 0U);
  ClientStats stats;
  prediction.AddTo(stats);
  EXPECT_FALSE(stats.predicting);
}

}  // namespace
}  // namespace tessera::client

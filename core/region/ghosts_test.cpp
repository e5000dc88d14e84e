#include "core/region/ghosts.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

// Region 1 of four, whose neighbours are 2, 3 and 4.
class GhostsTest : public ::testing::Test {
 protected:
  void Report(std::size_t neighbor, std::uint64_t id, Epoch epoch) {
    GhostRecord record;
    record.id = BodyId(id);
    record.epoch = epoch;
    frames[neighbor].ghosts.push_back(record);
  }
  std::vector<Ghost> Result() {
    return GhostsFrom(
        frames, world.neighborhood.neighbors(), [this](std::size_t n) { return up[n]; }, world.bodies);
  }

  SmallWorld world{Balls({{1, 0, 0}, {1, 0, 2}, {1, 0, 4}}), 4};
  std::vector<BorderFrame> frames{3};
  std::vector<bool> up = {true, true, true};
};

TEST_F(GhostsTest, AscendByBodyAndKnowTheirOwners) {
  Report(0, 3, Epoch(1));
  Report(1, 1, Epoch(1));
  const std::vector<Ghost> ghosts = Result();
  ASSERT_EQ(ghosts.size(), 2U);
  EXPECT_EQ(ghosts[0].record.id, BodyId(1));
  EXPECT_EQ(ghosts[0].owner, RegionId(3));
  EXPECT_EQ(ghosts[1].owner, RegionId(2));
  EXPECT_TRUE(ghosts[1].reported);
}

TEST_F(GhostsTest, OfABodyThatTwoReportTheHigherEpochCounts) {
  Report(0, 2, Epoch(4));
  Report(2, 2, Epoch(5));
  ASSERT_EQ(Result().size(), 1U);
  EXPECT_EQ(Result()[0].owner, RegionId(4));
}

TEST_F(GhostsTest, AnOwnedBodyIsNobodysGhost) {
  world.Own(2);
  Report(0, 2, Epoch(1));
  EXPECT_TRUE(Result().empty());
}

TEST_F(GhostsTest, GhostsOfANeighbourWhoseLinkIsDownGoOnByThemselves) {
  BodyState moving = world.InitialOf(1);
  moving.linear_velocity = {6, 0, 0};
  world.AddGhost(1, 2, moving);
  world.Step();
  EXPECT_TRUE(Result().empty());
  up[0] = false;
  ASSERT_EQ(Result().size(), 1U);
  EXPECT_FALSE(Result()[0].reported);
  EXPECT_NEAR(Result()[0].record.state.position.x, 1.1, 1e-6);
}

}  // namespace
}  // namespace tessera::region

#include "core/region/claims.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

const std::vector<RegionId> kOnlyNeighbor = {RegionId(2)};

class ClaimsTest : public ::testing::Test {
 protected:
  ClaimsTest() {
    frame.sender = RegionId(2);
    world.Own(1);
    world.AddGhost(2, 2, world.InitialOf(2), Epoch(3));
  }
  void Report(std::uint64_t id) {
    frame.ghosts.emplace_back();
    frame.ghosts.back().id = BodyId(id);
  }
  void GrantBody(std::uint64_t id, Epoch epoch) {
    frame.grants.push_back({{{BodyId(id), epoch, world.InitialOf(id), {}}}, {}, {}});
  }
  std::string Error() const { return std::string(CheckClaims(frame, world.bodies, departing, grants_in).message()); }

  SmallWorld world{Balls({{-1, 0, 0}, {1, 0, 0}})};
  GrantsIn grants_in{kOnlyNeighbor};
  std::vector<DepartingBody> departing;
  BorderFrame frame;
};

TEST_F(ClaimsTest, ANeighbourMayNotReportOrGrantABodyThatIsOwnedHere) {
  Report(1);
  EXPECT_EQ(Error(), "body 1 is owned here");
  frame.ghosts.clear();
  GrantBody(1, Epoch(2));
  EXPECT_EQ(Error(), "body 1 is owned here and granted");
}

TEST_F(ClaimsTest, ADepartingBodyMayBeItsNewOwnersAlready) {
  departing.emplace_back();
  departing[0].record.id = BodyId(1);
  Report(1);
  EXPECT_EQ(Error(), "");
}

TEST_F(ClaimsTest, AGrantNeedsAHigherEpochThanTheLast) {
  GrantBody(2, Epoch(3));
  EXPECT_EQ(Error(), "body 2 is granted with epoch 3 after 3");
  frame.grants.clear();
  GrantBody(2, Epoch(4));
  EXPECT_EQ(Error(), "");
}

TEST_F(ClaimsTest, ARepeatedGrantClaimsNothingNew) {
  GrantBody(1, Epoch(1));  // owned here by epoch 1
  EXPECT_EQ(Error(), "");
}

}  // namespace
}  // namespace tessera::region

#include "core/region/grants_out.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

class GrantsOutTest : public ::testing::Test {
 protected:
  static Scene Jointed() {
    Scene scene = Balls({{-1, 0, 0}, {-3, 0, 0}, {-5, 0, 0}});
    Join(scene, 1, 2);
    return scene;
  }
  PreparedGrant Prepared(std::vector<std::uint64_t> ids, RegionId to, Epoch epoch) const {
    PreparedGrant grant;
    grant.to = to;
    for (const std::uint64_t id : ids) {
      DepartingBody body;
      body.record.id = BodyId(id);
      body.record.epoch = epoch;
      body.to = to;
      grant.departing.push_back(body);
      grant.copies.push_back({{BodyId(id), epoch}, {to, Tick(7), world.InitialOf(id), {}, {}, {}}});
    }
    return grant;
  }
  std::vector<std::uint64_t> Repeated(RegionId to) const {
    std::vector<std::uint64_t> ids;
    for (const Grant& grant : grants.Repeated(to, world.bodies)) {
      for (const GrantedBody& body : grant.bodies) ids.push_back(body.id.value());
    }
    return ids;
  }

  SmallWorld world{Jointed()};
  GrantsOut grants{world.catalog};
};

TEST_F(GrantsOutTest, DecisionsOfAStepTakeThePlaceOfTheLastAndCopiesStay) {
  for (const std::uint64_t id : {1, 2, 3}) world.Own(id);
  grants.Decide({Prepared({3}, kThree, Epoch(2)), Prepared({1, 2}, kTwo, Epoch(2))});
  grants.Validate(world.bodies);
  ASSERT_EQ(grants.departing().size(), 3U);
  EXPECT_EQ(FindDeparting(grants.departing(), BodyId(3))->to, kThree);
  EXPECT_TRUE(DepartsTo(grants.departing(), BodyId(2), kTwo));
  grants.Decide({});
  EXPECT_TRUE(grants.departing().empty());
  EXPECT_EQ(grants.kept().size(), 3U);
}

TEST_F(GrantsOutTest, OnlyTheNewOwnersAcknowledgementDropsACopy) {
  grants.Decide({Prepared({3}, kTwo, Epoch(2))});
  EXPECT_FALSE(grants.Acknowledged(kThree, {BodyId(3), Epoch(2)}));
  EXPECT_FALSE(grants.Acknowledged(kTwo, {BodyId(3), Epoch(4)}));
  EXPECT_TRUE(grants.Acknowledged(kTwo, {BodyId(3), Epoch(2)}));
  EXPECT_TRUE(grants.kept().empty());
}

TEST_F(GrantsOutTest, ABodyThatCameBackNeedsNoEarlierCopies) {
  grants.Decide({Prepared({3}, kTwo, Epoch(2))});
  grants.Decide({Prepared({3}, kTwo, Epoch(4))});
  grants.ForgetBefore(BodyId(3), Epoch(3));
  ASSERT_EQ(grants.kept().size(), 1U);
  EXPECT_EQ(grants.kept().begin()->first.second, Epoch(4));
}

TEST_F(GrantsOutTest, TheNewestGrantsAreRepeatedAssemblyByAssembly) {
  grants.Decide({Prepared({3}, kTwo, Epoch(2))});
  grants.Decide({Prepared({3}, kThree, Epoch(4)), Prepared({1, 2}, kTwo, Epoch(2))});
  EXPECT_THAT(Repeated(kTwo), ::testing::ElementsAre(1, 2));
  EXPECT_EQ(grants.Repeated(kTwo, world.bodies).size(), 1U);
  EXPECT_THAT(Repeated(kThree), ::testing::ElementsAre(3));
  world.Own(3, world.InitialOf(3), Epoch(5));
  EXPECT_TRUE(Repeated(kThree).empty());
}

TEST_F(GrantsOutTest, ABodyThatWentOnHereIsRepeatedAsItIsNow) {
  grants.Decide({Prepared({3}, kTwo, Epoch(2))});
  BodyState moved = world.InitialOf(3);
  moved.position.x = -7;
  world.AddGhost(3, 2, moved, Epoch(2));
  EXPECT_EQ(grants.Repeated(kTwo, world.bodies)[0].bodies[0].state.position.x, -7);
}

TEST_F(GrantsOutTest, AFailoverLeavesOnlyWhatIsStillNeeded) {
  grants.Decide({Prepared({3}, kTwo, Epoch(2))});
  grants.Settle({});
  EXPECT_TRUE(grants.departing().empty() && grants.kept().empty());
}

}  // namespace
}  // namespace tessera::region

#include "core/region/borders.h"

#include <gtest/gtest.h>

namespace tessera::region {
namespace {

std::shared_ptr<const Scene> EmptyScene() { return std::make_shared<const Scene>(); }

std::vector<std::uint8_t> FrameOf(RegionId sender, MapVersion map, MapVersion committed) {
  BorderFrame frame;
  frame.tick = Tick(9);
  frame.sender = sender;
  frame.map_version = map;
  frame.committed_version = committed;
  return Encode(frame, {});
}

// A newcomer goes by the map that it is to join before anybody has committed it.
TEST(BordersTest, FramesByTheNextMapCommitItOnlyIfTheySaySo) {
  const Catalog catalog(EmptyScene());
  const RegionId self(1), other(2), newcomer(3);
  Borders borders(self, std::vector{other}, MapVersion(4), catalog);
  borders.Expect(MapVersion(5), std::vector{other, newcomer});
  const BorderFrame* taken = nullptr;
  ASSERT_TRUE(borders.Put(newcomer, FrameOf(newcomer, MapVersion(5), MapVersion()), Tick(3), &taken).ok());
  EXPECT_EQ(taken, nullptr);
  EXPECT_EQ(borders.newest_commit(), MapVersion());
  ASSERT_TRUE(borders.Put(other, FrameOf(other, MapVersion(5), MapVersion(5)), Tick(3), &taken).ok());
  EXPECT_EQ(borders.newest_commit(), MapVersion(5));
}

// Two regions' borders with each other, in step.
class BordersInStepTest : public ::testing::Test {
 protected:
  static BorderFrame Frame(RegionId sender, Tick tick) {
    BorderFrame frame;
    frame.tick = tick;
    frame.sender = sender;
    frame.map_version = MapVersion(1);
    return frame;
  }
  absl::Status Send(Borders& from, RegionId sender, Borders& to, Tick tick, Tick there) {
    EXPECT_EQ(from.DutyNow(0, tick), BorderLink::Duty::kFrame);
    const Borders::SentFrame sent = from.SendFrame(0, Frame(sender, tick), 0);
    const BorderFrame* taken = nullptr;
    return to.Put(sender, sent.out.bytes, there, &taken);
  }

  const Catalog catalog{EmptyScene()};
  Borders one{RegionId(1), std::vector{RegionId(2)}, MapVersion(1), catalog};
  Borders two{RegionId(2), std::vector{RegionId(1)}, MapVersion(1), catalog};
};

TEST_F(BordersInStepTest, WaitForTheFrameThatTheNextStepNeeds) {
  EXPECT_FALSE(one.Ready());
  EXPECT_EQ(one.WaitingFor(), std::vector{RegionId(2)});
  ASSERT_TRUE(Send(two, RegionId(2), one, Tick(0), Tick(0)).ok());
  EXPECT_TRUE(one.Ready() && one.WaitingFor().empty());
  EXPECT_EQ(one.Take(Tick(0)).frames[0].sender, RegionId(2));
  EXPECT_FALSE(one.Ready());
}

TEST_F(BordersInStepTest, WhoIsBehindAdoptsTheLaterTick) {
  ASSERT_TRUE(Send(two, RegionId(2), one, Tick(40), Tick(0)).ok());
  EXPECT_EQ(one.Take(Tick(0)).tick, Tick(40));
}

TEST_F(BordersInStepTest, NobodyWaitsForALinkThatIsDown) {
  one.TakeDown(RegionId(2));
  EXPECT_FALSE(one.IsUp(RegionId(2)) || one.Speaks(RegionId(2)));
  EXPECT_TRUE(one.LinksUp().empty());
  EXPECT_TRUE(one.Ready());
  EXPECT_EQ(one.Take(Tick(3)).frames[0].sender, RegionId());
  EXPECT_FALSE(one.IsUp(RegionId(7)));
  one.TakeDown(RegionId(7));  // no neighbour
  one.Validate();
}

TEST_F(BordersInStepTest, AMapKeepsTheLinksOfNeighboursThatStay) {
  one.TakeDown(RegionId(2));
  one.ChangeMap(MapVersion(2), std::vector{RegionId(2), RegionId(3)}, false);
  EXPECT_EQ(one.LinksUp(), std::vector{RegionId(3)});
  one.ChangeMap(MapVersion(3), std::vector{RegionId(2), RegionId(3)}, true);
  EXPECT_EQ(one.LinksUp().size(), 2U);
}

TEST_F(BordersInStepTest, GhostsAreWrittenAgainstTheFrameBefore) {
  EXPECT_TRUE(one.sent(0).empty());
  BorderFrame frame = Frame(RegionId(1), Tick(0));
  frame.ghosts.resize(1);
  frame.ghosts[0].id = BodyId(3);
  ASSERT_EQ(one.DutyNow(0, Tick(0)), BorderLink::Duty::kFrame);
  EXPECT_EQ(one.SendFrame(0, frame, 0).number, 0U);
  EXPECT_EQ(one.sent(0).size(), 1U);
  one.ForgetSent(0);
  EXPECT_TRUE(one.sent(0).empty());
}

}  // namespace
}  // namespace tessera::region

// Two regions' runs over one link: frames that were lost with a link, or are those of a region that was built anew.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "region_worker/core/region_run.h"
#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class TwoRunsTest : public ::testing::Test {
 protected:
  struct Side {
    explicit Side(RegionId region) : self(region), links(region) {}
    void Build(const region::Config& config) {
      run.emplace(Identity{"instance", self, Incarnation(1)}, WithoutPromises(config), false);
      links.ForgetFrames();
      run->Begin(links, actions);
    }
    RegionId self;
    LinkTable links;
    Actions actions;
    std::optional<RegionRun> run;
  };

  Side& Other(const Side& side) { return sides[side.self == sides[0].self ? 1 : 0]; }
  void LinkUp() {
    for (Side& side : sides) side.links.Up(Other(side).self, Incarnation(1), now, side.actions);
    Deliver();
  }
  void LinkDown() {
    for (Side& side : sides) side.links.Down(Other(side).self);
  }
  void Deliver() {
    for (Side& side : sides) {
      for (const SentMessage& sent : TakeSent(side.actions)) {
        Side& to = Other(side);
        to.links.Heard(side.self, now);
        if (to.run) to.run->Receive(side.self, sent.message, now, to.links, to.actions);
      }
    }
  }
  static void Step(Side& side, TimePoint now) {
    if (!side.run || !side.run->Advance(now, side.links, side.actions)) return;
    side.run->Step(now, {}, side.links, side.actions);
    side.run->StepEnded(now, {});
  }
  // A tick's time for both; what they send comes before the next.
  void Round() {
    now += sides[0].run->ticks().tick_length();
    for (Side& side : sides) Step(side, now);
    Deliver();
  }
  // Both run, in step.
  void Begin() {
    one.Build(ConfigOf(1, 2));
    two.Build(ConfigOf(2, 2));
    LinkUp();
    for (Side& side : sides) side.run->Run(now, side.actions);
    for (int round = 0; round < 20; ++round) Round();
    for (const Side& side : sides) EXPECT_THAT(side.run->HeardLinks(side.links), SizeIs(1));
  }
  // For so long what the one, or the other, sends is lost.
  void Cut(Duration span, bool of_one, bool of_two) {
    for (const TimePoint end = now + span; now < end;) {
      now += one.run->ticks().tick_length();
      for (Side& side : sides) Step(side, now);
      if (of_one) one.actions.clear();
      if (of_two) two.actions.clear();
      Deliver();
    }
  }
  std::vector<std::uint64_t> Ticks() const {
    return {sides[0].run->region().tick().value(), sides[1].run->region().tick().value()};
  }

  std::array<Side, 2> sides = {Side(CoreRig::kSelf), Side(CoreRig::kOther)};
  Side &one = sides[0], &two = sides[1];
  TimePoint now{std::chrono::hours(1)};
};

TEST_F(TwoRunsTest, FramesThatWereLostWithALinkComeOverTheNextOne) {
  one.Build(ConfigOf(1, 2));
  two.Build(ConfigOf(2, 2));
  LinkUp();
  for (Side& side : sides) side.run->Run(now, side.actions);
  for (int round = 0; round < 20; ++round) Round();
  EXPECT_THAT(Ticks(), Each(20U));
  // Region 1 goes ahead, its frame is lost with the link.
  now += one.run->ticks().tick_length();
  Step(one, now);
  one.actions.clear();
  LinkDown();
  for (int round = 0; round < 5; ++round) Round();
  EXPECT_LE(two.run->region().tick(), Tick(21));
  LinkUp();
  for (int round = 0; round < 20; ++round) Round();
  EXPECT_GT(one.run->region().tick(), Tick(35));
  for (const Side& side : sides) EXPECT_EQ(side.run->ticks().links_down(), 0U);
}

TEST_F(TwoRunsTest, ARegionThatIsBuiltAnewIsHeardFromTheFirstFrameOfItsNewBeginning) {
  const std::shared_ptr<const Scene> scene = SmallWorld();
  const PartitionMap grid = *MakeGridMap(scene->ground(), 2);
  const auto join = [&](std::uint64_t version, Tick effective) {
    region::RegionState nothing;
    nothing.region = two.self;
    nothing.incarnation = Incarnation(1);
    nothing.tick = Tick(effective.value() - 1);
    region::Config config = ConfigOf(2, 2, scene);
    config.map = LaterMap(grid, version);
    config.initial = std::make_shared<const region::RegionState>(nothing);
    two.Build(config);
    Order order;
    order.joins_running = true;
    EXPECT_TRUE(two.run->Follow(order, now, two.links, two.actions).ok());
    two.run->Run(now, two.actions);
  };
  const auto plan = [&](std::uint64_t version, Tick effective, bool committed) {
    Order order;
    order.planned = {LaterMap(grid, version), effective, committed};
    EXPECT_TRUE(one.run->Follow(order, now, one.links, one.actions).ok());
  };
  one.Build(ConfigOf(1, 1, scene));
  one.run->Run(now, one.actions);
  plan(2, Tick(20), false);
  join(2, Tick(20));
  LinkUp();
  for (int round = 0; round < 10; ++round) Round();
  // The first plan comes to nothing; the region joins by the next one, over the link that stands.
  plan(3, Tick(40), true);
  join(3, Tick(40));
  for (int round = 0; round < 60; ++round) Round();
  EXPECT_GT(one.run->region().tick(), Tick(60));
  EXPECT_GT(two.run->region().tick(), Tick(60));
  EXPECT_EQ(one.run->region().map().version(), MapVersion(3));
  for (const Side& side : sides) EXPECT_EQ(side.run->ticks().links_down(), 0U);
}

// Frames are lost without a word, as the transport loses them until it gives the peer up.
TEST_F(TwoRunsTest, OverALinkThatIsCutNothingIsHeardAfterASecondAndBothGoOn) {
  Begin();
  Cut(std::chrono::seconds(2), true, true);
  for (const Side& side : sides) {
    EXPECT_THAT(side.run->HeardLinks(side.links), IsEmpty());
    EXPECT_THAT(side.links.Linked(), SizeIs(1)) << "and it is sent to as before";
    EXPECT_EQ(side.run->ticks().links_down(), 1U);
    EXPECT_GT(side.run->region().tick(), Tick(100));
  }
  for (int round = 0; round < 6; ++round) Round();  // in one of which each asks to open the border
  for (const Side& side : sides) EXPECT_THAT(side.run->HeardLinks(side.links), SizeIs(1));
  for (int round = 0; round < 60; ++round) Round();
  for (Side& side : sides) EXPECT_TRUE(side.run->region().IsLinkUp(Other(side).self));
}

TEST_F(TwoRunsTest, WhereOneIsNotHeardItHearsTheOtherStill) {
  Begin();
  Cut(std::chrono::seconds(2), true, false);
  EXPECT_THAT(one.run->HeardLinks(one.links), SizeIs(1));
  EXPECT_THAT(two.run->HeardLinks(two.links), IsEmpty());
}

TEST_F(TwoRunsTest, AShortSilenceClosesTheBorderAndNoMore) {
  Begin();
  Cut(std::chrono::milliseconds(700), true, true);
  for (Side& side : sides) {
    EXPECT_FALSE(side.run->region().IsLinkUp(Other(side).self));
    EXPECT_THAT(side.run->HeardLinks(side.links), SizeIs(1));
  }
}

}  // namespace
}  // namespace tessera::worker

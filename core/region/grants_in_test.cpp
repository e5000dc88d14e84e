#include "core/region/grants_in.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {

void PrintTo(const GrantAcknowledgement& one, std::ostream* out) {
  *out << one.id.value() << " by epoch " << one.epoch.value();
}

namespace {

using ::testing::ElementsAre;

const std::vector<RegionId> kNeighbors = {kTwo, kThree};

class GrantsInTest : public ::testing::Test {
 protected:
  GrantedBody Granted(std::uint64_t id, Epoch epoch) const { return {BodyId(id), epoch, world.InitialOf(id), {}}; }
  std::vector<std::uint64_t> Accept(RegionId from, std::vector<GrantedBody> bodies, Tick since = Tick(5)) {
    const Grant grant{std::move(bodies), {}, {}};
    std::vector<std::uint64_t> ids;
    for (const GrantedBody* body : grants.Accept(from, grant, world.bodies, since)) {
      world.Own(body->id.value(), body->state, body->epoch);
      ids.push_back(body->id.value());
    }
    grants.Validate();
    return ids;
  }
  std::vector<std::uint64_t> Ready(RegionId to) {
    std::vector<std::uint64_t> ids;
    for (const GrantAcknowledgement& one : grants.TakeReady(to)) ids.push_back(one.id.value());
    return ids;
  }

  SmallWorld world{Balls({{1, 0, 0}, {3, 0, 0}, {5, 0, 0}})};
  GrantsIn grants{kNeighbors};
};

TEST_F(GrantsInTest, OfABodyThatTwoNeighboursGrantTheFirstCounts) {
  EXPECT_THAT(Accept(kTwo, {Granted(1, Epoch(2)), Granted(3, Epoch(2))}), ElementsAre(1, 3));
  EXPECT_TRUE(Accept(kThree, {Granted(1, Epoch(3))}).empty());
  EXPECT_THAT(grants.taken_in(), ElementsAre(BodyId(1), BodyId(3)));
  grants.StartStep();
  EXPECT_TRUE(grants.taken_in().empty());
}

TEST_F(GrantsInTest, AnAcknowledgementWaitsForTheStandby) {
  Accept(kTwo, {Granted(1, Epoch(2))}, Tick(5));
  grants.Release(Tick(4));
  EXPECT_TRUE(Ready(kTwo).empty());
  grants.Release(Tick(5));
  EXPECT_THAT(Ready(kTwo), ElementsAre(1));
}

TEST_F(GrantsInTest, WithoutAStandbyNothingWaits) {
  Accept(kTwo, {Granted(1, Epoch(2))});
  grants.Release(std::nullopt);
  EXPECT_THAT(Ready(kTwo), ElementsAre(1));
}

TEST_F(GrantsInTest, ABodyThatWentOnIsAcknowledgedAtOnce) {
  Accept(kTwo, {Granted(1, Epoch(2))});
  grants.WentOn(BodyId(1), Epoch(3));
  grants.Release(Tick(0));
  EXPECT_THAT(Ready(kTwo), ElementsAre(1));
}

TEST_F(GrantsInTest, ARepeatedGrantIsAcknowledgedOnceMoreAndNotTaken) {
  Accept(kTwo, {Granted(1, Epoch(2))});
  grants.Release(std::nullopt);
  Ready(kTwo);
  EXPECT_TRUE(Accept(kTwo, {Granted(1, Epoch(2))}).empty());
  EXPECT_TRUE(Accept(kTwo, {Granted(1, Epoch(2))}).empty());  // one acknowledgement is due already
  grants.Release(std::nullopt);
  EXPECT_THAT(Ready(kTwo), ElementsAre(1));
}

// The body has gone on, but the granter may not have heard that it was here.
TEST_F(GrantsInTest, ABodyThatWasPassedOnIsKnownWhileItsAcknowledgementIsUnderWay) {
  Accept(kTwo, {Granted(1, Epoch(2))});
  world.bodies.RemoveOwned(BodyId(1));
  EXPECT_TRUE(grants.IsRepeat(kTwo, Granted(1, Epoch(2)), world.bodies));
  grants.Release(std::nullopt);
  const std::vector<GrantAcknowledgement> sent = grants.TakeReady(kTwo);
  grants.Sent(kTwo, sent, 10);
  EXPECT_TRUE(grants.IsRepeat(kTwo, Granted(1, Epoch(2)), world.bodies));
  grants.Heard(kTwo, 10);  // its frame 10 was made before it had this region's frame 10
  EXPECT_TRUE(grants.IsRepeat(kTwo, Granted(1, Epoch(2)), world.bodies));
  grants.Heard(kTwo, 11);
  EXPECT_FALSE(grants.IsRepeat(kTwo, Granted(1, Epoch(2)), world.bodies));
}

TEST_F(GrantsInTest, WhatAnOutageMayHaveLostIsReadyAgainFirst) {
  Accept(kTwo, {Granted(2, Epoch(2))});
  grants.Release(std::nullopt);
  grants.Sent(kTwo, grants.TakeReady(kTwo), 3);
  Accept(kTwo, {Granted(1, Epoch(2))});
  grants.Release(std::nullopt);
  grants.Repeat(kTwo);
  EXPECT_THAT(Ready(kTwo), ElementsAre(2, 1));
}

TEST_F(GrantsInTest, AMapKeepsTheAcknowledgementsOfNeighboursThatStay) {
  Accept(kTwo, {Granted(1, Epoch(2))});
  Accept(kThree, {Granted(2, Epoch(2))});
  grants.Release(std::nullopt);
  grants.SetNeighbors(std::vector{kThree, kFour}, false);
  EXPECT_THAT(Ready(kThree), ElementsAre(2));
  grants.Owe(BodyId(3), Epoch(2), kTwo, Tick());  // no neighbour any more
  grants.Release(std::nullopt);
  grants.SetNeighbors(kNeighbors, true);
  EXPECT_TRUE(Ready(kTwo).empty() && Ready(kThree).empty());
}

}  // namespace
}  // namespace tessera::region

// A neighbour is told what it does not know, when it is to know it, and once.
#include "core/region/shared_properties.h"

#include <gmock/gmock.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class SharedPropertiesTest : public ::testing::Test {
 protected:
  // Body 1 gets these bytes in `tick`.
  void Change(std::uint8_t value, std::uint64_t tick) {
    const KeptRecord* now = records.Find(kShared);
    const std::optional<KeptRecord> before = now == nullptr ? std::nullopt : std::optional(*now);
    PropertySet set;
    ASSERT_TRUE(set.Set(defs, "score", std::int64_t{value}).ok());
    records.Commit(kShared, set, {});
    shared.Changed(before ? &*before : nullptr, *records.Find(kShared), Tick(tick));
  }
  static GhostProperties Score(std::uint8_t value) { return {kShared, {0, static_cast<std::uint8_t>(2 * value)}}; }
  static GhostRecord GhostOf(BodyId id) {
    GhostRecord ghost;
    ghost.id = id;
    return ghost;
  }
  std::vector<GhostProperties> Frame(RegionId to = kTwo) { return shared.For(to, ghosts, records); }

  static constexpr BodyId kShared{1};
  const std::vector<PropertyDef> defs = {{"score", std::int64_t{0}}};
  RecordTable records;
  SharedProperties shared;
  std::vector<GhostRecord> ghosts{GhostOf(kShared), GhostOf(BodyId(2))};
};

TEST_F(SharedPropertiesTest, AChangeIsShownThreeTicksLaterAndOnce) {
  Change(5, 10);
  for (const std::uint64_t tick : {10, 11, 12}) {
    shared.Release(Tick(tick), Tick(tick));
    EXPECT_THAT(Frame(), IsEmpty()) << tick;
  }
  shared.Release(Tick(13), Tick(13));
  EXPECT_THAT(Frame(), ElementsAre(Score(5)));
  shared.Release(Tick(14), Tick(14));
  EXPECT_THAT(Frame(), IsEmpty());
  EXPECT_THAT(Frame(kThree), ElementsAre(Score(5))) << "the other neighbour";
}

TEST_F(SharedPropertiesTest, WhatTheStandbyDoesNotHaveWaits) {
  Change(5, 10);
  Change(6, 12);
  shared.Release(Tick(9), Tick(20));
  EXPECT_THAT(Frame(), IsEmpty());
  shared.Release(Tick(11), Tick(21));
  EXPECT_THAT(Frame(), ElementsAre(Score(5)));
  shared.Release(Tick(12), Tick(22));
  EXPECT_THAT(Frame(), ElementsAre(Score(6)));
}

TEST_F(SharedPropertiesTest, ABodyThatComesIntoSightBringsAllAndOneThatLeftIsToldAgain) {
  Change(5, 1);
  shared.Release(Tick(9), Tick(9));
  ghosts.erase(ghosts.begin());
  EXPECT_THAT(Frame(), IsEmpty());
  ghosts.insert(ghosts.begin(), GhostOf(kShared));
  EXPECT_THAT(Frame(), ElementsAre(Score(5)));
  ghosts.clear();
  EXPECT_THAT(Frame(), IsEmpty());
  ghosts.push_back(GhostOf(kShared));
  EXPECT_THAT(Frame(), ElementsAre(Score(5)));
  shared.Forget(kTwo);
  EXPECT_THAT(Frame(), ElementsAre(Score(5))) << "its link was down";
  shared.SetNeighbors(std::vector{kTwo}, false);
  EXPECT_THAT(Frame(), IsEmpty());
  shared.SetNeighbors(std::vector{kTwo}, true);
  EXPECT_THAT(Frame(), ElementsAre(Score(5)));
}

TEST_F(SharedPropertiesTest, WhatANeighbourToldIsKeptWhileItsGhostIsHere) {
  const std::vector<GhostProperties> told = {Score(5)};
  shared.Take(told);
  ASSERT_NE(shared.Find(kShared), nullptr);
  EXPECT_EQ(*shared.Find(kShared), told[0].bytes);
  shared.KeepOnly(std::vector<Ghost>{Ghost{GhostOf(kShared), kTwo}});
  EXPECT_NE(shared.Find(kShared), nullptr);
  shared.KeepOnly(std::vector<Ghost>{Ghost{GhostOf(BodyId(2)), kTwo}});
  EXPECT_EQ(shared.Find(kShared), nullptr);
}

}  // namespace
}  // namespace tessera::region

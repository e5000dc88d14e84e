#include "control_plane/id_ranges.h"

#include <gmock/gmock.h>

namespace tessera::control {
namespace {

using ::testing::IsEmpty;

std::vector<BodyId> Ids(std::initializer_list<std::uint64_t> values) {
  std::vector<BodyId> ids;
  ids.reserve(values.size());
  for (const std::uint64_t value : values) ids.emplace_back(value);
  return ids;
}

TEST(IdRangesTest, RunsBecomeOneRangeEach) {
  EXPECT_THAT(ToRanges({}), IsEmpty());
  const IdRanges ranges = ToRanges(Ids({1, 2, 3, 7, 9, 10}));
  ASSERT_EQ(ranges.size(), 3);
  EXPECT_EQ(ranges.Get(0).first(), 1u);
  EXPECT_EQ(ranges.Get(0).last(), 3u);
  EXPECT_EQ(ranges.Get(1).first(), 7u);
  EXPECT_EQ(ranges.Get(1).last(), 7u);
  EXPECT_EQ(ToIds(ranges), Ids({1, 2, 3, 7, 9, 10}));
}

TEST(IdRangesTest, RunsAreTakenOutAsTheirIdsAre) {
  const std::vector<BodyId> all = Ids({1, 2, 3, 4, 8, 9, 10, 20});
  for (const auto& runs : {Ids({}), Ids({2}), Ids({1, 2, 3, 4, 5, 6, 7, 8}), Ids({5, 6}), Ids({3, 9, 20, 21}), all}) {
    IdRanges at_once = ToRanges(all), one_by_one = at_once;
    bool any = false;
    for (const BodyId id : runs) any |= TakeOut(id, one_by_one);
    EXPECT_EQ(TakeOut(ToRanges(runs), at_once), any);
    EXPECT_EQ(ToIds(at_once), ToIds(one_by_one));
  }
}

TEST(IdRangesTest, TakesOutOfTheMiddleTheEndsAndTheLastOfARange) {
  IdRanges ranges = ToRanges(Ids({1, 2, 3, 4, 8}));
  EXPECT_TRUE(TakeOut(BodyId(2), ranges));
  EXPECT_EQ(ToIds(ranges), Ids({1, 3, 4, 8}));
  EXPECT_TRUE(TakeOut(BodyId(4), ranges));
  EXPECT_TRUE(TakeOut(BodyId(1), ranges));
  EXPECT_EQ(ToIds(ranges), Ids({3, 8}));
  EXPECT_FALSE(TakeOut(BodyId(4), ranges));
  EXPECT_TRUE(TakeOut(BodyId(8), ranges));
  EXPECT_TRUE(TakeOut(BodyId(3), ranges));
  EXPECT_THAT(ranges, IsEmpty());
}

TEST(IdRangesTest, KeepsWhatIsWithinWhateverTheRangesClaim) {
  IdRanges ranges;
  ranges.Add()->set_last(~0ull);
  EXPECT_EQ(Within(Ids({1, 5}), ranges), Ids({1, 5}));
  EXPECT_EQ(Within(Ids({1, 5, 6}), ToRanges(Ids({4, 5}))), Ids({5}));
}

}  // namespace
}  // namespace tessera::control

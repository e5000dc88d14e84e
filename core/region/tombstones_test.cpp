#include "core/region/tombstones.h"

#include <gmock/gmock.h>

namespace tessera::region {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint32_t kRate_hz = 60;
constexpr BodyId kOfScene{7}, kMade{std::uint64_t{1} << 63 | 1};

TEST(TombstonesTest, AMadeBodysIsForgottenWhenNoCopyCanBeLeft) {
  Tombstones tombstones;
  tombstones.Add(kMade, Epoch(3), Tick(100));
  tombstones.Forget(Tick(700), kRate_hz);
  EXPECT_THAT(tombstones.All(), ElementsAre(BodyClaim{kMade, Epoch(3)}));
  tombstones.Forget(Tick(701), kRate_hz);
  EXPECT_THAT(tombstones.All(), IsEmpty());
}

TEST(TombstonesTest, OneThatCameAgainIsForgottenByItsLastTime) {
  Tombstones tombstones;
  tombstones.Add(kMade, Epoch(1), Tick(100));
  tombstones.Add(kMade, Epoch(2), Tick(300));
  tombstones.Forget(Tick(800), kRate_hz);
  EXPECT_THAT(tombstones.All(), ElementsAre(BodyClaim{kMade, Epoch(2)}));
  tombstones.Forget(Tick(901), kRate_hz);
  EXPECT_THAT(tombstones.All(), IsEmpty());
}

TEST(TombstonesTest, ThoseOfTheScenesBodiesStayAndAreListedByTick) {
  Tombstones tombstones;
  tombstones.Add(kMade, Epoch(1), Tick(5));
  tombstones.Add(kOfScene, Epoch(1), Tick(5));
  tombstones.Forget(Tick(1'000'000), kRate_hz);
  EXPECT_THAT(tombstones.SceneBodies(Tick(4)), IsEmpty());
  EXPECT_THAT(tombstones.SceneBodies(Tick(5)), ElementsAre(kOfScene));
}

TEST(TombstonesTest, TheHighestEpochOfMergedOnesCounts) {
  Tombstones tombstones;
  tombstones.Add(kMade, Epoch(3), Tick(1));
  const BodyClaim others[] = {{kOfScene, Epoch(2)}, {kMade, Epoch(2)}};
  tombstones.Merge(others, Tick(9));
  EXPECT_THAT(tombstones.All(), ElementsAre(BodyClaim{kOfScene, Epoch(2)}, BodyClaim{kMade, Epoch(3)}));
}

}  // namespace
}  // namespace tessera::region

#include "core/region/pair_reports.h"

#include <gmock/gmock.h>

namespace tessera::region {
namespace {

using physics::PairEvent;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class PairReportsTest : public ::testing::Test {
 protected:
  PairReportsTest() {
    auto scene = std::make_shared<Scene>();
    for (std::uint64_t id = 1; id <= 4; ++id) {
      BodyDef def;
      def.id = BodyId(id);
      def.motion = id == 1 ? Motion::kStatic : Motion::kDynamic;
      scene->bodies.push_back(def);
    }
    catalog = std::make_unique<Catalog>(scene);
  }
  std::vector<PairEvent> Report(PairReports& reports, std::vector<PairEvent> events) {
    return reports.Report(
        events, [this](BodyId id) { return owned.contains(id); }, [this](BodyId id) { return present.contains(id); },
        [this](const TouchingPair&) { return touching; });
  }

  std::unique_ptr<Catalog> catalog;
  std::set<BodyId> owned{BodyId(2), BodyId(3)};
  std::optional<bool> touching;  // whether restored pairs do; nothing: they sleep
  std::set<BodyId> present{BodyId(1), BodyId(2), BodyId(3), BodyId(4)};
};

const PairEvent kBegin{BodyId(2), BodyId(4), false, true}, kEnd{BodyId(2), BodyId(4), false, false};

TEST_F(PairReportsTest, TheOwnerOfTheLowerDynamicBodyReports) {
  PairReports reports(*catalog);
  const PairEvent with_static{BodyId(1), BodyId(3), false, true};
  const PairEvent of_others{BodyId(1), BodyId(4), false, true};
  EXPECT_THAT(Report(reports, {with_static, of_others, kBegin}), ElementsAre(with_static, kBegin));
}

TEST_F(PairReportsTest, AHandoverMovesAPairWithoutAnEvent) {
  PairReports old_owner(*catalog), new_owner(*catalog);
  EXPECT_THAT(Report(old_owner, {kBegin}), ElementsAre(kBegin));
  new_owner.Adopt(old_owner.Pairs(BodyId(2)));
  old_owner.Release(BodyId(2));
  EXPECT_THAT(Report(new_owner, {kBegin}), IsEmpty());  // its world sees the pair for the first time
  EXPECT_THAT(Report(new_owner, {kEnd}), ElementsAre(kEnd));
  EXPECT_THAT(Report(old_owner, {kEnd}), IsEmpty());
}

TEST_F(PairReportsTest, APairEndsOnceWhenItsBodyLeavesTheWorld) {
  PairReports reports(*catalog);
  Report(reports, {kBegin});
  present.erase(BodyId(4));
  reports.BodyLeft(BodyId(4));
  EXPECT_THAT(Report(reports, {}), ElementsAre(kEnd));
  EXPECT_THAT(Report(reports, {kEnd}), IsEmpty());
}

TEST_F(PairReportsTest, ABodyThatIsBackInTimeEndsNothing) {
  PairReports reports(*catalog);
  Report(reports, {kBegin});
  reports.BodyLeft(BodyId(4));
  EXPECT_THAT(Report(reports, {}), IsEmpty());
  EXPECT_THAT(reports.All(), ElementsAre(TouchingPair{BodyId(2), BodyId(4)}));
}

TEST_F(PairReportsTest, AnAdoptedPairEndsAtOnceIfItsOtherBodyIsNotHere) {
  PairReports reports(*catalog);
  present.erase(BodyId(4));
  reports.Adopt(std::vector{TouchingPair{BodyId(2), BodyId(4)}, TouchingPair{BodyId(2), BodyId(3)}});
  EXPECT_THAT(Report(reports, {}), ElementsAre(kEnd));
  EXPECT_THAT(reports.Pairs(BodyId(2)), ElementsAre(TouchingPair{BodyId(2), BodyId(3)}));
}

TEST_F(PairReportsTest, ARestoredPairThatDoesNotTouchEndsOnceItIsAwake) {
  PairReports reports(*catalog);
  reports.Restore(std::vector{TouchingPair{BodyId(2), BodyId(4)}});
  EXPECT_THAT(Report(reports, {}), IsEmpty());
  touching = false;
  EXPECT_THAT(Report(reports, {}), ElementsAre(kEnd));
  EXPECT_THAT(Report(reports, {kBegin}), ElementsAre(kBegin)) << "it may begin again";
}

TEST_F(PairReportsTest, ARestoredPairThatTouchesGoesOnWithoutAnEvent) {
  PairReports reports(*catalog);
  reports.Restore(std::vector{TouchingPair{BodyId(2), BodyId(4)}});
  touching = true;
  EXPECT_THAT(Report(reports, {kBegin}), IsEmpty());
  touching = false;
  EXPECT_THAT(Report(reports, {}), IsEmpty()) << "from now on the world tells";
  EXPECT_THAT(Report(reports, {kEnd}), ElementsAre(kEnd));
}

TEST_F(PairReportsTest, AllAreAscendingWhoeverReportsThem) {
  PairReports reports(*catalog);
  const TouchingPair a{BodyId(1), BodyId(3)}, b{BodyId(2), BodyId(3)}, c{BodyId(2), BodyId(4)};
  reports.Adopt(std::vector{c, a, b});
  EXPECT_THAT(reports.All(), ElementsAre(a, b, c));
}

}  // namespace
}  // namespace tessera::region

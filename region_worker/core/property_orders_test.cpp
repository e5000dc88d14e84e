#include "region_worker/core/property_orders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "region_worker/testing/core_rig.h"

namespace tessera::worker {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::shared_ptr<const Scene> WorldWithHealth() {
  auto scene = std::make_shared<Scene>(*SmallWorld());
  PropertyDef health;
  health.name = "health";
  health.initial = std::int64_t{100};
  scene->properties.push_back(health);
  return scene;
}

PropertyOrder Health(std::uint64_t number, std::uint64_t body, std::int64_t value) {
  return {number, BodyId(body), "health", value};
}

class PropertyOrdersTest : public ::testing::Test {
 protected:
  void Step() {
    orders.Apply(rig.region);
    rig.Step();
  }
  std::vector<PropertyAnswer> Answers(bool has_standby = false) const {
    return orders.Answers(rig.region, has_standby);
  }
  std::uint64_t LastChange(std::uint64_t body) const {
    const region::KeptRecord* changed = rig.region.records().Find(BodyId(body));
    return changed == nullptr ? 0 : changed->change;
  }

  CoreRig rig{1, WorldWithHealth()};
  PropertyOrders orders;
};

TEST_F(PropertyOrdersTest, AChangeIsMadeByItsNumberAndAnsweredAfterTheStep) {
  orders.Set({Health(4, 1, 50), Health(7, 2, 60)});
  orders.Apply(rig.region);
  EXPECT_THAT(Answers(), IsEmpty());
  rig.Step();
  EXPECT_THAT(Answers(), ElementsAre(PropertyAnswer{4}, PropertyAnswer{7}));
  EXPECT_EQ(LastChange(1), 4U);
  orders.Set({Health(7, 2, 60)});
  EXPECT_THAT(Answers(), ElementsAre(PropertyAnswer{7})) << "of those that are still ordered";
}

TEST_F(PropertyOrdersTest, WithAStandbyItIsAnsweredOnceTheStandbyHasIt) {
  rig.region.SetStandby(true);
  orders.Set({Health(1, 1, 50)});
  Step();
  EXPECT_THAT(Answers(true), IsEmpty());
  rig.region.LogAcknowledged(rig.region.tick());
  EXPECT_THAT(Answers(true), ElementsAre(PropertyAnswer{1}));
}

TEST_F(PropertyOrdersTest, NothingIsSaidOfABodyThatAnotherRegionOwns) {
  orders.Set({Health(1, 77, 50)});
  Step();
  EXPECT_THAT(Answers(), IsEmpty());
}

TEST_F(PropertyOrdersTest, ANameThatIsNotDeclaredAndAValueOfAnotherTypeAreRefused) {
  orders.Set({{1, BodyId(1), "wealth", std::int64_t{5}}, {2, BodyId(1), "health", true}});
  Step();
  const std::vector<PropertyAnswer> answers = Answers();
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0].refused, "no property \"wealth\"");
  EXPECT_FALSE(answers[1].refused.empty());
  EXPECT_EQ(LastChange(1), 0U);
}

}  // namespace
}  // namespace tessera::worker

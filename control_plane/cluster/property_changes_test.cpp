// Property changes on records and entries alone.
#include "control_plane/cluster/property_changes.h"

#include <gmock/gmock.h>

#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class PropertyChangesTest : public ::testing::Test {
 protected:
  PropertyChangesTest() {
    records::Instance next = instance_.record;
    next.add_properties()->set_name("health");
    next.mutable_properties(0)->set_number(100);
    next.add_bodies()->set_first(5);
    next.mutable_bodies(0)->set_last(5);
    EXPECT_TRUE(rig_.state->StoreInstance(instance_, next).ok());
  }
  v1::SetPropertyRequest Health(std::int64_t value) {
    v1::SetPropertyRequest request;
    request.set_id(instance_.record.id());
    request.set_body(5);
    request.mutable_property()->set_name("health");
    request.mutable_property()->set_number(value);
    return request;
  }
  void Answer(std::uint64_t change, const std::string& refused) {
    v1::WorkerReport report;
    v1::PropertyAnswer& answer = *report.add_property_answers();
    answer.set_number(change);
    answer.set_refused(refused);
    changes_.TakeAnswers(instance_, report);
  }

  StateRig rig_;
  HostEntry& alpha_ = rig_.AddHost("alpha");
  InstanceEntry& instance_ = rig_.AddRunning({&alpha_});
  PropertyChanges changes_{*rig_.state};
};

TEST_F(PropertyChangesTest, IsAskedForUntilTheFirstAnswer) {
  const std::uint64_t first = *changes_.Add(instance_, Health(1)), second = *changes_.Add(instance_, Health(2));
  EXPECT_TRUE(alpha_.desired_changed);
  ASSERT_EQ(changes_.Unanswered(instance_).size(), 2U);
  EXPECT_EQ(changes_.Unanswered(instance_)[0].number(), first);
  EXPECT_EQ(changes_.Outcome(instance_.record.id(), first), std::nullopt);
  Answer(first, "");
  Answer(first, "too late");
  Answer(second, "no room");
  EXPECT_EQ(changes_.Outcome(instance_.record.id(), first), absl::OkStatus());
  EXPECT_THAT(changes_.Outcome(instance_.record.id(), second)->message(), HasSubstr("property: no room"));
  EXPECT_TRUE(changes_.Unanswered(instance_).empty());
  changes_.Remove(instance_, first);
  EXPECT_EQ(changes_.Outcome(instance_.record.id(), first)->code(), absl::StatusCode::kAborted);
}

TEST_F(PropertyChangesTest, IsCheckedAtTheEdge) {
  v1::SetPropertyRequest request = Health(1);
  request.set_body(6);
  EXPECT_EQ(changes_.Add(instance_, request).status().code(), absl::StatusCode::kNotFound);
  request = Health(1);
  request.mutable_property()->set_name("mana");
  EXPECT_THAT(changes_.Add(instance_, request).status().message(), HasSubstr("property.name: "));
  request = Health(1);
  request.set_validate_only(true);
  EXPECT_EQ(*changes_.Add(instance_, request), 0U);
  EXPECT_TRUE(changes_.Unanswered(instance_).empty());
}

}  // namespace
}  // namespace tessera::control

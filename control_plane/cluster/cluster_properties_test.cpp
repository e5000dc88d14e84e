// Changes of properties: checked by name at the edge, in the orders of all workers until one answers.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Two regions, bodies 5 to 7, a player.
class PropertiesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    harness_.AddHost("alpha", 4);
    InstancePlan plan = TestPlan(2);
    plan.bodies = {BodyId(5), BodyId(6), BodyId(7)};
    plan.properties.resize(2);
    plan.properties[0].set_name("health");
    plan.properties[0].set_number(100);
    plan.properties[1].set_name("team");
    plan.properties[1].set_text("none");
    plan.world_properties.emplace_back().set_name("goals");
    plan.world_properties.back().set_number(0);
    plan.game_name = "game.lua";
    plan.game_hash = "feed";
    const auto made = harness_.cluster().CreateInstance(harness_.now, plan, false);
    ASSERT_TRUE(made.ok()) << made.status();
    id_ = made->id();
    harness_.Run(seconds(2));
    ASSERT_EQ(StateOf(harness_.cluster().state(), id_), v1::INSTANCE_STATE_RUNNING);
  }
  v1::SetPropertyRequest Health(std::uint64_t body, std::int64_t health) const {
    v1::SetPropertyRequest request;
    request.set_id(id_);
    request.set_body(body);
    request.mutable_property()->set_name("health");
    request.mutable_property()->set_number(health);
    return request;
  }
  StoreEntry Stored(const std::string& key) { return *harness_.store.Get(key); }
  std::string Refusal(const v1::SetPropertyRequest& request) {
    const auto number = harness_.cluster().SetProperty(request);
    return number.ok() ? "" : std::string(number.status().message());
  }
  std::vector<std::uint64_t> Ordered(std::uint32_t region) {
    std::vector<std::uint64_t> numbers;
    for (const auto& change : Worker(region).order.property_changes()) numbers.push_back(change.number());
    return numbers;
  }
  FakeWorker& Worker(std::uint32_t region) { return harness_.agents["alpha"].fake.workers.at({id_, region}); }
  void Answer(std::uint32_t region, std::uint64_t number, const std::string& refused) {
    v1::AgentMessage message;
    *message.mutable_report() = Worker(region).report;
    v1::PropertyAnswer& answer = *message.mutable_report()->add_property_answers();
    answer.set_number(number);
    answer.set_refused(refused);
    harness_.Send(harness_.agents["alpha"], message);
  }

  ClusterHarness harness_;
  std::string id_;
};

TEST_F(PropertiesTest, AreInAllOrdersUntilOneWorkerAnswers) {
  const auto first = harness_.cluster().SetProperty(Health(5, 80));
  const auto second = harness_.cluster().SetProperty(Health(6, 70));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_LT(*first, *second);
  harness_.Pump();
  for (const std::uint32_t region : {1, 2}) EXPECT_EQ(Ordered(region), (std::vector{*first, *second}));
  EXPECT_EQ(Worker(1).order.property_changes(0).body(), 5U);
  EXPECT_EQ(Worker(1).order.property_changes(0).property().number(), 80);
  EXPECT_EQ(harness_.cluster().PropertyOutcome(id_, *first), std::nullopt);

  Answer(2, *first, "");
  Answer(1, *second, "properties of one body take more than 512 bytes");
  EXPECT_EQ(harness_.cluster().PropertyOutcome(id_, *first), absl::OkStatus());
  EXPECT_THAT(harness_.cluster().PropertyOutcome(id_, *second)->message(), HasSubstr("property: properties of one"));
  harness_.cluster().ForgetProperty(id_, *first);
  harness_.cluster().ForgetProperty(id_, *second);
  harness_.Pump();
  for (const std::uint32_t region : {1, 2}) EXPECT_THAT(Ordered(region), IsEmpty());
}

// Its record is of a control plane that knew of none; the scene that it stored declares them.
TEST_F(PropertiesTest, OfAnInstanceThatIsOlderThanTheyAreAreThoseOfItsScene) {
  v1::Scene scene;
  v1::Property& armour = *scene.add_properties();
  armour.set_name("armour");
  armour.set_number(7);
  scene.add_instance_properties()->set_name("round");
  scene.mutable_instance_properties(0)->set_number(1);
  ASSERT_TRUE(harness_.store.Put(SceneKey("0123"), scene.SerializeAsString(), Stored(SceneKey("0123")).revision).ok());
  const std::string key = "instance/1";
  records::Instance record;
  ASSERT_TRUE(record.ParseFromString(Stored(key).value));
  record.clear_properties();
  record.clear_properties_taken();
  record.clear_world_properties();
  record.clear_world_properties_taken();
  ASSERT_TRUE(harness_.store.Put(key, record.SerializeAsString(), Stored(key).revision).ok());
  harness_.Restart();
  harness_.Run(seconds(2));
  v1::SetPropertyRequest request = Health(5, 1);
  EXPECT_NE(Refusal(request), "");
  request.mutable_property()->set_name("armour");
  EXPECT_EQ(Refusal(request), "");
  request.set_body(0);
  request.mutable_property()->set_name("round");
  EXPECT_EQ(Refusal(request), "");
}

// Body 0 stands for the world.
TEST_F(PropertiesTest, TheWorldsAreOrderedAndSeenAsTheNewestOwnerReportsThem) {
  const auto goals = [&] {
    const v1::Instance instance = *GetInstance(harness_.cluster().state(), id_);
    return instance.world_properties_size() == 1 ? instance.world_properties(0).number() : -1;
  };
  EXPECT_EQ(goals(), 0) << "the scene's";
  v1::SetPropertyRequest request = Health(0, 80);
  EXPECT_THAT(Refusal(request), HasSubstr("property.name: no property \"health\""));
  request.mutable_property()->set_name("goals");
  const auto number = harness_.cluster().SetProperty(request);
  ASSERT_TRUE(number.ok()) << number.status();
  harness_.Pump();
  EXPECT_EQ(Worker(2).order.property_changes(0).body(), 0U);
  EXPECT_EQ(Worker(2).order.property_changes(0).property().name(), "goals");

  const auto report = [&](std::uint32_t region, std::uint32_t epoch, std::int64_t value) {
    v1::WorkerReport& worker = Worker(region).report;
    worker.set_world_epoch(epoch);
    worker.clear_world_properties();
    worker.add_world_properties()->set_name("goals");
    worker.mutable_world_properties(0)->set_number(value);
    v1::AgentMessage message;
    *message.mutable_report() = worker;
    harness_.Send(harness_.agents["alpha"], message);
  };
  report(2, 4, 80);
  EXPECT_EQ(goals(), 80);
  report(1, 3, 79);
  EXPECT_EQ(goals(), 80) << "an earlier owner's last report";
  report(1, 5, 81);
  EXPECT_EQ(goals(), 81);
}

TEST_F(PropertiesTest, WrongOnesAreRefusedByTheFieldAndNobodyIsTold) {
  EXPECT_EQ(Refusal(Health(8, 1)), "body: " + id_ + " has no dynamic body 8");
  EXPECT_EQ(Refusal(Health(PlayerBodyId(PlayerNumber(1)).value(), 1)),
            "body: " + id_ + " has no dynamic body " + std::to_string(PlayerBodyId(PlayerNumber(1)).value()));
  v1::SetPropertyRequest request = Health(5, 1);
  request.mutable_property()->set_name("mana");
  EXPECT_EQ(Refusal(request), "property.name: no property \"mana\"");
  request = Health(5, 1);
  request.mutable_property()->set_real(1);
  EXPECT_EQ(Refusal(request), "property: property \"health\" is a whole number");
  request.mutable_property()->clear_value();
  EXPECT_EQ(Refusal(request), "property: \"health\" has no value");
  request.mutable_property()->set_name("team");
  request.mutable_property()->set_text(std::string(64, 'x'));
  EXPECT_EQ(Refusal(request), "property: property \"team\" is longer than 63 bytes");
  request = Health(5, 1);
  request.set_id("inst-99");
  EXPECT_EQ(Refusal(request), "id: no instance inst-99");
  request = Health(5, 1);
  request.set_validate_only(true);
  EXPECT_EQ(Refusal(request), "");
  harness_.Pump();
  EXPECT_THAT(Ordered(1), IsEmpty());
}

TEST_F(PropertiesTest, OfAPlayersBodyAsLongAsThePlayerIsThere) {
  v1::JoinInstanceRequest join;
  join.set_instance_id(id_);
  const auto joined = harness_.cluster().Join(harness_.now, join);
  ASSERT_TRUE(joined.ok()) << joined.status();
  const std::uint64_t body = PlayerBodyId(PlayerNumber(joined->response.player())).value();
  EXPECT_EQ(Refusal(Health(body, 1)), "");
  v1::LeaveInstanceRequest leave;
  leave.set_instance_id(id_);
  leave.set_credential(joined->response.credential());
  leave.set_credential_key(joined->response.credential_key());
  ASSERT_TRUE(harness_.cluster().Leave(harness_.now, leave).ok());
  EXPECT_THAT(Refusal(Health(body, 1)), HasSubstr("has no dynamic body"));
}

TEST_F(PropertiesTest, TooManyThatWaitAreRefused) {
  for (std::size_t i = 0; i < kMaxPropertyChanges; ++i) ASSERT_EQ(Refusal(Health(5, 1)), "");
  EXPECT_THAT(Refusal(Health(5, 1)), HasSubstr("wait already"));
}

TEST_F(PropertiesTest, WhoWaitsForAnInstanceThatEndsIsToldSo) {
  const auto number = harness_.cluster().SetProperty(Health(5, 80));
  ASSERT_TRUE(number.ok());
  v1::DeleteInstanceRequest request;
  request.set_id(id_);
  ASSERT_TRUE(harness_.cluster().DeleteInstance(harness_.now, request).ok());
  EXPECT_EQ(harness_.cluster().PropertyOutcome(id_, *number)->code(), absl::StatusCode::kAborted);
}

}  // namespace
}  // namespace tessera::control

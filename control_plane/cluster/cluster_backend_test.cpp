// Games' backends through the whole cluster: what reports bring is stored, and orders say so and carry the messages.
#include <gmock/gmock.h>

#include "control_plane/testing/cluster_harness.h"

namespace tessera::control {
namespace {

using std::chrono::seconds;
using ::testing::HasSubstr;

class ClusterBackendTest : public ::testing::Test {
 protected:
  void SetUp() override {
    harness_.AddHost("alpha", 4);
    InstancePlan plan = TestPlan(2);
    plan.bodies = {BodyId(5)};
    plan.game_name = "game.lua";
    plan.game_hash = "feed";
    plan.contents.game = "--";
    id_ = Make(plan);
  }
  std::string Make(const InstancePlan& plan) {
    const auto made = harness_.cluster().CreateInstance(harness_.now, plan, false);
    EXPECT_TRUE(made.ok()) << made.status();
    harness_.Run(seconds(2));
    EXPECT_EQ(StateOf(harness_.cluster().state(), made->id()), v1::INSTANCE_STATE_RUNNING);
    return made->id();
  }
  FakeWorker& Worker(std::uint32_t region) { return harness_.agents["alpha"].fake.workers.at({id_, region}); }
  v1::SendToGameRequest Gift(const std::string& request_id) const {
    v1::SendToGameRequest request;
    request.set_id(id_);
    request.set_request_id(request_id);
    request.set_body(5);
    request.set_name("gift");
    return request;
  }
  void Report(std::uint32_t region, const std::function<void(v1::WorkerReport&)>& change) {
    v1::AgentMessage message;
    *message.mutable_report() = Worker(region).report;
    change(*message.mutable_report());
    harness_.Send(harness_.agents["alpha"], message);
    harness_.Pump();
  }

  ClusterHarness harness_;
  std::string id_;
};

TEST_F(ClusterBackendTest, AnEventIsStoredBeforeTheOrdersSaySo) {
  const auto publish = [](v1::WorkerReport& report) {
    v1::ReportedGameEvent& event = *report.add_game_events();
    event.set_number(1);
    event.set_name("goal");
  };
  harness_.store.FailNext(1);
  Report(2, publish);
  EXPECT_EQ(Worker(1).order.published_up_to(), 0U);
  EXPECT_EQ(harness_.cluster().GameEventsAfter(id_, 0)->size(), 0U);
  Report(2, publish);
  for (const std::uint32_t region : {1, 2}) EXPECT_EQ(Worker(region).order.published_up_to(), 1U);
  const auto events = harness_.cluster().GameEventsAfter(id_, 0);
  ASSERT_EQ(events->size(), 1U);
  EXPECT_EQ(events->front().name(), "goal");
  EXPECT_THAT(harness_.cluster().GameEventsAfter(id_, 2).status().ToString(), HasSubstr("OUT_OF_RANGE"));
  EXPECT_THAT(harness_.cluster().GameEventsAfter("inst-9", 0).status().ToString(), HasSubstr("NOT_FOUND"));
}

TEST_F(ClusterBackendTest, AMessageIsInAllOrdersUntilOneWorkerAnswers) {
  const auto number = harness_.cluster().SendToGame(harness_.now, Gift("a"));
  ASSERT_TRUE(number.ok()) << number.status();
  harness_.Pump();
  for (const std::uint32_t region : {1, 2}) {
    ASSERT_EQ(Worker(region).order.backend_messages_size(), 1);
    EXPECT_EQ(Worker(region).order.backend_messages(0).body(), 5U);
  }
  EXPECT_EQ(*harness_.cluster().SendToGame(harness_.now, Gift("a")), *number) << "the same message";
  EXPECT_EQ(harness_.cluster().GameMessageOutcome(id_, *number), std::nullopt);
  Report(1, [&](v1::WorkerReport& report) { report.add_backend_answers()->set_number(*number); });
  EXPECT_EQ(harness_.cluster().GameMessageOutcome(id_, *number), absl::OkStatus());
  for (const std::uint32_t region : {1, 2}) EXPECT_EQ(Worker(region).order.backend_messages_size(), 0);
  EXPECT_EQ(*harness_.cluster().SendToGame(harness_.now, Gift("a")), *number) << "which has been answered";
}

TEST_F(ClusterBackendTest, AWorldWithoutAGameHasNoBackend) {
  v1::SendToGameRequest request = Gift("a");
  request.set_id(Make(TestPlan(1)));
  EXPECT_THAT(harness_.cluster().SendToGame(harness_.now, request).status().ToString(),
              HasSubstr("FAILED_PRECONDITION: id: inst-2 runs no game"));
  EXPECT_THAT(harness_.cluster().GameEventsAfter("inst-2", 0).status().ToString(), HasSubstr("runs no game"));
}

}  // namespace
}  // namespace tessera::control

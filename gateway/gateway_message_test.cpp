// The JSON that a gateway sends.
#include "gateway/gateway_message.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "gateway/orders.h"
#include "gateway/web_request.h"

namespace tessera::gateway {
namespace {

using nlohmann::json;

v1::Instance TwoRegions() {
  v1::Instance instance;
  instance.set_id("inst-1");
  instance.set_state(v1::INSTANCE_STATE_DEGRADED);
  instance.set_reason("host \xff is silent");
  for (const std::uint32_t id : {1, 2}) {
    v1::MapRegion& region = *instance.mutable_map()->add_regions();
    region.set_id(id);
    region.set_standby(3 - id);
  }
  v1::RegionStatus& status = *instance.add_region_status();
  status.set_region(1);
  status.set_host("alpha");
  status.mutable_report()->set_tick(1200);
  status.mutable_report()->mutable_step()->set_p99_seconds(0.002);
  status.mutable_report()->add_connected_players(7);
  for (const std::uint32_t number : {6, 7}) {
    v1::Player& player = *instance.add_player_list();
    player.set_number(number);
    player.set_left(number == 6);
  }
  return instance;
}

TEST(GatewayMessageTest, AStatusHasEveryRegionOfTheMapAndSaysWhichAreHeard) {
  const json status = json::parse(StatusMessage(TwoRegions(), 0.5, {{1, HeardRegion()}}));
  EXPECT_EQ(status["state"], "DEGRADED");
  EXPECT_EQ(status["age_s"], 0.5);
  ASSERT_EQ(status["regions"].size(), 2u);
  EXPECT_EQ(status["regions"][0]["host"], "alpha");
  EXPECT_EQ(status["regions"][0]["step_p99_ms"], 2);
  EXPECT_EQ(status["regions"][0]["alive"], true);
  EXPECT_EQ(status["regions"][1]["alive"], false);
  EXPECT_EQ(status["regions"][1]["standby"], 1);
  EXPECT_FALSE(status["regions"][0].contains("broadcast_ms")) << "it has not sent its figures";
  const json late = json::parse(StatusMessage(TwoRegions(), 0, {{1, HeardRegion()}, {2, HeardRegion()}}));
  EXPECT_EQ(late["regions"][0]["alive"], true);
  EXPECT_EQ(late["regions"][1]["alive"], false) << "its worker is gone, whatever its connection still says";
  ASSERT_EQ(status["player_list"].size(), 1u) << "one has left";
  EXPECT_EQ(status["player_list"][0]["connected"], true);
}

TEST(GatewayMessageTest, AStatusSaysWhatBroadcastAndPredictionCost) {
  replication::RegionFigures before, now;
  before.snapshot_full = {.count = 10, .total_ns = 9'000'000};
  before.snapshot_delta = {.count = 100, .total_ns = 7'000'000};
  before.prediction = {.count = 50, .total_ns = 1'000'000};
  now.snapshot_full = {.count = 11, .total_ns = 12'000'000};    // 3 ms
  now.snapshot_delta = {.count = 129, .total_ns = 19'000'000};  // 12 ms
  now.prediction = {.count = 110, .total_ns = 7'000'000};       // 6 ms in 60 times
  const json status = json::parse(StatusMessage(TwoRegions(), 0, {{1, HeardRegion{.work = WorkOf(now, before)}}}));
  EXPECT_DOUBLE_EQ(status["regions"][0]["broadcast_ms"], 0.5);
  EXPECT_DOUBLE_EQ(status["regions"][0]["prediction_ms"], 0.1);
  EXPECT_FALSE(status["regions"][1].contains("broadcast_ms")) << "it is not heard";
  EXPECT_EQ(WorkOf(now, now).broadcast_ms, 0) << "it did nothing";
}

TEST(GatewayMessageTest, WhoMayNotIsToldWhatToDoAndNotToAskAgain) {
  for (const absl::Status& status :
       {absl::PermissionDeniedError("token eve is a viewer's; this call needs an operator's"),
        absl::UnauthenticatedError("an access token is needed")}) {
    const Problem problem = ProblemOf(status);
    EXPECT_EQ(problem.code, "not_allowed");
    EXPECT_EQ(problem.again_s, 0);
    EXPECT_THAT(problem.text, testing::HasSubstr(std::string(status.message())));
    EXPECT_THAT(problem.text, testing::HasSubstr("--token-file"));
    EXPECT_FALSE(json::parse(ProblemMessage(problem)).contains("again_s"));
  }
}

TEST(GatewayMessageTest, AProblemSaysWhetherToAskAgain) {
  const auto code = [](const absl::Status& status) { return ProblemOf(status).code; };
  EXPECT_EQ(code(absl::NotFoundError("instance x: no such instance")), "no_world");
  EXPECT_EQ(code(absl::FailedPreconditionError("inst-1 has ended")), "ended");
  EXPECT_EQ(code(absl::FailedPreconditionError("inst-1 has failed: lost")), "failed");
  EXPECT_EQ(code(absl::ResourceExhaustedError("full")), "full");
  EXPECT_EQ(code(absl::UnavailableError("nobody there")), "no_control_plane");
  EXPECT_GT(ProblemOf(absl::UnavailableError("")).again_s, 0);
  v1::Instance instance;
  instance.set_state(v1::INSTANCE_STATE_RUNNING);
  EXPECT_FALSE(ProblemOf(instance).has_value());
  instance.set_state(v1::INSTANCE_STATE_FAILED);
  instance.set_reason("no host");
  EXPECT_EQ(ProblemOf(instance)->code, "failed");
  EXPECT_THAT(ProblemOf(instance)->text, testing::HasSubstr("no host"));
}

TEST(GatewayMessageTest, IdsAreTexts) {
  client::ClientEvent event;
  event.kind = client::ClientEvent::Kind::kTriggerEntered;
  event.body = BodyId(~std::uint64_t{0});
  const json met = json::parse(MetMessage(event));
  EXPECT_EQ(met["body"], "18446744073709551615");
  event.kind = client::ClientEvent::Kind::kAppeared;
  EXPECT_EQ(MetMessage(event), "");
}

TEST(GatewayMessageTest, ACorrectionSaysOfWhichBodyAndWhy) {
  const client::ClientEvent event{.kind = client::ClientEvent::Kind::kPredictionCorrected,
                                  .body = BodyId(7),
                                  .other = BodyId(9),
                                  .detail = "0.12 m: it met body 9"};
  EXPECT_EQ(json::parse(MetMessage(event)),
            (json{{"type", "corrected"}, {"body", "7"}, {"text", "0.12 m: it met body 9"}}));
}

TEST(OrderTest, APropertyTakesAValueOfItsTypeAlone) {
  const auto why_not = [](const json& value, const PropertyValue& declared) {
    return std::string(PropertyFrom("p", value, declared).status().message());
  };
  EXPECT_EQ(PropertyFrom("p", 80, std::int64_t{0})->number(), 80);
  EXPECT_EQ(PropertyFrom("p", 1.5, 0.0)->real(), 1.5);
  EXPECT_EQ(PropertyFrom("p", "red", std::string())->text(), "red");
  EXPECT_EQ(PropertyFrom("p", json::array({1, 2, 3}), Vec3d())->vector().z(), 3);
  EXPECT_EQ(PropertyFrom("p", "17", BodyId())->body(), 17u);
  EXPECT_EQ(why_not(1.5, std::int64_t{0}), "value: must be a whole number");
  EXPECT_EQ(why_not("1", 0.0), "value: must be a number");
  EXPECT_EQ(why_not(1, true), "value: must be true or false");
  EXPECT_EQ(why_not(json::array({1, 2}), Vec3d()), "value: must be 3 numbers");
  EXPECT_EQ(why_not(17, BodyId()), "value: must be the id of a body, as a text");
}

TEST(MayConnectTest, ANameThatLeadsHereIsNotEnough) {
  EXPECT_TRUE(MayConnect("127.0.0.1:7710", "", {}));
  EXPECT_TRUE(MayConnect("127.0.0.1:7710", "http://127.0.0.1:7710", {}));
  EXPECT_TRUE(MayConnect("localhost:7710", "http://localhost:7710", {}));
  EXPECT_TRUE(MayConnect("[::1]:7710", "http://[::1]:7710", {}));
  EXPECT_FALSE(MayConnect("evil.example:7710", "http://evil.example:7710", {})) << "DNS rebinding";
  EXPECT_FALSE(MayConnect("127.0.0.1:7710", "http://evil.example", {})) << "a page of another site";
  EXPECT_FALSE(MayConnect("127.0.0.1:7710", "http://127.0.0.1:8000", {})) << "another server of this machine";
  EXPECT_FALSE(MayConnect("127.0.0.1.evil.example:80", "", {}));
  EXPECT_FALSE(MayConnect("", "", {}));
  EXPECT_TRUE(MayConnect("play.example", "https://play.example", {"https://play.example"}));
  EXPECT_TRUE(MayConnect("127.0.0.1:7710", "https://play.example", {"https://play.example"}));
}

}  // namespace
}  // namespace tessera::gateway

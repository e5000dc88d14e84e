// Whoever shows a right gives orders through a gateway, and nobody else.
#include "gateway/visitor_right.h"

#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>

#include <nlohmann/json.hpp>

#include "gateway/gateway.h"

namespace tessera::gateway {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::HasSubstr;

constexpr char kSocket[] = "unix:/nowhere/control.sock";
const std::string kCluster = "127.0.0.1:1#" + std::string(64, 'a');

TEST(VisitorRightTest, AKeyIsNewEachTimeAndNothingElseIsIt) {
  const std::string key = MakeKey();
  EXPECT_EQ(key.size(), 64u);
  EXPECT_NE(MakeKey(), key);
  EXPECT_TRUE(IsKey(key, key));
  EXPECT_FALSE(IsKey(key, key.substr(1)));
  EXPECT_FALSE(IsKey(key, "x" + key.substr(1)));
  EXPECT_FALSE(IsKey(key, ""));
  EXPECT_FALSE(IsKey("", "")) << "a gateway without a key";
}

TEST(VisitorRightTest, AKeyStandsBesideASocketAndIsServedAtLoopback) {
  EXPECT_TRUE(CheckKeyPlaces(kSocket, {"127.0.0.1", 7710}).ok());
  EXPECT_TRUE(CheckKeyPlaces(kSocket, {"::1", 7710}).ok());
  EXPECT_THAT(CheckKeyPlaces(kSocket, {"0.0.0.0", 7710}).ToString(), HasSubstr("loopback, not at 0.0.0.0"));
  EXPECT_THAT(CheckKeyPlaces(kSocket, {"10.0.0.3", 7710}).ToString(), HasSubstr("loopback, not at 10.0.0.3"));
  EXPECT_THAT(CheckKeyPlaces(kCluster, {"127.0.0.1", 7710}).ToString(), HasSubstr("by their own access tokens"));
}

GatewayOptions OptionsFor(const std::string& control, const std::string& key) {
  GatewayOptions options;
  options.control = control;
  options.control.credentials.bearer_token = "tsa_own";
  options.key = key;
  return options;
}

std::shared_ptr<grpc::Channel> NowhereChannel() {
  return grpc::CreateChannel(kSocket, grpc::InsecureChannelCredentials());
}

// A gateway whose control plane is never there, with one viewer.
class OneViewer {
 public:
  explicit OneViewer(const std::string& control, const std::string& key = "") : OneViewer(OptionsFor(control, key)) {}
  explicit OneViewer(const GatewayOptions& options) : gateway_(options, NowhereChannel(), metrics_, [] {}) {
    viewer_ = gateway_.Open("inst-1");
  }
  json Ask(json message) {
    message["number"] = ++number_;
    gateway_.Receive(viewer_, message.dump(), now_);
    const auto next = gateway_.Next(viewer_, now_);
    return next ? json::parse(next->bytes.begin(), next->bytes.end()) : json();
  }
  std::optional<std::string> Over() { return gateway_.Over(viewer_); }

 private:
  GatewayMetrics metrics_;
  Gateway gateway_;
  ViewerId viewer_ = 0;
  std::uint64_t number_ = 0;
  const Gateway::TimePoint now_ = std::chrono::steady_clock::now();
};

const json kPause{{"type", "order"}, {"order", "pause"}};

TEST(GatewayOrdersTest, NobodyOrdersByTheGatewaysOwnToken) {
  OneViewer viewer(kCluster);
  const json answer = viewer.Ask(kPause);
  EXPECT_EQ(answer["ok"], false);
  EXPECT_EQ(answer["needs"], "token");
  EXPECT_THAT(answer["text"].get<std::string>(), HasSubstr("operator's access token of your own"));
  EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"key", "abc"}})["ok"], false) << "it has none";
}

TEST(GatewayOrdersTest, NoTokenIsTakenWhereItComesInTheClear) {
  GatewayOptions options = OptionsFor(kCluster, "");
  options.takes_tokens = false;
  OneViewer viewer(options);
  const json order = viewer.Ask(kPause);
  EXPECT_FALSE(order.contains("needs")) << "nobody is asked to type one";
  EXPECT_THAT(order["text"].get<std::string>(), HasSubstr("it needs --certificate and --key, or --behind-proxy"));
  const json shown = viewer.Ask({{"type", "authorize"}, {"token", "tsa_1"}});
  EXPECT_EQ(shown["ok"], false);
  EXPECT_THAT(shown["text"].get<std::string>(), HasSubstr("in the clear"));

  GatewayMetrics metrics;
  Gateway gateway(options, NowhereChannel(), metrics, [] {});
  std::optional<absl::StatusCode> recorded;
  gateway.Record("inst-1", true, "tsa_1", [&](const auto& done) { recorded = done.status().code(); });
  EXPECT_EQ(recorded, absl::StatusCode::kPermissionDenied);
}

TEST(GatewayOrdersTest, NobodyOrdersByTheRightsOfTheSocketWithoutTheKey) {
  const std::string key = MakeKey();
  OneViewer viewer(kSocket, key);
  const json refused = viewer.Ask(kPause);
  EXPECT_EQ(refused["needs"], "key");
  EXPECT_THAT(refused["text"].get<std::string>(), HasSubstr("the whole address that `tessera up`"));
  EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"key", MakeKey()}})["ok"], false) << "another start's";
  EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"token", "tsa_1"}})["ok"], false) << "nobody would check it there";
  EXPECT_EQ(viewer.Ask(kPause)["ok"], false);
  EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"key", key}})["ok"], true);
  EXPECT_TRUE(viewer.Ask(kPause).is_null()) << "it is asked of the control plane";

  OneViewer without(kSocket);
  const json none = without.Ask(kPause);
  EXPECT_FALSE(none.contains("needs")) << "nothing helps";
  EXPECT_THAT(none["text"].get<std::string>(), HasSubstr("--key-file"));
}

TEST(GatewayOrdersTest, WhoGuessesIsClosedAtTheTenthTime) {
  OneViewer viewer(kSocket, MakeKey());
  for (int guess = 0; guess < 9; ++guess) {
    EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"key", MakeKey()}})["type"], "answer");
  }
  EXPECT_EQ(viewer.Ask({{"type", "authorize"}, {"key", MakeKey()}})["code"], "bad_message");
  EXPECT_EQ(viewer.Over(), "bad_message");
}

TEST(GatewayOrdersTest, ARecordingIsOrderedByTheSameRight) {
  const std::string key = MakeKey();
  GatewayMetrics metrics;
  Gateway gateway(OptionsFor(kSocket, key), NowhereChannel(), metrics, [] {});
  const auto code = [&](const std::string& shown) {
    std::optional<absl::StatusCode> result;
    gateway.Record("inst-1", true, shown, [&](const auto& done) { result = done.status().code(); });
    return result;
  };
  EXPECT_EQ(code(""), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(code(MakeKey()), absl::StatusCode::kPermissionDenied);
  EXPECT_EQ(code(key), absl::StatusCode::kOk) << "the recording begins once the world is joined";
  EXPECT_EQ(metrics.orders_refused.Value(), 2);
}

}  // namespace
}  // namespace tessera::gateway

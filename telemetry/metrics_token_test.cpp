#include "telemetry/metrics_token.h"

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/temporary_folder.h"
#include "prometheus/registry.h"
#include "telemetry/http_get.h"
#include "telemetry/metrics_server.h"

namespace tessera::telemetry {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

const std::string kToken = "0123456789abcdef";

class MetricsTokenTest : public ::testing::Test {
 protected:
  absl::StatusOr<std::string> Read(const std::string& content) {
    std::ofstream(path_) << content;
    return ReadMetricsToken(path_);
  }
  std::string WhyNot(const std::string& content) { return std::string(Read(content).status().message()); }

  host::TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/token";
};

TEST_F(MetricsTokenTest, IsWhatTheFileHoldsWithoutTheSpaceAroundIt) {
  EXPECT_EQ(*Read(kToken), kToken);
  EXPECT_EQ(*Read(" " + kToken + "\n"), kToken);
  EXPECT_EQ(*ReadMetricsToken(""), "") << "no file, no token";
}

TEST_F(MetricsTokenTest, AFileThatHoldsNoneIsRefusedByTheOptionsName) {
  EXPECT_THAT(std::string(ReadMetricsToken(path_).status().message()), HasSubstr("--metrics-token-file " + path_));
  EXPECT_THAT(WhyNot(""), EndsWith("holds 0 characters, not 16 to 256")) << "an empty file opens the door to nobody";
  EXPECT_THAT(WhyNot("0123456789abcde"), EndsWith("holds 15 characters, not 16 to 256"));
  EXPECT_THAT(WhyNot(std::string(257, 'x')), EndsWith("holds 257 characters, not 16 to 256"));
  EXPECT_THAT(WhyNot("01234567 89abcdef"), HasSubstr("or a space"));
  EXPECT_THAT(WhyNot("0123456789abcdef\xc3\xa9"), HasSubstr("not printable ASCII"));
}

TEST_F(MetricsTokenTest, OnlyTheWholeTokenOfABearerCounts) {
  EXPECT_TRUE(ShowsToken("Bearer " + kToken, kToken));
  const std::vector<std::string> all_wrong = {"",
                                              kToken,
                                              "Basic " + kToken,
                                              "Bearer ",
                                              "Bearer  " + kToken,
                                              "Bearer " + kToken + "0",
                                              "Bearer 0123456789abcdeF"};
  for (const std::string& wrong : all_wrong) {
    EXPECT_FALSE(ShowsToken(wrong, kToken)) << wrong;
  }
}

TEST_F(MetricsTokenTest, AServerWithOneAnswersWhoShowsItAndOthersAboutItsHealthAlone) {
  const auto server = MetricsServer::Start("127.0.0.1", 0, std::make_shared<prometheus::Registry>(), kToken);
  ASSERT_TRUE(server.ok()) << server.status();
  (*server)->AddHandler("/healthz", [](const HttpRequest&) { return HttpReply{.body = "ok\n"}; });
  (*server)->AddHandler("/sd/prometheus", [](const HttpRequest&) { return HttpReply{.body = "[]"}; });
  const std::string address = (*server)->address();
  for (const char* page : {"/metrics", "/sd/prometheus", "/nothing"}) {
    for (const std::string& shown : {std::string(), std::string("another-token-than-that")}) {
      const auto refused = HttpGet(address, page, shown);
      ASSERT_TRUE(refused.ok()) << refused.status();
      EXPECT_EQ(refused->status, 401) << page;
      EXPECT_EQ(refused->body, "the token of the metrics is needed\n");
    }
  }
  EXPECT_EQ(HttpGet(address, "/healthz")->body, "ok\n");
  EXPECT_THAT(HttpGet(address, "/metrics", kToken)->body, HasSubstr("process_"));
  EXPECT_EQ(HttpGet(address, "/sd/prometheus", kToken)->body, "[]");
  EXPECT_EQ(HttpGet(address, "/nothing", kToken)->status, 404);
}

}  // namespace
}  // namespace tessera::telemetry

#include "gateway/gateway_flags.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <string>
#include <vector>

#include "host/files.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

using testing::StartsWith;

GatewayFlags Parsed(std::vector<std::string> options) {
  GatewayFlags flags;
  CLI::App app("", "tessera-gateway");
  AddGatewayOptions(app, flags);
  std::reverse(options.begin(), options.end());  // as CLI11 takes them
  app.parse(options);
  return flags;
}

std::string Refused(std::vector<std::string> options) {
  return std::string(ReadGatewayFlags(Parsed(std::move(options))).status().message());
}

TEST(GatewayFlagsTest, TakesTokensWhereNobodyElseReadsThem) {
  const auto takes = [](std::vector<std::string> options) {
    return ReadGatewayFlags(Parsed(std::move(options)))->options.takes_tokens;
  };
  EXPECT_TRUE(takes({"--listen", "127.0.0.1:0"}));
  EXPECT_TRUE(takes({"--listen", "0.0.0.0:0", "--behind-proxy"}));
  EXPECT_FALSE(takes({"--listen", "0.0.0.0:0"}));
}

TEST(GatewayFlagsTest, ReadsTheTokenWithoutTheSpaceAroundIt) {
  const host::TemporaryFolder folder;
  const std::string file = folder.path() + "/token";
  ASSERT_TRUE(host::WriteFile(file, " tsa_secret\n", host::Durability::kSurvivesProcess).ok());
  const auto read = ReadGatewayFlags(Parsed({"--token-file", file, "--recording-mb", "2", "--recordings-mb", "7"}));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->options.control.credentials.bearer_token, "tsa_secret");
  EXPECT_EQ(read->options.recording_limits.file_bytes, 2'000'000u);
  EXPECT_FALSE(read->certificate.has_value());
  EXPECT_TRUE(read->options.sees_addresses);
}

TEST(GatewayFlagsTest, SaysWhichOptionIsWrong) {
  EXPECT_THROW(Parsed({"--listen", "nowhere"}), CLI::ValidationError);
  EXPECT_THAT(Refused({"--certificate", "chain.pem"}), StartsWith("--certificate and --key are given together"));
  EXPECT_THAT(Refused({"--certificate", "/none/chain.pem", "--key", "/none/key.pem"}), StartsWith("--certificate "));
  EXPECT_THAT(Refused({"--token-file", "/none/token"}), StartsWith("--token-file "));
  EXPECT_THAT(Refused({"--players-door", "nowhere"}), StartsWith("--players-door "));
  EXPECT_THAT(Refused({"--behind-proxy", "--max-connections-per-address", "3"}),
              StartsWith("--max-connections-per-address: not with --behind-proxy"));
}

}  // namespace
}  // namespace tessera::gateway

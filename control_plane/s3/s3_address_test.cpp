// Addresses and settings of an object store, from options and the environment.
#include "control_plane/s3/s3_address.h"

#include <gmock/gmock.h>

#include <map>

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

Environment With(std::map<std::string, std::string> variables) {
  return [variables = std::move(variables)](const char* name) -> std::optional<std::string> {
    const auto found = variables.find(name);
    if (found == variables.end()) return std::nullopt;
    return found->second;
  };
}

const std::map<std::string, std::string> kWho = {{"AWS_ACCESS_KEY_ID", "AK"}, {"AWS_SECRET_ACCESS_KEY", "SK"}};

std::string ErrorOf(const std::string& address, const std::string& endpoint = "", const std::string& region = "",
                    const Environment& environment = With(kWho)) {
  const auto settings = MakeS3Settings(address, endpoint, region, environment);
  EXPECT_EQ(settings.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(settings.status().message());
}

TEST(S3AddressTest, HasABucketAndAPrefix) {
  const auto whole = ParseS3Address("s3://my-worlds.eu/tessera/prod");
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(whole->bucket, "my-worlds.eu");
  EXPECT_EQ(whole->prefix, "tessera/prod/");
  EXPECT_EQ(ParseS3Address("s3://worlds")->prefix, "");
  EXPECT_EQ(ParseS3Address("s3://worlds/")->prefix, "");
  EXPECT_EQ(ParseS3Address("s3://worlds/a/")->prefix, "a/");
}

TEST(S3AddressTest, WhatIsNoneIsRefusedByWhatIsWrong) {
  for (const std::string bucket : {"s3://", "s3://ab", "s3://Worlds/x", "s3://wor_lds", "s3://a..b", "s3:///x"}) {
    EXPECT_THAT(ErrorOf(bucket), HasSubstr("a bucket has 3 to 63")) << bucket;
  }
  for (const std::string prefix : {"s3://worlds/a//b", "s3://worlds/../x", "s3://worlds/a b", "s3://worlds/a?x=1"}) {
    EXPECT_THAT(ErrorOf(prefix), HasSubstr("a prefix has at most 512")) << prefix;
  }
  EXPECT_THAT(ErrorOf("s3://worlds/" + std::string(513, 'a')), HasSubstr("a prefix has at most 512"));
}

TEST(S3AddressTest, SettingsComeFromOptionsAndTheEnvironment) {
  const auto settings = MakeS3Settings("s3://worlds/t", "https://minio.example:9000/", "eu-1", With(kWho));
  ASSERT_TRUE(settings.ok()) << settings.status();
  EXPECT_EQ(settings->endpoint, "https://minio.example:9000");
  EXPECT_EQ(settings->region, "eu-1");
  EXPECT_EQ(settings->access_key, "AK");
  EXPECT_EQ(settings->secret_key, "SK");
  EXPECT_EQ(settings->session_token, "");

  auto more = kWho;
  more["AWS_REGION"] = "eu-central-1";
  more["AWS_SESSION_TOKEN"] = "ST";
  const auto amazons = MakeS3Settings("s3://worlds", "", "", With(more));
  ASSERT_TRUE(amazons.ok()) << amazons.status();
  EXPECT_EQ(amazons->endpoint, "https://s3.eu-central-1.amazonaws.com");
  EXPECT_EQ(amazons->session_token, "ST");
  EXPECT_EQ(MakeS3Settings("s3://worlds", "", "", With(kWho))->region, "us-east-1");
}

TEST(S3AddressTest, EachMissingOrWrongSettingIsNamed) {
  EXPECT_THAT(ErrorOf("s3://worlds", "", "", With({{"AWS_SECRET_ACCESS_KEY", "SK"}})), HasSubstr("AWS_ACCESS_KEY_ID"));
  EXPECT_THAT(ErrorOf("s3://worlds", "", "", With({{"AWS_ACCESS_KEY_ID", "AK"}})), HasSubstr("AWS_SECRET_ACCESS_KEY"));
  EXPECT_THAT(ErrorOf("s3://worlds", "", "eu 1"), HasSubstr("s3_region: eu 1"));
  EXPECT_THAT(ErrorOf("s3://worlds", "http://store.example"), HasSubstr("is not encrypted"));
  EXPECT_TRUE(MakeS3Settings("s3://worlds", "http://127.0.0.1:9000", "", With(kWho)).ok());
  for (const std::string endpoint : {"minio:9000", "https://", "https://host/path", "ftp://host", "https://a@b"}) {
    EXPECT_THAT(ErrorOf("s3://worlds", endpoint), HasSubstr("s3_endpoint: ")) << endpoint;
  }
}

}  // namespace
}  // namespace tessera::control

#include "control_plane/etcd/etcd_address.h"

#include <gmock/gmock.h>

#include "absl/strings/str_cat.h"
#include "control_plane/etcd/etcd_client.h"

namespace tessera::control {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(EtcdAddressTest, NamesMembersAndAPrefix) {
  const auto address = ParseEtcdAddress("etcd://10.0.0.1:2379,[::1]:2380/clusters/blue");
  ASSERT_TRUE(address.ok()) << address.status();
  EXPECT_THAT(address->endpoints, ElementsAre("10.0.0.1:2379", "[::1]:2380"));
  EXPECT_EQ(address->prefix, "clusters/blue");
  EXPECT_FALSE(address->is_local);
  const auto local = ParseEtcdAddress("etcd://127.0.0.1:2379,localhost:2380");
  ASSERT_TRUE(local.ok()) << local.status();
  EXPECT_EQ(local->prefix, "tessera");
  EXPECT_TRUE(local->is_local);
}

TEST(EtcdAddressTest, SaysWhatIsWrong) {
  const std::pair<const char*, const char*> wrong[] = {
      {"http://a:1", "\"http://a:1\" is not of the form etcd://"},
      {"etcd://", "\"\" is not of the form HOST:PORT"},
      {"etcd://a:1,/x", "\"\" is not of the form HOST:PORT"},
      {"etcd://a/x", "\"a\" is not of the form HOST:PORT"},
      {"etcd://a:1/", "\"\" is no prefix of keys"},
      {"etcd://a:1/x//y", "\"x//y\" is no prefix of keys"},
      {"etcd://a:1/x y", "\"x y\" is no prefix of keys"},
  };
  for (const auto& [text, error] : wrong) {
    const auto address = ParseEtcdAddress(text);
    EXPECT_EQ(address.status().code(), absl::StatusCode::kInvalidArgument) << text;
    EXPECT_THAT(std::string(address.status().message()), HasSubstr(error)) << text;
  }
  std::string many = "etcd://a:1";
  for (int i = 0; i < 16; ++i) absl::StrAppend(&many, ",a:1");
  EXPECT_THAT(std::string(ParseEtcdAddress(many).status().message()), HasSubstr("names 17 members of etcd"));
}

TEST(EtcdClientTest, SendsNoSecretsInTheClear) {
  const auto far = EtcdClient::Make(*ParseEtcdAddress("etcd://10.0.0.1:2379"), {});
  EXPECT_THAT(std::string(far.status().message()), HasSubstr("by TLS alone"));
  const auto half = EtcdClient::Make(*ParseEtcdAddress("etcd://10.0.0.1:2379"),
                                     {.authority = "pem", .certificate = "pem", .key = ""});
  EXPECT_THAT(std::string(half.status().message()), HasSubstr("go together"));
}

TEST(EtcdClientTest, TheEndOfARangeIsTheNextPrefix) {
  EXPECT_EQ(EtcdRangeEnd("a/"), "a0");
  EXPECT_EQ(EtcdRangeEnd("a\xff\xff"), "b");
}

}  // namespace
}  // namespace tessera::control

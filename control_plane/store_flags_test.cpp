#include "control_plane/store_flags.h"

#include <gmock/gmock.h>

#include "host/files.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

StoreFlags Etcd() {
  StoreFlags flags;
  flags.store = "etcd://127.0.0.1:2379/blue";
  return flags;
}

TEST(StoreFlagsTest, WithoutAStoreThereIsNoEtcd) {
  StoreFlags flags;
  EXPECT_TRUE(CheckStoreFlags(flags, "0.0.0.0:0", "", "").ok());
  EXPECT_FALSE(flags.etcd.has_value());
}

TEST(StoreFlagsTest, OthersReachTheDoorsAtTheAdvertisedAddress) {
  StoreFlags flags = Etcd();
  ASSERT_TRUE(CheckStoreFlags(flags, "10.0.0.1:7700", "", "/shared").ok());
  EXPECT_EQ(flags.etcd->prefix, "blue");
  EXPECT_EQ(flags.self, (LeaderAddress{.operators = "10.0.0.1:7700", .players = ""}));
  flags.advertise_host = "control-1.example";
  ASSERT_TRUE(CheckStoreFlags(flags, "0.0.0.0:7700", "0.0.0.0:7703", "/shared").ok());
  EXPECT_EQ(flags.self, (LeaderAddress{.operators = "control-1.example:7700", .players = "control-1.example:7703"}));
}

TEST(StoreFlagsTest, SaysWhichOptionIsWrong) {
  const auto message = [](StoreFlags flags, const std::string& listen, const std::string& checkpoints) {
    return std::string(CheckStoreFlags(flags, listen, "", checkpoints).message());
  };
  EXPECT_THAT(message(Etcd(), "10.0.0.1:7700", ""), StartsWith("--checkpoints: missing"));
  EXPECT_THAT(message(Etcd(), "10.0.0.1:0", "/shared"), StartsWith("--listen: with --store"));
  EXPECT_THAT(message(Etcd(), "0.0.0.0:7700", "/shared"),
              StartsWith("--advertise-address: 0.0.0.0:7700 is no address"));
  StoreFlags flags = Etcd();
  flags.store = "etcd://10.0.0.9:2379";
  EXPECT_THAT(message(flags, "", "/shared"), StartsWith("--store-authority: missing"));
  flags = Etcd();
  flags.key = "key.pem";
  EXPECT_THAT(message(flags, "", "/shared"), StartsWith("--store-certificate: "));
  flags = Etcd();
  flags.store = "";
  flags.authority = "ca.pem";
  EXPECT_THAT(message(flags, "", ""), StartsWith("--store-authority: only with --store"));
}

TEST(StoreFlagsTest, FilesThatCannotBeReadAreNamed) {
  const host::TemporaryFolder folder;
  StoreFlags flags = Etcd();
  flags.authority = folder.path() + "/none.pem";
  ASSERT_TRUE(CheckStoreFlags(flags, "", "", "/shared").ok());
  EXPECT_THAT(std::string(ConnectStore(flags).status().message()), StartsWith("--store-authority /"));
  ASSERT_TRUE(host::WriteFile(flags.authority, "hello", host::Durability::kSurvivesProcess).ok());
  EXPECT_THAT(std::string(ConnectStore(flags).status().message()), HasSubstr("is no PEM file"));
}

}  // namespace
}  // namespace tessera::control

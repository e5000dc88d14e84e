// A cluster goes from one store to another: SQLite's backup into an etcd that is empty, and into none that is not.
#include "control_plane/etcd_restore.h"

#include <gmock/gmock.h>

#include "control_plane/etcd/etcd_store.h"
#include "control_plane/sqlite_store.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/fake_etcd.h"
#include "control_plane/testing/state_rig.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

constexpr char kRestorePrefix[] = "moved";

class EtcdRestoreTest : public ::testing::Test {
 protected:
  EtcdRestoreTest() : client_(etcd_.Connect()) {
    // A cluster with a world, in a file of SQLite.
    HostEntry &alpha = rig_.AddHost("alpha"), &beta = rig_.AddHost("beta");
    rig_.AddRunning({&alpha, &beta});
    const auto file = SqliteStore::Open(folder_.path() + "/control.db");
    EXPECT_TRUE(file.ok()) << file.status();
    const auto entries = *rig_.store.List("");
    std::vector<StoreOp> puts;
    puts.reserve(entries.size());
    for (const StoreEntry& entry : entries) puts.push_back(PutOp(entry.key, entry.value, kAbsent));
    EXPECT_TRUE((*file)->Txn(puts).ok());
    EXPECT_TRUE(WriteBackup(**file, [this](std::string_view bytes) {
                  backup_.append(bytes);
                  return absl::OkStatus();
                }).ok());
  }
  absl::StatusOr<RestoreReport> Restore() {
    return RestoreIntoEtcd(*client_, kRestorePrefix, {.operators = "10.0.0.1:7700", .players = ""}, backup_);
  }

  StateRig rig_;
  host::TemporaryFolder folder_;
  FakeEtcd etcd_;
  std::unique_ptr<EtcdClient> client_;
  std::string backup_;
};

TEST_F(EtcdRestoreTest, ABackupOfSqliteBecomesAStoreInEtcdWhichTheNextLeaderReads) {
  const auto report = Restore();
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->hosts, 2u);
  EXPECT_EQ(report->instances, 1u);

  EtcdElection election(*client_, kRestorePrefix, {.operators = "10.0.0.2:7700", .players = ""});
  const auto fence = election.Campaign([](const auto&) {}, [] { return false; });
  ASSERT_TRUE(fence.ok()) << "the seat was given up: " << fence.status();
  const auto store = EtcdStore::Open(*client_, kRestorePrefix, *fence, [] {});
  ASSERT_TRUE(store.ok()) << store.status();
  const auto was = ReadRecords(rig_.store), is = ReadRecords(**store);
  ASSERT_TRUE(is.ok()) << is.status();
  ASSERT_EQ(is->hosts.size(), was->hosts.size());
  EXPECT_EQ(is->hosts[1].record.SerializeAsString(), was->hosts[1].record.SerializeAsString());
  EXPECT_EQ(is->contents.begin()->second.bytes, was->contents.begin()->second.bytes);
  EXPECT_EQ(is->instances[0].record.map().SerializeAsString(), was->instances[0].record.map().SerializeAsString());
  EXPECT_TRUE(is->counters.record.recovering()) << "it takes up what runs before it orders anything";
  EXPECT_EQ(is->counters.record.lives(), was->counters.record.lives() + kRestoreJump);
}

TEST_F(EtcdRestoreTest, NothingIsWrittenOverACluster) {
  ASSERT_TRUE(Restore().ok());
  const auto again = Restore();
  EXPECT_EQ(again.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(again.status().message()), HasSubstr("holds a cluster already"));
}

TEST_F(EtcdRestoreTest, WhereAControlPlaneLeadsNothingIsWritten) {
  EtcdElection election(*client_, kRestorePrefix, {.operators = "10.0.0.2:7700", .players = ""});
  ASSERT_TRUE(election.Campaign([](const auto&) {}, [] { return false; }).ok());
  const auto refused = Restore();
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("a control plane leads at moved"));
  EXPECT_FALSE(ReadEtcdValue(*client_, kRestorePrefix, kCountersKey).ok());
}

TEST_F(EtcdRestoreTest, ADamagedBackupLeavesEtcdEmpty) {
  backup_.resize(backup_.size() - 1);
  EXPECT_EQ(Restore().status().code(), absl::StatusCode::kDataLoss);
  EXPECT_FALSE(ReadEtcdValue(*client_, kRestorePrefix, kCountersKey).ok());
}

}  // namespace
}  // namespace tessera::control

#include "control_plane/backup.h"

#include <gmock/gmock.h>

#include "control_plane/memory_store.h"
#include "control_plane/stored_records.h"
#include "control_plane/testing/state_rig.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

std::string FileOf(const Store& store) {
  std::string file;
  EXPECT_TRUE(WriteBackup(store, [&file](std::string_view bytes) {
                file.append(bytes);
                return absl::OkStatus();
              }).ok());
  return file;
}

// A store with two hosts and a world on them.
class BackupTest : public ::testing::Test {
 protected:
  BackupTest() {
    HostEntry &alpha = rig_.AddHost("alpha"), &beta = rig_.AddHost("beta");
    rig_.AddRunning({&alpha, &beta});
    file_ = FileOf(rig_.store);
  }

  StateRig rig_;
  std::string file_;
};

TEST_F(BackupTest, AStoreThatIsMadeOfItHasEverythingAndCountsOnFromFarAbove) {
  MemoryStore made;
  const auto report = RestoreBackup(file_, made);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->hosts, 2u);
  EXPECT_EQ(report->instances, 1u);
  const auto before = rig_.store.List(""), after = made.List("");
  ASSERT_EQ(before->size(), after->size());
  for (std::size_t i = 0; i < before->size(); ++i) EXPECT_EQ((*before)[i].key, (*after)[i].key);
  const StoredRecords was = *ReadRecords(rig_.store), is = *ReadRecords(made);
  EXPECT_EQ(is.hosts[1].record.SerializeAsString(), was.hosts[1].record.SerializeAsString());
  EXPECT_EQ(is.contents.begin()->second.bytes, was.contents.begin()->second.bytes);
  EXPECT_TRUE(is.counters.record.recovering());
  EXPECT_EQ(is.counters.record.lives(), was.counters.record.lives() + kRestoreJump);
  EXPECT_GE(is.counters.record.last_host(), was.counters.record.last_host() + kRestoreJump);
  EXPECT_GE(is.counters.record.last_instance(), was.counters.record.last_instance() + kRestoreJump);
  const records::Instance &old = was.instances[0].record, &world = is.instances[0].record;
  EXPECT_EQ(world.map().SerializeAsString(), old.map().SerializeAsString());
  EXPECT_EQ(world.last_incarnation(), old.last_incarnation() + kRestoreJump);
  EXPECT_GE(world.last_map_version(), old.map().version() + kRestoreJump);
  EXPECT_EQ(world.last_player(), old.last_player() + kRestoreJump);
}

// The second knows nothing of the first, whose hosts may be named by what agents keep.
TEST_F(BackupTest, TwoStoresThatAreMadeOfItGiveOutOtherIds) {
  const auto last = [this](char drawn) {
    MemoryStore made;
    EXPECT_TRUE(RestoreBackup(file_, made, [drawn](std::size_t n) { return std::string(n, drawn); }).ok());
    return ReadRecords(made)->counters.record;
  };
  const records::Counters was = ReadRecords(rig_.store)->counters.record, one = last(1), two = last(2);
  EXPECT_EQ(one.last_host(), was.last_host() + kRestoreJump + 0x0101010101010101u % kRestoreSpread);
  EXPECT_EQ(two.last_host(), was.last_host() + kRestoreJump + 0x0202020202020202u % kRestoreSpread);
  EXPECT_EQ(one.last_instance(), was.last_instance() + kRestoreJump + 0x0101010101010101u % kRestoreSpread);
  EXPECT_EQ(one.lives(), two.lives()) << "of lives it matters which is later: NoteRevision raises them";
}

TEST_F(BackupTest, FilesOfMeshesAreLeftOut) {
  const std::string sha256(64, 'a');
  ASSERT_TRUE(rig_.store.Put(VisualKey(sha256), "record", kAbsent).ok());
  ASSERT_TRUE(rig_.store.Put(VisualPieceKey(sha256, 0), "piece", kAbsent).ok());
  EXPECT_EQ(FileOf(rig_.store), file_);
}

TEST_F(BackupTest, NothingIsWrittenOverACluster) {
  EXPECT_THAT(std::string(RestoreBackup(file_, rig_.store).status().message()), HasSubstr("holds a cluster already"));
  EXPECT_FALSE(ReadRecords(rig_.store)->counters.record.recovering());
}

TEST_F(BackupTest, AFileThatIsCutShortAnywhereIsRefusedWhole) {
  for (std::size_t length = 0; length < file_.size(); length += 1 + length / 50) {
    MemoryStore made;
    EXPECT_FALSE(RestoreBackup(file_.substr(0, length), made).ok()) << length;
    EXPECT_EQ(made.revision(), 0) << length;
  }
}

TEST_F(BackupTest, ABitThatFlippedIsFound) {
  for (std::size_t at = 0; at < file_.size(); at += 1 + at / 50) {
    std::string damaged = file_;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    MemoryStore made;
    EXPECT_FALSE(RestoreBackup(damaged, made).ok()) << at;
    EXPECT_EQ(made.revision(), 0) << at;
  }
}

TEST_F(BackupTest, OtherFilesAndNewerVersionsAreToldApart) {
  MemoryStore made;
  EXPECT_THAT(std::string(RestoreBackup("SQLite format 3", made).status().message()), HasSubstr("is no backup"));
  EXPECT_THAT(std::string(RestoreBackup("tessera backup 2\n", made).status().message()), HasSubstr("newer version"));
}

// Its sum is right, and it is not ours all the same: found before anything is written.
TEST_F(BackupTest, ARecordThatCannotBeReadIsNamed) {
  MemoryStore broken;
  ASSERT_TRUE(broken.Put(kCountersKey, "", kAbsent).ok());
  ASSERT_TRUE(broken.Put(InstanceKey(7), "no record", kAbsent).ok());
  MemoryStore made;
  EXPECT_THAT(std::string(RestoreBackup(FileOf(broken), made).status().message()), HasSubstr("instance/7"));
  EXPECT_EQ(made.revision(), 0);
}

TEST(RevocationsBackupTest, ARestoreCountsOnFromFarAboveAndKnowsWhatItMayHaveLost) {
  records::Revocations record;
  record.set_number(5);
  Raise(record);
  EXPECT_EQ(record.number(), 5 + kRestoreJump);
  EXPECT_EQ(record.lost_after(), 5u);
  EXPECT_EQ(record.lost_up_to(), 5 + kRestoreJump);
}

}  // namespace
}  // namespace tessera::control

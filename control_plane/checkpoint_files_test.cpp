// Checkpoints on disk.
#include "control_plane/checkpoint_files.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using ::testing::HasSubstr;

class CheckpointFilesTest : public testing::Test {
 protected:
  void Make(std::uint64_t tick) {
    records::Manifest manifest;
    manifest.set_tick(tick);
    for (const std::string name : {"region-1", "region-2", "scene"}) {
      const std::string bytes = name + " at " + std::to_string(tick);
      ASSERT_TRUE(files_->Put("inst-1", tick, name, bytes).ok());
      records::ManifestFile& file = *manifest.add_files();
      file.set_name(name);
      file.set_size(bytes.size());
      file.set_hash(Sha256Hex(bytes));
    }
    ASSERT_TRUE(files_->Complete("inst-1", manifest).ok());
  }

  host::TemporaryFolder temporary_;
  std::string folder_ = temporary_.path();
  std::unique_ptr<CheckpointFiles> files_ = *CheckpointFiles::Open(folder_);
};

TEST_F(CheckpointFilesTest, KeepsWhatWasPut) {
  Make(60);
  EXPECT_TRUE(files_->Check("inst-1", 60).ok());
  EXPECT_EQ(*files_->Read("inst-1", 60, "region-2"), "region-2 at 60");
  EXPECT_EQ(files_->Check("inst-1", 61).code(), absl::StatusCode::kNotFound);
}

TEST_F(CheckpointFilesTest, NamesTheDamagedFile) {
  for (const std::string name : {"region-1", "region-2", "scene", "manifest"}) {
    Make(60);
    const std::string path = folder_ + "/inst-1/60/" + name;
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(3);
    file.put('#');
    file.close();
    const absl::Status status = files_->Check("inst-1", 60);
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    EXPECT_THAT(status.message(), HasSubstr("checkpoint 60 of inst-1: " + name + ": has another checksum"));
  }
}

TEST_F(CheckpointFilesTest, ForgetsWhatWasHalfMade) {
  ASSERT_TRUE(files_->Put("inst-1", 120, "region-1", "half").ok());
  files_ = *CheckpointFiles::Open(folder_);
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/inst-1/.120"));
  EXPECT_EQ(files_->Check("inst-1", 120).code(), absl::StatusCode::kNotFound);
}

TEST(CheckpointRoomTest, CheckpointsLeaveTheReserveToTheStore) {
  const host::TemporaryFolder folder;
  const auto free = CheckpointFiles::Open(folder.path());
  ASSERT_TRUE(free.ok());
  EXPECT_TRUE((*free)->CheckRoom(1000).ok());
  EXPECT_TRUE((*free)->Put("inst-1", 7, "region-1", "bytes").ok());
  // More than any disk has.
  constexpr std::uint64_t kAll = std::uint64_t{1} << 62;
  const auto full = CheckpointFiles::Open(folder.path(), kAll);
  ASSERT_TRUE(full.ok());
  EXPECT_EQ((*full)->CheckRoom(0).code(), absl::StatusCode::kResourceExhausted);
  const absl::Status refused = (*full)->Put("inst-1", 8, "region-1", "bytes");
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("are kept for the store"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() + "/inst-1/.8")) << "nothing half made is left";
}

}  // namespace
}  // namespace tessera::control

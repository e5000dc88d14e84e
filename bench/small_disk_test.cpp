#include "bench/small_disk.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace tessera::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kDiskBytes = 2 << 20;

bool Writes(const std::string& path, std::size_t bytes) {
  std::ofstream file(path);
  file << std::string(bytes, 'x');
  file.close();
  return file.good();
}

TEST(SmallDiskTest, TakesNothingWhileItIsFullAndAllOnceItIsNot) {
  if (const absl::Status own = EnterOwnMounts(); !own.ok()) GTEST_SKIP() << "no mounts here: " << own;
  const std::string folder = testing::TempDir() + "small-disk-test";
  fs::create_directories(folder);
  {
    const auto disk = SmallDisk::Mount(folder, kDiskBytes);
    ASSERT_TRUE(disk.ok()) << disk.status();
    EXPECT_TRUE(Writes(folder + "/before", 1 << 20));
    EXPECT_FALSE(Writes(folder + "/larger", 2 << 20)) << "it is small";
    fs::remove(folder + "/larger");
    for (int i = 0; i < 2; ++i) {
      ASSERT_EQ((*disk)->Fill(), absl::OkStatus());
      EXPECT_FALSE(Writes(folder + "/during", 1));
      EXPECT_EQ(fs::file_size(folder + "/before"), 1U << 20) << "what there was stays";
    }
    (*disk)->Free();
    EXPECT_TRUE(Writes(folder + "/after", 1 << 19));
  }
  EXPECT_FALSE(fs::exists(folder + "/before")) << "it is gone with the object";
  fs::remove(folder);
}

TEST(SmallDiskTest, AFolderThatCannotBeMadeIsNamed) {
  const auto disk = SmallDisk::Mount("/proc/small-disk-test", kDiskBytes);
  ASSERT_FALSE(disk.ok());
  EXPECT_NE(std::string(disk.status().message()).find("/proc/small-disk-test"), std::string::npos);
}

}  // namespace
}  // namespace tessera::bench

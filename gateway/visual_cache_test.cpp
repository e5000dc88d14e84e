// A folder of files by their hash that stays within its bounds.
#include "gateway/visual_cache.h"

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "core/world/sha256.h"
#include "host/temporary_folder.h"

namespace tessera::gateway {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VisualCacheTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(cache_.Open().ok()); }
  std::string Put(const std::string& bytes) {
    std::string sha256 = Sha256Hex(bytes);
    cache_.Put(sha256, bytes);
    return sha256;
  }
  fs::path PathOf(const std::string& sha256) const { return folder_.path() + "/cache/" + sha256 + ".glb"; }
  void UsedAgo(const std::string& sha256, std::chrono::hours ago) {
    fs::last_write_time(PathOf(sha256), fs::file_time_type::clock::now() - ago);
  }

  const host::TemporaryFolder folder_;
  VisualCache cache_{folder_.path() + "/cache", 1000};
};

TEST_F(VisualCacheTest, WhatIsPutIsThereForTheNextOne) {
  const std::string sha256 = Put("glTF");
  EXPECT_EQ(*cache_.Get(sha256), "glTF");
  const VisualCache next(folder_.path() + "/cache", 1000);
  ASSERT_TRUE(next.Open().ok());
  EXPECT_EQ(*next.Get(sha256), "glTF");
  EXPECT_EQ(next.Get(Sha256Hex("none")).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(VisualCacheTest, ADamagedFileIsRemovedAndMissing) {
  const std::string sha256 = Put("whole");
  std::ofstream(PathOf(sha256), std::ios::binary) << "whol";
  EXPECT_EQ(cache_.Get(sha256).status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(fs::exists(PathOf(sha256)));
}

TEST_F(VisualCacheTest, WhatWasNotAskedForLongestGoesFirst) {
  const std::string one = Put(std::string(400, '1')), two = Put(std::string(400, '2'));
  UsedAgo(one, std::chrono::hours(2));
  UsedAgo(two, std::chrono::hours(1));
  ASSERT_TRUE(cache_.Get(one).ok());
  const std::string three = Put(std::string(400, '3'));
  EXPECT_TRUE(cache_.Get(one).ok());
  EXPECT_FALSE(cache_.Get(two).ok());
  EXPECT_TRUE(cache_.Get(three).ok());
}

TEST_F(VisualCacheTest, WhatIsTooLargeIsNotKeptAndDrivesNothingOut) {
  const std::string small = Put("small");
  const std::string large = Put(std::string(1001, 'x'));
  EXPECT_TRUE(cache_.Get(small).ok());
  EXPECT_FALSE(cache_.Get(large).ok());
}

TEST_F(VisualCacheTest, ASmallerBoundHoldsFromTheStartAndOtherFilesStay) {
  const std::string one = Put(std::string(600, '1'));
  std::ofstream(folder_.path() + "/cache/notes.txt") << std::string(2000, 'n');
  const VisualCache next(folder_.path() + "/cache", 500);
  ASSERT_TRUE(next.Open().ok());
  EXPECT_FALSE(fs::exists(PathOf(one)));
  EXPECT_TRUE(fs::exists(folder_.path() + "/cache/notes.txt"));
}

TEST_F(VisualCacheTest, AFolderThatCannotBeMadeIsNamed) {
  std::ofstream(folder_.path() + "/file") << "x";
  const absl::Status status = VisualCache(folder_.path() + "/file/cache", 1).Open();
  EXPECT_THAT(std::string(status.message()), HasSubstr("--visual-cache " + folder_.path() + "/file/cache"));
}

TEST(VisualCacheNoneTest, WithoutAFolderNothingIsKept) {
  const VisualCache cache;
  EXPECT_TRUE(cache.Open().ok());
  cache.Put(Sha256Hex("x"), "x");
  EXPECT_FALSE(cache.Get(Sha256Hex("x")).ok());
}

}  // namespace
}  // namespace tessera::gateway

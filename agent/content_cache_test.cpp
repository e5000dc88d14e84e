// Scenes and games that nobody needs any more, under a virtual clock.
#include "agent/content_cache.h"

#include <filesystem>
#include <fstream>
#include <memory>

#include "absl/strings/str_cat.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "host/temporary_folder.h"

namespace tessera::agent {
namespace {

namespace fs = std::filesystem;

class ContentCacheTest : public ::testing::Test {
 protected:
  Content Put(ContentKind kind, const std::string& hash) {
    const Content content{kind, hash};
    std::ofstream(state_->ContentPath(content)) << "content";
    return content;
  }
  bool IsThere(const Content& content) const { return fs::exists(state_->ContentPath(content)); }
  std::size_t Files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(state_->ScenesPath()), {}));
  }
  // As the agent does.
  void Pass(Duration time, const std::set<Content>& named) {
    for (const TimePoint end = now_ + time; now_ < end;) {
      now_ += kContentLook;
      cache_.RemoveUnnamed(named, now_);
    }
  }

  host::TemporaryFolder temporary_;
  std::unique_ptr<StateDir> state_ = StateDir::Open(temporary_.path()).value();
  ContentCache cache_{std::make_shared<EventLoop>(),
                      *state_,
                      {.on_ready = [](const auto&, const auto&) {}, .on_failed = [](const auto&, const auto&) {}}};
  TimePoint now_ = TimePoint(std::chrono::hours(1));
};

TEST_F(ContentCacheTest, WhatNoOrderHasNamedForAnHourIsRemoved) {
  const Content scene = Put(ContentKind::kScene, "used"), game = Put(ContentKind::kGame, "used"),
                old_scene = Put(ContentKind::kScene, "old"), old_game = Put(ContentKind::kGame, "old");
  const fs::path cut_short = state_->ContentPath(old_scene) + ".aB3xYz";  // by a machine that died
  std::ofstream(cut_short) << "con";
  Pass(kContentKept, {scene, game});
  EXPECT_TRUE(IsThere(old_scene)) << "it was not looked at for a whole hour";
  Pass(kContentLook, {scene, game});
  EXPECT_FALSE(IsThere(old_scene) || IsThere(old_game) || fs::exists(cut_short));
  EXPECT_TRUE(IsThere(scene) && IsThere(game));
  Pass(10 * kContentKept, {scene, game});
  EXPECT_TRUE(IsThere(scene) && IsThere(game));
}

TEST_F(ContentCacheTest, TheHourBeginsAnewWhenAnOrderNamesItAgain) {
  const Content scene = Put(ContentKind::kScene, "a"), wanted = Put(ContentKind::kScene, "b");
  for (int i = 0; i < 5; ++i) {
    Pass(kContentKept - kContentLook, {});
    Pass(kContentLook, {scene});
    cache_.Want(wanted);  // and the order that did is gone before the agent looks
  }
  EXPECT_TRUE(IsThere(scene) && IsThere(wanted));
  Pass(kContentKept + kContentLook, {});
  EXPECT_FALSE(IsThere(scene));
}

TEST_F(ContentCacheTest, OneLookRemovesABoundedNumber) {
  for (std::size_t i = 0; i < 2 * kContentsRemovedAtOnce + 1; ++i) Put(ContentKind::kScene, absl::StrCat(i));
  Pass(kContentKept, {});
  ASSERT_EQ(Files(), 2 * kContentsRemovedAtOnce + 1);
  Pass(kContentLook, {});
  EXPECT_EQ(Files(), kContentsRemovedAtOnce + 1);
  Pass(kContentLook, {});
  EXPECT_EQ(Files(), 1U);
  Pass(kContentLook, {});
  EXPECT_EQ(Files(), 0U);
}

}  // namespace
}  // namespace tessera::agent

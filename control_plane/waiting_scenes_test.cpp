// Scenes that wait for their worlds: whole or not at all, within a quota, for as long as their grace.
#include "control_plane/waiting_scenes.h"

#include <gmock/gmock.h>
#include <sodium.h>

#include <optional>
#include <string>
#include <utility>

#include "core/world/scene_io.h"
#include "core/world/scene_load.h"
#include "host/temporary_folder.h"

namespace tessera::control {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr std::uint64_t kRoom = 1'000'000;
constexpr Steady kBegin = 1h;

class WaitingScenesTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { ASSERT_GE(sodium_init(), 0); }

  // A scene of some size, by its name.
  static v1::Scene SceneNamed(const std::string& name) {
    v1::Scene scene;
    scene.set_name(name);
    return scene;
  }
  DraftFile DraftWith(const std::string& bytes) const {
    auto draft = DraftFile::Create(folder_.path());
    EXPECT_TRUE(draft.ok()) << draft.status();
    EXPECT_TRUE(draft->Append(bytes).ok());
    return *std::move(draft);
  }
  absl::Status Put(const v1::Scene& scene, Steady now = kBegin) {
    const std::string bytes = scene.SerializeAsString();
    const auto place = scenes_.Begin(SceneHash(scene), bytes.size(), now);
    return place.ok() ? scenes_.Keep(*place, DraftWith(bytes), now) : place.status();
  }

  const host::TemporaryFolder folder_;
  WaitingScenes scenes_{kRoom, 10min};
};

TEST_F(WaitingScenesTest, WhatIsKeptIsNamedByTheHashOfItsScene) {
  const v1::Scene scene = SceneNamed(std::string(300'000, 'a'));
  ASSERT_TRUE(Put(scene).ok());
  const auto bytes = scenes_.Bytes(SceneHash(scene), kBegin);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  EXPECT_TRUE(*bytes == scene.SerializeAsString());
  EXPECT_EQ(scenes_.bytes(), bytes->size());
  EXPECT_EQ(Put(scene).code(), absl::StatusCode::kAlreadyExists);
  EXPECT_EQ(scenes_.Bytes(SceneHash(SceneNamed("other")), kBegin).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(WaitingScenesTest, WhatIsNotWhatWasSaidLeavesNothing) {
  const v1::Scene scene = SceneNamed("level");
  const std::string bytes = scene.SerializeAsString(), hash = SceneHash(scene);
  const auto why = [&](const std::string& said, std::uint64_t size, const std::string& came) {
    const auto place = scenes_.Begin(said, size, kBegin);
    return std::string((place.ok() ? scenes_.Keep(*place, DraftWith(came), kBegin) : place.status()).message());
  };
  EXPECT_THAT(why("level", 10, bytes), HasSubstr("scene_hash: must be 64"));
  EXPECT_THAT(why(hash, 0, bytes), HasSubstr("size: 0 bytes"));
  EXPECT_THAT(why(hash, kMaxSceneBytes + 1, bytes), HasSubstr("size: "));
  EXPECT_THAT(why(hash, bytes.size() + 1, bytes), HasSubstr("data: ended after"));
  EXPECT_THAT(why(SceneHash(SceneNamed("other")), bytes.size(), bytes), HasSubstr("another hash"));
  EXPECT_FALSE(scenes_.Bytes(hash, kBegin).ok());
  EXPECT_EQ(scenes_.bytes(), 0u);
}

TEST_F(WaitingScenesTest, ThoseThatComeTakeRoomToo) {
  const v1::Scene large = SceneNamed(std::string(600'000, 'a'));
  std::optional<absl::StatusOr<WaitingScenes::Place>> coming(scenes_.Begin(SceneHash(large), 600'000, kBegin));
  ASSERT_TRUE((*coming).ok());
  EXPECT_EQ(scenes_.bytes(), 600'000u);
  const v1::Scene other = SceneNamed(std::string(500'000, 'b'));
  EXPECT_EQ(Put(other).code(), absl::StatusCode::kResourceExhausted);
  coming.reset();
  EXPECT_EQ(scenes_.bytes(), 0u);
  EXPECT_TRUE(Put(other).ok());
}

TEST_F(WaitingScenesTest, TwoWhoSendTheSameKeepItOnce) {
  const v1::Scene scene = SceneNamed("level");
  const std::string bytes = scene.SerializeAsString();
  {
    const auto first = scenes_.Begin(SceneHash(scene), bytes.size(), kBegin);
    const auto second = scenes_.Begin(SceneHash(scene), bytes.size(), kBegin);
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_TRUE(scenes_.Keep(*first, DraftWith(bytes), kBegin).ok());
    EXPECT_TRUE(scenes_.Keep(*second, DraftWith(bytes), kBegin).ok());
  }
  EXPECT_EQ(scenes_.bytes(), bytes.size());
}

TEST_F(WaitingScenesTest, OneThatIsAskedForWaitsForAnotherGrace) {
  const v1::Scene asked = SceneNamed("asked"), forgotten = SceneNamed("forgotten");
  ASSERT_TRUE(Put(asked).ok());
  ASSERT_TRUE(Put(forgotten).ok());
  EXPECT_TRUE(scenes_.Bytes(SceneHash(asked), kBegin + 9min).ok());
  scenes_.Sweep(kBegin + 10min);
  EXPECT_TRUE(scenes_.Bytes(SceneHash(forgotten), kBegin).ok()) << "its grace is not over";
  scenes_.Sweep(kBegin + 10min + 1s);
  EXPECT_EQ(scenes_.Bytes(SceneHash(forgotten), kBegin).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(scenes_.Bytes(SceneHash(asked), kBegin + 9min).ok());
  scenes_.Sweep(kBegin + 20min);
  EXPECT_EQ(scenes_.bytes(), 0u);
}

}  // namespace
}  // namespace tessera::control

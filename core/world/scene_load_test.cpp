#include "core/world/scene_load.h"

#include <gtest/gtest.h>

#include "core/world/scene_io.h"

namespace tessera {
namespace {

constexpr char kText[] = R"(
  name: "x" bounds { min { x: -10 y: -10 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 mass: 1 shape { sphere { radius: 0.5 } } }
  scatters { first_id: 10 count: 4 spacing: 1 area { min { x: -8 y: 1 z: -8 } max { x: 8 y: 2 z: 8 } }
             templates { mass: 1 shape { sphere { radius: 0.1 } } } })";

std::string MessageOf(const absl::StatusOr<LoadedScene>& loaded) { return std::string(loaded.status().message()); }

TEST(SceneLoadTest, TextAndItsMessageAreTheSameScene) {
  const auto text = LoadScene(SceneForm::kText, kText, "x.textproto");
  ASSERT_TRUE(text.ok()) << text.status();
  EXPECT_EQ(text->scene->bodies.size(), 5u);
  EXPECT_EQ(text->hash, SceneHash(text->message));
  const auto wire = LoadScene(SceneForm::kSerialised, text->message.SerializeAsString(), "x.pb");
  ASSERT_TRUE(wire.ok()) << wire.status();
  EXPECT_EQ(wire->hash, text->hash);
  EXPECT_EQ(wire->scene->bodies.size(), 5u);
  EXPECT_EQ(LoadScene(text->message, "scene")->hash, text->hash);
}

TEST(SceneLoadTest, FormFollowsThePath) {
  for (const char* path : {"a/b.textproto", "b.txtpb", "c.json"}) EXPECT_EQ(SceneFormOf(path), SceneForm::kText);
  for (const char* path : {"a/b.pb", "json", "", "d.json.bin"}) EXPECT_EQ(SceneFormOf(path), SceneForm::kSerialised);
}

TEST(SceneLoadTest, ScatterCountIsReplaced) {
  const auto bodies = [](std::uint32_t count) {
    return LoadScene(SceneForm::kText, kText, "x", {.scatter_count = count, .hash = {}})->scene->bodies.size();
  };
  EXPECT_EQ(bodies(7), 8u);
  EXPECT_EQ(bodies(0), 1u);
  // The hash is that of the scene that runs, and there is nothing left to replace.
  const auto none = LoadScene(SceneForm::kText, kText, "x", {.scatter_count = 0, .hash = {}});
  EXPECT_EQ(none->hash, SceneHash(none->message));
  EXPECT_EQ(LoadScene(none->message, "x", {.scatter_count = 3, .hash = {}})->scene->bodies.size(), 1u);
}

TEST(SceneLoadTest, AnotherHashIsRefused) {
  const std::string hash = LoadScene(SceneForm::kText, kText, "x")->hash;
  EXPECT_TRUE(LoadScene(SceneForm::kText, kText, "x", {.scatter_count = {}, .hash = hash}).ok());
  const auto other = LoadScene(SceneForm::kText, kText, "x.textproto", {.scatter_count = 5, .hash = hash});
  EXPECT_EQ(other.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(MessageOf(other).find("x.textproto: its hash is "), 0u) << MessageOf(other);
}

TEST(SceneLoadTest, FaultsBeginWithTheName) {
  EXPECT_EQ(MessageOf(LoadScene(SceneForm::kSerialised, "\xff", "order.pb")), "order.pb: not a serialised scene");
  EXPECT_EQ(MessageOf(LoadScene(SceneForm::kText, "nonsense: 1", "a.textproto")).find("a.textproto:1:"), 0u);
  v1::Scene empty;
  EXPECT_EQ(MessageOf(LoadScene(empty, "spec.scene")).find("spec.scene: "), 0u);
}

}  // namespace
}  // namespace tessera

#include "core/world/scene_visuals.h"

#include <gmock/gmock.h>

namespace tessera {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

void Draw(v1::Body* body, const std::string& sha256) { body->mutable_shape()->add_visuals()->set_sha256(sha256); }

TEST(SceneVisualsTest, FilesOfAllBodiesAreNamedOnce) {
  v1::Scene scene;
  EXPECT_THAT(VisualFiles(scene), IsEmpty());
  scene.add_bodies();
  EXPECT_THAT(VisualFiles(scene), IsEmpty()) << "its shape is drawn";
  Draw(scene.add_bodies(), "d");
  Draw(scene.add_bodies(), "b");
  Draw(scene.mutable_bodies(1), "b");
  Draw(scene.add_scatters()->add_templates(), "a");
  Draw(scene.add_prefabs()->add_bodies(), "c");
  Draw(scene.mutable_player()->mutable_body(), "e");
  EXPECT_THAT(VisualFiles(scene), ElementsAre("a", "b", "c", "d", "e"));
}

}  // namespace
}  // namespace tessera

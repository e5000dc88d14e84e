#include "core/physics/body_form.h"

#include <gtest/gtest.h>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

TEST(BodyFrameTest, TakesPosesOfTheShapeIntoTheBodysFrame) {
  const double half = std::sqrt(0.5);
  const BodyFrame frame{.origin = {1, 2, 3}, .axes = {0, 0, half, half}};  // x of the frame is y of the shape
  EXPECT_TRUE(frame.turned());
  const Pose pose = frame.FromShape(Pose{{1, 7, 3}, frame.axes});
  EXPECT_NEAR(Length(pose.position - Vec3d{5, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(std::abs(pose.orientation.w), 1, 1e-12);
}

TEST(FormCacheTest, BodiesThatLookAlikeShareTheirGeometry) {
  FormCache forms;
  const ShapePtr cone = MakeShapePtr(ConeShape{1, 4});
  const BodyForm light = forms.Of(Dynamic(1, cone, {}, 1)), heavy = forms.Of(Dynamic(2, cone, {}, 3));
  EXPECT_EQ(light.geometry, heavy.geometry);
  EXPECT_EQ(heavy.inertia, light.inertia * 3.0);
  EXPECT_NEAR(light.frame.origin.y, -1, 1e-12);
  // A static body has the shape in another frame.
  const BodyForm fixed = forms.Of(Static(3, cone));
  EXPECT_NE(fixed.geometry, light.geometry);
  EXPECT_EQ(fixed.frame, BodyFrame());
  EXPECT_EQ(fixed.inertia, Vec3d());
}

TEST(FormCacheTest, GivenInertiaIsAboutTheAxesOfTheShape) {
  FormCache forms;
  const CompoundShape lopsided{{{{{0, 0, 0}, {}}, Cube(0.5)}, {{{2, 1, 0}, {}}, Cube(0.3)}}};
  BodyDef def = Dynamic(1, MakeShapePtr(lopsided), {});
  EXPECT_TRUE(forms.Of(def).frame.turned());
  def.inertia_kg_m2 = Vec3d{1, 2, 3};
  EXPECT_FALSE(forms.Of(def).frame.turned());
  EXPECT_EQ(forms.Of(def).inertia, (Vec3d{1, 2, 3}));
}

TEST(FormCacheTest, HeightFieldIsCentred) {
  FormCache forms;
  const ShapePtr field =
      MakeShapePtr(HeightFieldShape{.columns = 2, .rows = 2, .spacing_m = 1, .heights_m = {100, 101, 104, 102}});
  const BodyForm form = forms.Of(Static(1, field));
  EXPECT_EQ(form.frame.origin, (Vec3d{0, 102, 0}));
  EXPECT_EQ(BoundsOf(*form.geometry, {}).min.y, -2);
  EXPECT_EQ(BoundsOf(*form.geometry, {}).max.y, 2);
}

TEST(WeakCacheTest, MakesEachValueOnceWhileItsKeyLives) {
  WeakCache<int, int> cache;
  int made = 0;
  const auto make = [&] { return ++made; };
  auto key = std::make_shared<int>();
  EXPECT_EQ(cache.Of(key, make), 1);
  EXPECT_EQ(cache.Of(key, make), 1);
  EXPECT_EQ(cache.Of(std::make_shared<int>(), make), 2);
}

TEST(WeakCacheTest, DropsValuesWhoseKeysAreGone) {
  WeakCache<int, int> cache;
  const auto kept = std::make_shared<int>();
  cache.Of(kept, [] { return 7; });
  for (int i = 0; i < 1000; ++i) {
    const auto gone = std::make_shared<int>();
    cache.Of(gone, [] { return 1; });
  }
  EXPECT_LT(cache.size(), 100u);
  EXPECT_EQ(cache.Of(kept, [] { return 8; }), 7);
}

}  // namespace
}  // namespace tessera::physics

#include "bench/hull_faces.h"

#include <gtest/gtest.h>

namespace tessera::bench {
namespace {

TEST(HullFacesTest, ACubeHasSixFacesOfFourCorners) {
  std::vector<Vec3f> points;
  for (const float x : {-1.0f, 1.0f})
    for (const float y : {-1.0f, 1.0f})
      for (const float z : {-1.0f, 1.0f}) points.push_back({x, y, z});
  points.push_back({0.1f, 0.2f, 0.3f});  // inside: of no face
  const std::vector<HullFace> faces = FacesOf(points);
  ASSERT_EQ(faces.size(), 6u);
  for (const HullFace& face : faces) {
    EXPECT_NEAR(face.offset_m, 1, 1e-9);
    ASSERT_EQ(face.corners.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {  // counter-clockwise: each turn is to the left, seen from outside
      const Vec3d a = Vec3d(points[face.corners[i]]), b = Vec3d(points[face.corners[(i + 1) % 4]]),
                  c = Vec3d(points[face.corners[(i + 2) % 4]]);
      EXPECT_GT(Dot(Cross(b - a, c - b), face.normal), 0);
    }
  }
}

TEST(HullFacesTest, FacesEdgesAndCornersObeyEuler) {
  const std::vector<Vec3f> points{{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 1}, {2, 2, 2}};
  std::size_t edges = 0;
  const std::vector<HullFace> faces = FacesOf(points);
  for (const HullFace& face : faces) edges += face.corners.size();
  EXPECT_EQ(5 + faces.size(), edges / 2 + 2);
}

}  // namespace
}  // namespace tessera::bench

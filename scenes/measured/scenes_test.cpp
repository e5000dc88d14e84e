// The measured scenes are what their headers say.
#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "scenes/measured/balls.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/crowds.h"
#include "scenes/measured/flight.h"
#include "scenes/measured/golden.h"
#include "scenes/measured/linkages.h"
#include "scenes/measured/stacks.h"
#include "scenes/measured/structures.h"

namespace tessera::scenes {
namespace {

TEST(SinCosTest, AgreesWithTheLibraryToRounding) {
  for (double angle = -20; angle < 20; angle += 0.0137) {
    EXPECT_NEAR(SinCosOf(angle).sin, std::sin(angle), 4e-16 * (1 + std::abs(angle)));
    EXPECT_NEAR(SinCosOf(angle).cos, std::cos(angle), 4e-16 * (1 + std::abs(angle)));
  }
}

TEST(SceneTest, CountsAreThoseOfTheSuite) {
  EXPECT_EQ(Pyramid().bodies.size(), 1u + 1240);
  EXPECT_EQ(ManyPyramids().bodies.size(), 1u + 10'780);
  EXPECT_EQ(KaplaTower().bodies.size(), 1u + 102);
  EXPECT_EQ(Dominoes().bodies.size(), 1u + kDominoes);
  EXPECT_EQ(CardHouse().bodies.size(), 1u + kCards);
  EXPECT_EQ(Arch().bodies.size(), 1u + kArchWedges + kArchBars);
  EXPECT_EQ(BallPile(false).bodies.size(), 1u + kPileBalls);
  const Scene convex = ConvexOnMesh();
  EXPECT_EQ(std::get<TriangleMeshShape>(convex.bodies[0].shape->form).triangles.size(), 20'000u);
}

TEST(SceneTest, TruthsAreThoseOfTheReference) {
  const Rolling rolling = RollingBalls(false);
  EXPECT_NEAR(rolling.box_acceleration_m_s2, 0.7385, 5e-5);
  EXPECT_NEAR(rolling.ball_acceleration_m_s2, 0.2110, 5e-5);
  // The slow root solves the equation it is taken from, with the moments of a 7-sided pyramid.
  const SpinningTop top = MakeSpinningTop();
  const BodyDef& body = BodyOf(top.scene, top.top);
  const Vec3d inertia = *body.inertia_kg_m2;
  const double w = top.precession_rad_s, about_tip = inertia.x + 1.5 * 1.5;
  EXPECT_NEAR(about_tip * w * w * std::cos(M_PI / 12) - inertia.y * 75 * w + 9.81 * 1.5, 0, 1e-9);
  EXPECT_LT(w, 1);
}

TEST(SceneTest, JointsAreClosedAtTheStart) {
  for (const Scene& scene : {BallAndChain(1000).scene, ClosedLoop(), HingeMotor(), Ragdolls(3), RodPendulum(1).scene,
                             NewtonsCradle().scene}) {
    for (const JointDef& joint : scene.joints) {
      const BodyState* b = joint.body_b == BodyId() ? nullptr : &BodyOf(scene, joint.body_b).initial;
      EXPECT_LT(GapOf(joint, BodyOf(scene, joint.body_a).initial, b), 1e-6) << scene.name << ' ' << joint.id;
    }
  }
}

TEST(SceneTest, GoldenScenesAreMadeTheSameTwiceAndHaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const GoldenScene& golden : GoldenScenes()) {
    EXPECT_TRUE(names.insert(golden.name).second) << golden.name;
    const Scene once = golden.make(), again = golden.make();
    ASSERT_EQ(once.bodies.size(), again.bodies.size());
    for (std::size_t i = 0; i < once.bodies.size(); ++i) EXPECT_EQ(once.bodies[i].initial, again.bodies[i].initial);
  }
}

}  // namespace
}  // namespace tessera::scenes

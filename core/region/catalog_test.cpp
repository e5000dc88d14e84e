#include "core/region/catalog.h"

#include <gmock/gmock.h>

namespace tessera::region {
namespace {

using ::testing::ElementsAre;

class CatalogTest : public ::testing::Test {
 protected:
  CatalogTest() {
    for (const std::uint64_t id : {3, 4, 7, 8, 9, 10}) {
      BodyDef def;
      def.id = BodyId(id);
      def.motion = id == 3 ? Motion::kStatic : Motion::kDynamic;
      scene->bodies.push_back(def);
    }
  }
  void Tie(std::uint64_t a, std::uint64_t b) {
    JointDef joint;
    joint.id = JointId(static_cast<std::uint32_t>(scene->joints.size() + 1));
    joint.body_a = BodyId(a);
    joint.body_b = BodyId(b);
    joint.kind = PointJoint{};
    scene->joints.push_back(joint);
  }
  static std::vector<JointId> JointsOf(const Catalog& catalog, BodyId id) {
    std::vector<JointId> joints;
    catalog.ForEachJoint(id, [&](const JointDef& joint) { joints.push_back(joint.id); });
    return joints;
  }
  std::shared_ptr<Scene> scene = std::make_shared<Scene>();
};

TEST_F(CatalogTest, FindsBodiesThoughIdsHaveGaps) {
  const Catalog catalog(scene);
  EXPECT_EQ(catalog.Find(BodyId(7))->id, BodyId(7));
  EXPECT_EQ(catalog.Find(BodyId(5)), nullptr);
  EXPECT_EQ(catalog.Find(BodyId(0)), nullptr);
  EXPECT_EQ(catalog.Find(BodyId(1'000'000)), nullptr);
  EXPECT_FALSE(catalog.Known(BodyId(3)));  // static
  EXPECT_FALSE(catalog.Known(PlayerBodyId(PlayerNumber(1))));
}

TEST_F(CatalogTest, JointsMakeAssembliesAndStaticBodiesTieNothing) {
  Tie(10, 8);
  Tie(9, 10);
  Tie(3, 4);
  Tie(7, 3);
  Tie(7, 0);
  const Catalog catalog(scene);
  EXPECT_TRUE(catalog.has_joints());
  EXPECT_THAT(catalog.AssemblyOf(BodyId(9)), ElementsAre(BodyId(8), BodyId(9), BodyId(10)));
  EXPECT_THAT(catalog.AssemblyOf(BodyId(4)), ElementsAre(BodyId(4)));
  EXPECT_THAT(JointsOf(catalog, BodyId(8)), ElementsAre(JointId(1), JointId(2)));
  EXPECT_THAT(JointsOf(catalog, BodyId(7)), ElementsAre(JointId(4), JointId(5)));
}

TEST_F(CatalogTest, BodiesThatAGameMakesAreKnownByTheirIds) {
  Prefab& cart = scene->prefabs.emplace_back();
  cart.bodies.resize(2);
  cart.bodies[1].mass_kg = 3;
  JointDef& joint = cart.joints.emplace_back();
  joint.id = JointId(1);
  joint.body_a = BodyId(1);
  joint.body_b = BodyId(2);
  const BodyId first = SpawnedBodyId({0, 5, 6, 0}), second = WithMember(first, 1);
  const Catalog catalog(scene);
  EXPECT_TRUE(catalog.has_joints());
  EXPECT_TRUE(catalog.Known(second));
  EXPECT_EQ(catalog.MassOf(second), 3);
  EXPECT_THAT(catalog.AssemblyOf(second), ElementsAre(first, second));
  EXPECT_TRUE(catalog.AssemblyOf(first).Contains(second));
  EXPECT_THAT(JointsOf(catalog, second), ElementsAre(SpawnedJointId(first, JointId(1))));
  EXPECT_FALSE(catalog.Known(WithMember(first, 2)));
  EXPECT_FALSE(catalog.Known(SpawnedBodyId({1, 5, 6, 0})));
}

TEST_F(CatalogTest, AChainOfAHundredThousandIsOneAssembly) {
  scene->bodies.clear();
  for (std::uint64_t id = 1; id <= 100'000; ++id) {
    BodyDef def;
    def.id = BodyId(id);
    scene->bodies.push_back(def);
  }
  for (std::uint64_t id = 100'000; id > 1; --id) Tie(id - 1, id);  // from the far end
  const Catalog catalog(scene);
  EXPECT_EQ(catalog.AssemblyOf(BodyId(50'000)).size(), 100'000U);
}

}  // namespace
}  // namespace tessera::region

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
  const BodyId nine(9), four(4);
  EXPECT_THAT(catalog.AssemblyOf(nine), ElementsAre(BodyId(8), BodyId(9), BodyId(10)));
  EXPECT_THAT(catalog.AssemblyOf(four), ElementsAre(BodyId(4)));
  EXPECT_EQ(catalog.JointsOf(BodyId(8)).size(), 2U);
  EXPECT_EQ(catalog.JointsOf(BodyId(7)).size(), 2U);
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
  const BodyId middle(50'000);
  EXPECT_EQ(catalog.AssemblyOf(middle).size(), 100'000U);
}

}  // namespace
}  // namespace tessera::region

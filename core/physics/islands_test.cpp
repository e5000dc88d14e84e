// Islands of given contact graphs.
#include "core/physics/islands.h"

#include <gmock/gmock.h>

#include "core/physics/awake_joints.h"
#include "core/physics/testing/loose_bodies.h"

namespace tessera::physics {
namespace {

using ::testing::ElementsAre;

std::vector<std::uint32_t> IndicesOf(const Islands& islands) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < islands.bodies(); ++i) indices.push_back(islands.IndexOf(i));
  return indices;
}

TEST(IslandsTest, AreTheConnectedPartsOfTheContactGraphNumberedByTheirFirstBodies) {
  const std::vector<ActiveContact> contacts = {ContactBetween(4, 1), ContactBetween(5, 3), ContactBetween(1, 6)};
  Islands islands;
  BuildIslands(7, contacts, {}, &islands);
  EXPECT_THAT(IndicesOf(islands), ElementsAre(0, 1, 2, 3, 1, 3, 1));
  EXPECT_EQ(islands.count(), 4U);
  EXPECT_TRUE(Validate(islands, contacts, {}));
}

TEST(IslandsTest, NeitherGroundNorTriggersNorSleepersConnect) {
  std::vector<ActiveContact> contacts = {ContactBetween(0, kAsleep), ContactBetween(kAsleep, 1), ContactBetween(0, 2)};
  contacts.back().responds = false;
  Islands islands;
  BuildIslands(3, contacts, {}, &islands);
  EXPECT_THAT(IndicesOf(islands), ElementsAre(0, 1, 2));
}

TEST(IslandsTest, ALongChainIsOneIslandInWhateverOrderItsContactsCome) {
  constexpr std::uint32_t kBodies = 1000;
  std::vector<ActiveContact> contacts;
  for (std::uint32_t i = 0; i + 1 < kBodies; ++i) {
    const std::uint32_t at = i * 7 % (kBodies - 1);  // 7 and 999 have no common divisor
    contacts.push_back(ContactBetween(at, at + 1));
  }
  Islands islands;
  BuildIslands(kBodies, contacts, {}, &islands);
  EXPECT_EQ(islands.count(), 1U);
  EXPECT_TRUE(Validate(islands, contacts, {}));
}

TEST(IslandsTest, ValidateFindsAContactBetweenTwoIslands) {
  Islands islands;
  BuildIslands(2, {}, {}, &islands);
  const std::vector<ActiveContact> contacts = {ContactBetween(0, 1)};
  EXPECT_TRUE(Validate(islands, {}, {}));
  EXPECT_FALSE(Validate(islands, contacts, {}));
}

// --- Joints

class JointsTest : public ::testing::Test {
 protected:
  void Connect(std::uint32_t joint, std::uint64_t a, std::uint64_t b) {
    loose_.bodies.AddJoint(PointBetween(joint, a, b, {0.5, 0, 0}, {-0.5, 0, 0}));
  }
  void Run() {
    joints_.Run(loose_.bodies);
    EXPECT_TRUE(joints_.Validate());
  }
  std::vector<std::uint64_t> Listed() const {
    std::vector<std::uint64_t> ids;
    for (const Joint* joint : joints_.joints()) ids.push_back(joint->id.value());
    return ids;
  }

  LooseBodies loose_;
  AwakeJoints joints_;
};

TEST_F(JointsTest, EachOfAnAwakeBodyIsListedOnceAndAscendingById) {
  for (std::uint64_t id = 1; id <= 5; ++id) loose_.Add(Dynamic(id, Ball(0.2), {static_cast<double>(id), 0, 0}));
  loose_.Add(Static(6, Ball(0.2)));
  Connect(30, 1, 2);
  Connect(10, 2, 3);
  Connect(20, 6, 4);
  Connect(40, 5, 4);
  for (const std::uint64_t id : {4, 5}) {
    RigidBody& body = loose_.bodies.At(BodyId(id));
    loose_.bodies.UnlistAwake(body);
    body.FallAsleep();
  }
  Run();
  EXPECT_THAT(Listed(), ElementsAre(10, 30));
  loose_.waking.Wake(loose_.bodies.At(BodyId(5)));
  Run();
  EXPECT_THAT(Listed(), ElementsAre(10, 20, 30, 40));
}

TEST_F(JointsTest, RowsTellHowFarApartTheEndsAre) {
  loose_.Add(Dynamic(1, Ball(0.2), {}));
  loose_.Add(Dynamic(2, Ball(0.2), {1.25, 0, 0}));
  Connect(1, 1, 2);
  Run();
  EXPECT_EQ(joints_.rows()[0].gap, Vec3f(0.25f, 0, 0));
  EXPECT_EQ(joints_.rows()[0].arm_a, Vec3f(0.5f, 0, 0));
}

TEST_F(JointsTest, ConnectIslandsAndMakeGroups) {
  for (std::uint64_t id = 1; id <= 5; ++id) loose_.Add(Dynamic(id, Ball(0.2), {static_cast<double>(id), 0, 0}));
  loose_.Add(Static(6, Ball(0.2)));
  Connect(1, 5, 2);
  Connect(2, 3, 5);
  Connect(3, 4, 6);
  Run();
  Islands islands;
  const std::vector<ActiveContact> contacts = {ContactBetween(0, 1)};
  BuildIslands(5, contacts, joints_.joints(), &islands);
  EXPECT_THAT(IndicesOf(islands), ElementsAre(0, 0, 0, 1, 0));
  JointedGroups groups;
  groups.Run(joints_.joints());
  EXPECT_THAT(groups.bodies(), ElementsAre(1, 2, 4)) << "a joint to something static makes no group";
  EXPECT_EQ(groups.count(), 1U);
  EXPECT_TRUE(groups.Validate(joints_.joints()));
  EXPECT_FALSE(groups.Validate({})) << "bodies without a joint are in no group";
  EXPECT_FALSE(JointedGroups().Validate(joints_.joints())) << "jointed bodies are in a group";
  groups.Run({});
  EXPECT_EQ(groups.count(), 0U);
}

}  // namespace
}  // namespace tessera::physics

#include "core/region/border_loads.h"

#include <gtest/gtest.h>

#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

// A row of region 1's balls that touch each other: body 1 is a ghost of region 2, bodies 2 and 3 are not.
class BorderLoadsTest : public ::testing::Test {
 protected:
  BorderLoadsTest() {
    for (const std::uint64_t id : {1, 2, 3}) world.Own(id);
    world.Step();
    const std::vector<physics::Forces> forces(3);
    const std::vector<std::span<const GhostRecord>> sent(1);
    relevance.Update({world.bodies, world.neighborhood, forces, {}, sent});
  }
  // One step in which body 2 presses body 1 with this impulse.
  void Press(Vec3f impulse_on_1) {
    physics::PairImpulse contact;
    contact.body_a = BodyId(1);
    contact.body_b = BodyId(2);
    contact.tag_a = 0;
    contact.tag_b = 1;
    contact.impulse_on_b = -impulse_on_1;
    loads.Note(std::vector{contact});
    loads.Validate();
  }
  GhostRecord Ghost(std::vector<std::uint32_t> in_frame = {0, BorderLoads::kNotInFrame, BorderLoads::kNotInFrame}) {
    std::vector<GhostRecord> ghosts(
        std::ranges::count_if(in_frame, [](std::uint32_t at) { return at != BorderLoads::kNotInFrame; }));
    for (std::size_t i = 0; i < ghosts.size(); ++i) ghosts[i].id = BodyId(i + 1);
    loads.AddTo(ghosts, {world.bodies, world.neighborhood, relevance, departing, 0, in_frame});
    return ghosts[0];
  }

  SmallWorld world{Balls({{-0.6, 0, 0}, {-1.6, 0, 0}, {-2.6, 0, 0}})};
  Relevance relevance{world.catalog, {.whole_up_to = 0}, SmallWorld::kTick_s};
  BorderLoads loads{{}};
  std::vector<DepartingBody> departing;
};

TEST_F(BorderLoadsTest, ABlowIsNoLoad) {
  Press({0, 5, 0});
  EXPECT_TRUE(Ghost().externally_supported);  // but it says that something is there
  EXPECT_EQ(Ghost().load_ns, Vec3f());
  Press({0, -1, 0});
  EXPECT_EQ(Ghost().load_ns, Vec3f());  // it changed sign
}

TEST_F(BorderLoadsTest, ALoadBeginsWithTheLesserOfTwoStepsAndIsAMeanFromThenOn) {
  Press({0, 5, 0});
  Press({0, 2, 0});
  EXPECT_EQ(Ghost().load_ns, Vec3f(0, 2, 0));
  Press({0, 3, 0});
  EXPECT_FLOAT_EQ(Ghost().load_ns.y, 2.1f);
}

TEST_F(BorderLoadsTest, ALoadIsAtMostTwiceWhatTheContactLastDid) {
  for (int i = 0; i < 40; ++i) Press({0, 10, 0});
  Press({0, 1, 0});
  Press({0, 1, 0});
  EXPECT_FLOAT_EQ(Ghost().load_ns.y, 2);
}

TEST_F(BorderLoadsTest, AContactWithWhatTheNeighbourHasIsNoLoad) {
  for (int i = 0; i < 2; ++i) Press({0, 2, 0});
  EXPECT_FALSE(Ghost({0, 1, BorderLoads::kNotInFrame}).externally_supported);
  departing.push_back({{}, RegionId(2)});
  departing[0].record.id = BodyId(2);
  EXPECT_FALSE(Ghost().externally_supported);
}

TEST_F(BorderLoadsTest, AContactThatEndedLeavesNothing) {
  for (int i = 0; i < 5; ++i) Press({0, 2, 0});
  loads.Note({});
  EXPECT_FALSE(Ghost().externally_supported);
  for (int i = 0; i < 2; ++i) Press({0, 2, 0});
  loads.Clear();
  EXPECT_FALSE(Ghost().externally_supported);
}

}  // namespace
}  // namespace tessera::region

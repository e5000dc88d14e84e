#include "core/region/bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/region/body_notes.h"
#include "core/region/testing/small_world.h"

namespace tessera::region {
namespace {

using ::testing::ElementsAre;

GhostRecord Record(std::uint64_t id, Epoch epoch, const BodyState& state) {
  GhostRecord record;
  record.id = BodyId(id);
  record.epoch = epoch;
  record.state = state;
  return record;
}

TEST(BodiesTest, PlacesAreOwnedBodiesThenGhostsEachAscending) {
  SmallWorld world(Balls({{1, 0, 0}, {-1, 0, 0}, {-3, 0, 0}}));
  world.Own(3);
  world.Own(2);
  world.AddGhost(1, 2);
  EXPECT_EQ(world.bodies.PlaceOf(BodyId(2)), 0);
  EXPECT_EQ(world.bodies.PlaceOf(BodyId(3)), 1);
  EXPECT_EQ(world.bodies.PlaceOf(BodyId(1)), 2);
  EXPECT_EQ(world.bodies.IdAt(2), BodyId(1));
  EXPECT_EQ(world.bodies.PlaceOf(BodyId(9)), -1);
  world.bodies.Validate();
}

TEST(BodiesTest, ABodyStaysInTheWorldWhileItsOwnerChanges) {
  SmallWorld world(Balls({{-1, 0, 0}}));
  world.Own(1);
  world.bodies.BecomeGhost(Record(1, Epoch(2), world.InitialOf(1)), RegionId(2));
  EXPECT_FALSE(world.bodies.Owns(BodyId(1)));
  EXPECT_EQ(world.bodies.FindGhost(BodyId(1))->owner, RegionId(2));
  world.bodies.PlaceGhosts({});  // its new owner reports it only in the next tick
  EXPECT_NE(world.bodies.FindGhost(BodyId(1)), nullptr);
  world.bodies.Own(BodyId(1), Epoch(3), world.InitialOf(1));
  EXPECT_TRUE(world.bodies.Owns(BodyId(1)));
  EXPECT_TRUE(world.bodies.TakeLeft().empty());
  world.bodies.Validate();
}

TEST(BodiesTest, AGhostThatNobodyReportsLeaves) {
  SmallWorld world(Balls({{1, 0, 0}}));
  world.AddGhost(1, 2);
  world.bodies.PlaceGhosts({});
  EXPECT_FALSE(world.bodies.world().Has(BodyId(1)));
  EXPECT_THAT(world.bodies.TakeLeft(), ElementsAre(BodyId(1)));
}

TEST(BodiesTest, JointsAreThereOnceBothBodiesAre) {
  Scene scene = Balls({{-1, 0, 0}, {1, 0, 0}});
  Join(scene, 1, 2);
  SmallWorld world(std::move(scene));
  world.Own(1);
  EXPECT_FALSE(world.bodies.world().HasJoint(JointId(1)));
  world.AddGhost(2, 2);
  EXPECT_TRUE(world.bodies.world().HasJoint(JointId(1)));
  EXPECT_THAT(world.bodies.OwnedAssembly(0), ElementsAre(0));
}

TEST(BodiesTest, AbsurdBodiesAreTakenOutAndOwnedOnesReported) {
  SmallWorld world(Balls({{-1, 0, 0}, {-4, 0, 0}}));
  world.Own(1);
  world.Own(2);
  for (int i = 0; i < 100; ++i) world.bodies.ApplyForce(BodyId(1), {3e38f, 0, 0}, {});
  world.bodies.Step(SmallWorld::kTick_s, Tick());
  EXPECT_THAT(world.bodies.ReadBack(), ElementsAre(std::pair(BodyId(1), Epoch(1))));
  EXPECT_EQ(world.bodies.owned().size(), 1U);
  world.bodies.Validate();
}

void ExpectStatesOfTheWorld(const SmallWorld& world) {
  for (const OwnedBody& body : world.bodies.owned()) {
    EXPECT_EQ(body.state, world.bodies.world().StateOf(body.def->id)) << body.def->id.value();
  }
}

// Ball 2 rolls onto ball 1, which sleeps, and both come to rest; ball 3 sleeps beside them.
TEST(BodiesTest, OwnedBodiesHaveTheStatesOfTheWorldWhetherTheySleepWakeOrAreParked) {
  Scene scene = Balls({{-3, 0, 0}, {-5, 0, 0}, {-8, 0, 0}, {5, 0, 0}});
  for (BodyDef& body : scene.bodies) {
    body.linear_damping = 0.9;
    body.angular_damping = 0.9;
  }
  SmallWorld world(std::move(scene));
  const auto own = [&](std::uint64_t id, bool asleep, float speed) {
    BodyState state = world.InitialOf(id);
    state.asleep = asleep;
    state.linear_velocity = {speed, 0, 0};
    world.Own(id, state);
  };
  own(1, true, 0);
  own(2, false, 3);
  own(3, true, 0);
  world.AddGhost(4, 2);
  int woken = 0, fell_asleep = 0;
  for (int i = 0; i < 400; ++i) {
    if (i == 100) world.bodies.Wake(BodyId(3));
    if (i == 110) world.bodies.Park(BodyId(2));
    if (i == 130) world.bodies.Unpark(BodyId(2));
    if (i == 140) world.bodies.Place(BodyId(1), world.InitialOf(1));
    const bool slept = world.bodies.owned()[0].state.asleep;
    world.Step();
    ExpectStatesOfTheWorld(world);
    woken += slept && !world.bodies.owned()[0].state.asleep ? 1 : 0;
    fell_asleep += !slept && world.bodies.owned()[0].state.asleep ? 1 : 0;
  }
  EXPECT_GT(woken, 0);
  EXPECT_GT(fell_asleep, 0);
}

TEST(BodiesTest, ContactsOfTheInteriorAreNoConcernOfBorders) {
  SmallWorld world(Balls({{-0.45, 0, 0}, {0.45, 0, 0}, {-5, 0, 0}, {-5.9, 0, 0}}));
  for (const std::uint64_t id : {1, 3, 4}) world.Own(id);
  world.AddGhost(2, 2);
  world.Step();
  const auto pairs = [&](bool near) {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> found;
    for (const physics::PairImpulse& contact : world.bodies.ImpulsesNearBorders([&](std::size_t) { return near; })) {
      found.emplace_back(contact.body_a.value(), contact.body_b.value());
    }
    return found;
  };
  EXPECT_THAT(pairs(false), ElementsAre(std::pair(1, 2)));
  EXPECT_THAT(pairs(true), ElementsAre(std::pair(1, 2), std::pair(3, 4)));
}

TEST(BodiesTest, AGhostOfALayerThatIsIgnoredPassesThrough) {
  for (const bool ignored : {false, true}) {
    Scene scene = Balls({{-1, 0, 0}, {1, 0, 0}});
    scene.layers = {"default", "dust"};
    for (BodyDef& body : scene.bodies) body.layer = {.index = 1, .collides = ignored ? ~2u : ~0u};
    scene.bodies[1].initial.linear_velocity = {-6, 0, 0};
    SmallWorld world(std::move(scene));
    world.Own(1);
    world.AddGhost(2, 2);
    for (int i = 0; i < 20; ++i) world.Step();
    EXPECT_EQ(world.bodies.world().StateOf(BodyId(1)).linear_velocity == Vec3f(), ignored);
    world.bodies.Validate();
  }
}

TEST(BodiesTest, NearBodiesAreFoundBeforeTheFirstStepToo) {
  SmallWorld world(Balls({{-1, 0, 0}, {-2, 0, 0}, {-5, 0, 0}}));
  for (const std::uint64_t id : {1, 2, 3}) world.Own(id);
  std::vector<std::uint32_t> near;
  world.bodies.AddNear(BodyId(1), &near);
  EXPECT_THAT(near, ::testing::IsSupersetOf({1U}));
  EXPECT_THAT(near, ::testing::Not(::testing::Contains(2U)));
}

std::vector<int> All(BodyNotes<int>& notes) { return {notes.begin(), notes.end()}; }

TEST(BodyNotesTest, ANoteStaysWithItsBodyAndEndsWithItsOwnership) {
  SmallWorld world(Balls({{-1, 0, 0}, {-3, 0, 0}, {-5, 0, 0}}));
  world.Own(1);
  world.Own(3);
  BodyNotes<int> notes;
  notes.Align(world.bodies);
  notes[0] = 10;
  notes[1] = 30;
  world.Own(2);
  notes.Align(world.bodies);
  EXPECT_THAT(All(notes), ElementsAre(10, 0, 30));
  world.bodies.RemoveOwned(BodyId(1));
  world.bodies.Own(BodyId(1), Epoch(2), world.InitialOf(1));
  notes.Align(world.bodies);
  EXPECT_THAT(All(notes), ElementsAre(0, 0, 30));
  notes.Validate();
}

}  // namespace
}  // namespace tessera::region

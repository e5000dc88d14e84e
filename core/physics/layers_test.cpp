// Collision layers: bodies whose layers ignore each other touch nowhere, and all others as ever.
#include <gmock/gmock.h>

#include "core/physics/testing/bodies.h"

namespace tessera::physics {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

// Layers 0, 1 and 2, of which 1 ignores itself and 2.
CollisionLayer LayerOf(std::uint8_t index) {
  constexpr std::uint32_t kIgnored[] = {0, 0b110, 0b010};
  return {.index = index, .collides = ~kIgnored[index]};
}

BodyDef InLayer(std::uint8_t layer, BodyDef def) {
  def.layer = LayerOf(layer);
  return def;
}

TEST(LayersTest, BodiesOfLayersThatIgnoreEachOtherPassThroughAndOthersRest) {
  World world({});
  AddAll(world, {InLayer(0, Static(1, Ground())), InLayer(2, Static(2, Box(5, 1, 5), {0, 3, 0})),
                 InLayer(1, Dynamic(3, Cube(), {0, 8, 0})), InLayer(1, Dynamic(4, Cube(), {0.1, 10, 0})),
                 InLayer(0, Dynamic(5, Cube(), {3, 8, 0}))});
  Simulate(world, 4);
  EXPECT_NEAR(world.StateOf(BodyId(3)).position.y, 0.5, 0.01) << "through 2, onto the ground";
  EXPECT_NEAR(world.StateOf(BodyId(4)).position.y, 0.5, 0.01) << "into 3";
  EXPECT_NEAR(world.StateOf(BodyId(5)).position.y, 4.5, 0.01) << "on 2";
}

TEST(LayersTest, TheSweepOfAFastBodyIgnoresThemToo) {
  for (const std::uint8_t layer : {std::uint8_t{0}, std::uint8_t{1}}) {
    World world({.gravity_m_s2 = {}});
    BodyDef bullet = InLayer(layer, Dynamic(2, Ball(0.05), {-5, 0, 0}));
    bullet.initial.linear_velocity = {900, 0, 0};
    AddAll(world, {InLayer(2, Static(1, Box(0.01, 5, 5))), bullet});
    Simulate(world, 0.1);
    if (layer == 0) {
      EXPECT_LT(world.StateOf(bullet.id).position.x, 0);
    } else {
      EXPECT_GT(world.StateOf(bullet.id).position.x, 50);
    }
  }
}

TEST(LayersTest, ATriggerReportsOnlyLayersThatItDoesNotIgnore) {
  for (const std::uint8_t layer : {std::uint8_t{0}, std::uint8_t{1}}) {
    World world({.gravity_m_s2 = {}});
    BodyDef trigger = InLayer(2, Static(1, Ball(1)));
    trigger.trigger = true;
    AddAll(world, {trigger, InLayer(layer, Dynamic(2, Ball(), {0.2, 0, 0}))});
    world.Step(kDt);
    if (layer == 0) {
      EXPECT_THAT(world.events(), SizeIs(1));
    } else {
      EXPECT_THAT(world.events(), IsEmpty());
    }
  }
}

TEST(LayersTest, JointsHoldBodiesThatIgnoreEachOther) {
  World world({.gravity_m_s2 = {}});
  BodyDef pulled = InLayer(1, Dynamic(2, Ball(), {0, 0, 0})), held = InLayer(1, Dynamic(3, Ball(), {0.6, 0, 0}));
  pulled.initial.linear_velocity = {-5, 0, 0};
  AddAll(world, {pulled, held});
  world.AddJoint({.id = JointId(1),
                  .body_a = pulled.id,
                  .body_b = held.id,
                  .frame_a = {{0.3, 0, 0}, {}},
                  .frame_b = {{-0.3, 0, 0}, {}},
                  .bodies_collide = true,
                  .kind = PointJoint{}});
  Simulate(world, 1);
  EXPECT_NEAR(Length(world.StateOf(held.id).position - world.StateOf(pulled.id).position), 0.6, 0.01);
  EXPECT_LT(world.StateOf(held.id).position.x, -1);
  EXPECT_THAT(world.contacts(), IsEmpty());
}

TEST(LayersTest, AWalkersSweepGoesThroughThemToo) {
  for (const std::uint8_t layer : {std::uint8_t{0}, std::uint8_t{1}}) {
    World world({});
    AddAll(world, {InLayer(2, Static(1, Box(0.5, 5, 5), {3, 0, 0})), InLayer(layer, Dynamic(2, Ball(0.3), {}))});
    const auto hit = world.SweepSphere({0, 0, 0}, {6, 0, 0}, 0.3, BodyId(2));
    EXPECT_EQ(hit.has_value(), layer == 0);
  }
}

}  // namespace
}  // namespace tessera::physics

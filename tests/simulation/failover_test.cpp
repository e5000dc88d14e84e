// A region dies and the world goes on.
#include <gmock/gmock.h>

#include <cstdio>

#include "tests/simulation/control.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;

struct Instance {
  Instance(const SceneBuilder& builder, std::uint32_t regions, SimulationOptions options = {}) {
    scene = builder.Build();
    const PartitionMap map = *MakeGridMap(scene->ground(), regions);
    options.attach = [this, map](Simulation& s) { control = std::make_unique<Control>(s, map); };
    simulation = std::make_unique<Simulation>(scene, map, options);
  }
  void ExpectWhole(std::size_t bodies) {
    simulation->RunFor(Milliseconds(500));
    simulation->Settle();
    EXPECT_THAT(simulation->problems(), IsEmpty());
    EXPECT_EQ(simulation->States().size(), bodies);
    EXPECT_EQ(control->totals().lost, 0U);
    EXPECT_LE(control->totals().max_age_ticks, 2);
  }

  std::shared_ptr<const Scene> scene;
  std::unique_ptr<Control> control;
  std::unique_ptr<Simulation> simulation;
};

SceneBuilder Swarm(int balls) {
  SceneBuilder builder(kHalf);
  for (const double side : {-1.0, 1.0}) {
    for (const bool along : {false, true}) {
      BodyDef& wall = builder.Add(MakeShape(BoxShape{along ? Vec3d{1, 3, kHalf} : Vec3d{kHalf, 3, 1}}),
                                  along ? Vec3d{side * kHalf, 0, 0} : Vec3d{0, 0, side * kHalf});
      wall.motion = Motion::kStatic;
      wall.mass_kg = 0;
    }
  }
  for (int i = 0; i < balls; ++i) {
    BodyDef& ball = builder.Add(Ball(0.3), {-17.0 + i % 18 * 2, 0, -17.0 + i / 18 * 2},
                                {static_cast<float>(5 - i % 11), 0, static_cast<float>(i % 7 - 3)});
    ball.material.restitution = 1;
    ball.material.friction = 0;
    ball.may_sleep = false;
  }
  return builder;
}

TEST(FailoverTest, TheHeirCarriesTheAreaOn) {
  Instance instance(Swarm(120), 4);
  instance.simulation->RunTo(Tick(60));
  const std::size_t owned = instance.simulation->worker(2).region().owned_count();
  instance.simulation->Kill(RegionId(2));
  instance.ExpectWhole(120);
  EXPECT_EQ(instance.control->totals().failovers, 1U);
  EXPECT_GE(instance.control->totals().adopted + 10, owned);
  EXPECT_EQ(instance.simulation->worker(3).region().map().OwnerOf({10, 0, -10}), RegionId(3));
  std::printf("age %ld ticks, gap %lu us, %lu adopted, %lu revived, %lu pending\n",
              static_cast<long>(instance.control->totals().max_age_ticks),
              static_cast<unsigned long>(instance.control->totals().max_gap),
              static_cast<unsigned long>(instance.control->totals().adopted),
              static_cast<unsigned long>(instance.control->totals().revived),
              static_cast<unsigned long>(instance.control->totals().pending));
}

TEST(FailoverTest, EachRegionMayDieInTurnUntilOneIsLeft) {
  Instance instance(Swarm(120), 4);
  for (const std::uint32_t region : {3U, 1U, 4U}) {
    instance.simulation->RunFor(Milliseconds(700));
    instance.simulation->Kill(RegionId(region));
    instance.ExpectWhole(120);
  }
  EXPECT_EQ(instance.control->totals().failovers, 3U);
  EXPECT_EQ(instance.simulation->workers().size(), 1U);
}

}  // namespace
}  // namespace tessera::simulation

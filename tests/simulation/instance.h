// Instance: a Simulation with the ControlModel that deals with deaths and planned maps, and the swarm that most of
// their tests fly. For tests: it expects.
//
//   Instance instance(Swarm(kHalf_m, 120), 4);
//   instance.simulation->RunTo(Tick(60));
//   instance.simulation->Kill(RegionId(2));
//   instance.ExpectWhole(120);
//
// Thread rule: one thread at a time.
#pragma once

#include <gmock/gmock.h>

#include <memory>
#include <string>

#include "tests/simulation/control_model.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {

struct Instance {
  Instance(const SceneBuilder& builder, std::uint32_t regions, SimulationOptions options = {},
           const ControlOptions& control_options = {})
      : scene(builder.Build()) {
    const PartitionMap map = *MakeGridMap(scene->ground(), regions);
    options.attach = [this, map, control_options](Simulation& s) {
      control = std::make_unique<ControlModel>(s, map, control_options);
    };
    simulation = std::make_unique<Simulation>(scene, map, options);
  }

  // After deaths of which none may cost a body.
  void ExpectWhole(std::size_t bodies) {
    simulation->RunFor(Milliseconds(500));
    simulation->Settle();
    EXPECT_THAT(simulation->problems(), ::testing::IsEmpty());
    EXPECT_EQ(simulation->States().size(), bodies);
    EXPECT_EQ(control->totals().lost, 0U);
    EXPECT_LE(control->totals().max_age_ticks, 2);
  }

  void ScaleTo(std::uint32_t regions) {
    control->Plan(*MakeGridMap(scene->ground(), regions));
    for (int i = 0; i < 200 && !control->idle(); ++i) simulation->RunFor(Milliseconds(50));
    EXPECT_TRUE(control->idle()) << "to " << regions << Standing();
    EXPECT_EQ(simulation->workers().size(), regions);
  }

  // Where each region stands, one a line.
  std::string Standing() const {
    std::string text;
    for (const auto& [id, worker] : simulation->workers()) {
      const region::Region& region = worker->region();
      text += "\nregion " + std::to_string(id.value()) + ": tick " + std::to_string(region.tick().value()) + ", map " +
              std::to_string(region.map().version().value()) + ", announced " +
              std::to_string(region.announced().value()) + (region.committed() ? " (committed), " : ", ") +
              std::to_string(region.away_count()) + " away, waits for";
      for (const RegionId other : region.WaitingFor()) text += " " + std::to_string(other.value());
      for (const auto& [what, count] : worker->totals().refused) text += "; " + what + " x" + std::to_string(count);
    }
    return text;
  }

  std::shared_ptr<const Scene> scene;
  std::unique_ptr<ControlModel> control;
  std::unique_ptr<Simulation> simulation;
};

}  // namespace tessera::simulation

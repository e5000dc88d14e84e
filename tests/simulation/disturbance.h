// Disturb: faults in an instance, one after the other, drawn from a seed: deaths, cuts, standstills and planned maps of
// three to six regions. A death comes when the one before it has been dealt with.
//
//   Chance chance(seed);
//   Disturb(instance, chance, Tick(1'500));
//   instance.simulation->Settle();
#pragma once

#include <iterator>

#include "tests/simulation/chance.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {

inline void Disturb(Instance& instance, Chance& chance, Tick last) {
  Simulation& simulation = *instance.simulation;
  ControlModel& control = *instance.control;
  const auto any = [&] {
    auto worker = simulation.workers().begin();
    std::advance(worker, static_cast<std::ptrdiff_t>(chance.Below(simulation.workers().size())));
    return worker->first;
  };
  const auto settle = [&] {
    for (int i = 0; i < 400 && !control.idle(); ++i) simulation.RunFor(Milliseconds(50));
  };
  while (simulation.tick() < last) {
    simulation.RunFor(Milliseconds(700 + static_cast<Micros>(chance.Below(400))));
    switch (chance.Below(5)) {
      case 0:
      case 1:
        if (simulation.workers().size() < 2) break;
        simulation.Kill(any());
        simulation.RunFor(Milliseconds(100));
        settle();
        break;
      case 2:
        simulation.CutBetween(any(), any(), Milliseconds(100 + static_cast<Micros>(chance.Below(1'000))));
        break;
      case 3:
        simulation.Stall(any(), Milliseconds(100 + static_cast<Micros>(chance.Below(300))));
        break;
      default:
        simulation.RunFor(Milliseconds(1'500));
        settle();
        if (!control.idle()) break;
        control.Plan(*MakeGridMap(simulation.scene()->ground(), static_cast<std::uint32_t>(3 + chance.Below(4))));
        settle();
        break;
    }
  }
}

}  // namespace tessera::simulation

// Islands: bodies that are awake and act on each other through contacts and joints. What is in different islands cannot
// feel the other's solving; an island sleeps as a whole.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/physics/solve/substeps.h"
#include "core/physics/tuning.h"

namespace tessera::physics {

struct Island {
  bool solved = false;  // a contact that may touch, or a joint: else its bodies fly free
  bool sleepy = true;   // all its bodies have been still for long enough
  bool failed = false;  // its solving came out non-finite
  bool laden = false;   // may carry more than its bodies weigh one by one
  bool adrift = true;   // its bodies act on each other alone, and by contacts alone
  int batch = -1;       // which batch solves it
  double mass_kg = 0;   // of all its bodies
  double lightest_kg = std::numeric_limits<double>::max();
  float smallest_m = std::numeric_limits<float>::max();  // inner radius
  float load_before = kUnknownLoad;  // what its bodies' load counted as in the last step, the largest of several
  float load = kUnknownLoad;         // what that of those that are here counts as
  float load_elsewhere = 0;          // the same of what hangs together with it and is not here
  IslandDemand demand;               // what the last step and this one's contacts tell of how hard it is
};

class Islands {
 public:
  void Reset(std::size_t bodies);
  void Unite(std::uint32_t a, std::uint32_t b);
  // After the last `Unite`: numbers the islands.
  void Number();
  Island& Of(std::uint32_t body) { return islands_[island_[body]]; }
  std::uint32_t IndexOf(std::uint32_t body) const { return island_[body]; }
  std::span<Island> all() { return islands_; }

 private:
  std::uint32_t Root(std::uint32_t node);

  std::vector<std::uint32_t> parent_, island_;
  std::vector<Island> islands_;
};

}  // namespace tessera::physics

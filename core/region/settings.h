// Settings of a region: each with its unit, its reason, and what breaks if it changes.
#pragma once

#include <cstdint>

namespace tessera::region {

struct Settings {
  // A body is shown to a neighbour when its swept bounds, grown by this, reach one of the neighbour's cells. Less, and bodies
  // that overhang their owner's cells meet nothing; more, and ghosts cost what bodies cost.
  double aura_m = 1.0;
  // How far ahead the swept bounds look, ticks. At least 2: a frame is used one tick after it was made.
  std::uint32_t lookahead_ticks = 4;
  // A body is handed over only when it is this far beyond its owner's cells, so that one standing on a border stays.
  double hysteresis_m = 0.25;
};

}  // namespace tessera::region

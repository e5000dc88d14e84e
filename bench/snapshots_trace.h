// The 901-cube scene of G. Fiedler's "Networked Physics" (2015) on our physics, recorded once for all codecs.
//
// 30 x 30 cubes of .4 m at 1 m pitch on the ground, and a player's cube of 1.5 m, dropped from 10 m, that is driven
// through them: plainly, pulling what is near along, and pushing it away. His constants: gravity 20 m/s^2, density 1
// kg/m^3, 120 N of drive (twice that against the motion), push 200/d^2 up to 500 m/s^2 within 2 m, pull 200/d^2 up to
// 2000 m/s^2 between .2 and 1.8 m, speeds held to 32 m/s and 16 rad/s. His simulation is ODE, and his drive a person's
// hand; here it is our engine and a seeded script, so rates compare by ratio, not by number.
#pragma once

#include <cstdint>
#include <vector>

#include "core/replication/codec/standing_box.h"
#include "core/replication/quantize.h"
#include "core/world/bounds.h"

namespace tessera::bench {

enum class CubeDrive : std::uint8_t { kMixed, kNone };

// Quantisation of all rows of the suite: positions in 1/512 m, orientations of 9 bits a component.
replication::SnapshotSettings CubeSettings();
Aabb CubeBounds();
// The cubes, by id from 1, and the ground: what a coder may know from the scene.
replication::StandingBoxes CubeBoxes();

struct CubeTrace {
  static constexpr std::size_t kCubes = 901;                    // the first is the player's
  std::vector<std::vector<replication::QuantizedState>> ticks;  // without velocities
  std::vector<double> moving_share;                             // share of cubes not asleep, by tick
  // Error of the quantised against the true state over all cubes and ticks: m, degrees.
  double position_error_p50_m = 0, position_error_max_m = 0;
  double angle_error_mean_deg = 0, angle_error_max_deg = 0;
};

CubeTrace RecordCubes(double seconds, CubeDrive drive, unsigned seed);

}  // namespace tessera::bench

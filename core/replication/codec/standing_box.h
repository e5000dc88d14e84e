// StandingBox: a box above a level floor. Where its centre is when it touches the floor follows from how it is turned,
// so whoever knows the scene need hardly be told the height of what lies, rolls or tips over there.
//
//   StandingBoxes boxes;
//   boxes[id] = StandingBox::Of(quantizer, floor_m, half_extents_m);
//   MakeDenseCodec(bounds, settings, gravity, velocities, std::make_shared<const StandingBoxes>(boxes));
//
// Both ends need the same, or their codecs refuse each other's frames. A hint, no promise: bodies that are elsewhere,
// or have another shape, are told as well, in more bits. Whole numbers only. Thread rule: const; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <map>

#include "core/replication/codec/rotation.h"

namespace tessera::replication {

struct StandingBox {
  std::int64_t floor = 0;              // height, steps
  std::array<std::int64_t, 3> half{};  // extents, 1/256 step

  static StandingBox Of(const Quantizer& quantizer, double floor_m, Vec3d half_extents_m);
  // Of its centre when it touches the floor, turned so; steps.
  std::int64_t HeightAt(const FixedQuaternion& q) const;
};

using StandingBoxes = std::map<BodyId, StandingBox>;

}  // namespace tessera::replication

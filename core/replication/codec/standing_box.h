// StandingBox: a box above a level floor. Where its centre is when it touches the floor follows from how it is turned,
// so a box that lies, rolls or tips over there costs hardly any bits for its height.
//
//   StandingBoxes boxes;
//   boxes[id] = StandingBox::Of(quantizer, floor_m, half_extents_m);
//   MakeDenseCodec(bounds, settings, gravity, velocities, std::make_shared<const StandingBoxes>(boxes));
//
// Both ends need the same, or their codecs refuse each other's frames. It is a hint, no promise: bodies that are
// elsewhere or have another shape are coded as well, in more bits. Integers only. Thread rule: const; any thread.
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
  // Height of its centre in steps when it touches the floor with this orientation.
  std::int64_t HeightAt(const FixedQuaternion& q) const;
};

using StandingBoxes = std::map<BodyId, StandingBox>;

}  // namespace tessera::replication

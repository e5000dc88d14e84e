#include "core/replication/codec/standing_box.h"

#include <algorithm>
#include <cmath>

namespace tessera::replication {
namespace {

constexpr int kHalfBits = 8;
// Keeps HeightAt within 64 bits; a box of 8 km at 1/1024 m.
constexpr double kMaxHalf = 2147483647.0;

}  // namespace

StandingBox StandingBox::Of(const Quantizer& quantizer, double floor_m, Vec3d half_extents_m) {
  BodyState state;
  state.position.y = floor_m;
  StandingBox box{.floor = quantizer.Quantize(state).position[1]};
  const double scale = (1 << kHalfBits) / quantizer.position_step_m();
  const double half_m[] = {half_extents_m.x, half_extents_m.y, half_extents_m.z};
  for (std::size_t i = 0; i < 3; ++i) box.half[i] = std::llround(std::clamp(half_m[i] * scale, 0.0, kMaxHalf));
  return box;
}

std::int64_t StandingBox::HeightAt(const FixedQuaternion& q) const {
  const auto [x, y, z, w] = q;
  // The second row of its matrix: how far each of its axes points up.
  const std::array<std::int64_t, 3> up{(x * y + w * z) >> (kFixedBits - 1),
                                       kFixedOne - ((x * x + z * z) >> (kFixedBits - 1)),
                                       (y * z - w * x) >> (kFixedBits - 1)};
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += half[i] * std::abs(up[i]);
  constexpr int kShift = kFixedBits + kHalfBits;
  return floor + ((sum + (std::int64_t{1} << (kShift - 1))) >> kShift);
}

}  // namespace tessera::replication

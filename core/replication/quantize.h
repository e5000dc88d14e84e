// Quantizer: body states as integers, as they are on the wire.
//
// Positions count steps from a corner of the world's bounds, orientations are "smallest three" (the largest component
// follows from the other three; Fiedler, "Snapshot Compression", 2015), velocities count steps. Zero, and so the
// identity and a body without spin, is exact. Every position can be represented, one inside the bounds in fewer bits.
//
// Thread rule: const; any thread.
#pragma once

#include <array>
#include <cstdint>

#include "core/replication/snapshot_settings.h"
#include "core/world/bounds.h"
#include "core/world/scene.h"

namespace tessera::replication {

struct QuantizedState {
  std::array<std::int64_t, 3> position{};  // within +-kMaxPosition
  // Components of the orientation but the largest, in the order x, y, z, w; see orientation_limit().
  std::array<std::int16_t, 3> smallest{};
  std::uint8_t largest = 3;              // index of the component that is left out, which is not negative
  bool asleep = false;                   // and then without velocities
  std::array<std::int32_t, 3> linear{};  // within +-kMaxVelocity
  std::array<std::int32_t, 3> angular{};
  friend bool operator==(const QuantizedState&, const QuantizedState&) = default;
};

inline bool SameTurn(const QuantizedState& a, const QuantizedState& b) {
  const auto [ax, ay, az] = a.smallest;
  const auto [bx, by, bz] = b.smallest;
  return a.largest == b.largest && ax == bx && ay == by && az == bz;  // quicker than a call to compare six bytes
}

// Twice the furthest coordinate of a scene at 1 / 2^20 m: further than any body.
inline constexpr std::int64_t kMaxPosition = std::int64_t{1} << 45;
// 2^22 steps of 1/64 m/s are 65 km/s.
inline constexpr std::int32_t kMaxVelocity = 1 << 22;
// Furthest prediction, ticks; a baseline that is older is taken as it is. It keeps integers within 64 bits.
inline constexpr std::uint64_t kMaxPredictedTicks = 256;

class Quantizer {
 public:
  Quantizer(const Aabb& world_bounds, const SnapshotSettings& settings);

  QuantizedState Quantize(const BodyState& state) const;
  BodyState Dequantize(const QuantizedState& state) const;
  Vec3d PositionOf(const QuantizedState& state) const;

  // Bits of a coordinate within the bounds, and whether one is.
  int position_bits(std::size_t axis) const { return position_bits_[axis]; }
  bool InBounds(const QuantizedState& state) const;
  int orientation_bits() const { return orientation_bits_; }
  double position_step_m() const { return position_step_; }
  std::int32_t orientation_limit() const { return orientation_limit_; }
  // Differs, most likely, between settings or bounds that do not understand each other.
  std::uint16_t fingerprint() const { return fingerprint_; }

 private:
  void QuantizeOrientation(Quatd orientation, QuantizedState& state) const;
  Quatd DequantizeOrientation(const QuantizedState& state) const;

  Vec3d origin_;
  double position_step_, linear_step_, angular_step_;
  std::array<int, 3> position_bits_{};
  int orientation_bits_;
  std::int32_t orientation_limit_;
  std::uint16_t fingerprint_;
};

}  // namespace tessera::replication

// Viewer: the point from which one client looks at the world, and how far away that makes a body.
#pragma once

#include <bit>
#include <cstdint>

#include "core/replication/snapshot_history_impl.h"
#include "core/replication/snapshot_sender.h"
#include "core/replication/snapshot_settings.h"

namespace tessera::replication {

class Viewer {
 public:
  // A body at that distance is sent with one in so many snapshots; in a crowd those that are not near with one in two
  // or four times as many, by `thinning`.
  static constexpr std::uint32_t kNearPeriod = 1, kMiddlePeriod = 2, kFarPeriod = 4;
  static constexpr std::uint32_t kMaxThinning = 2;
  static constexpr std::uint32_t kMaxPeriod = kFarPeriod << kMaxThinning;
  enum class Ring : std::uint8_t { kNear, kMiddle, kFar };

  Viewer(const ClientView& view, const SnapshotSettings& settings)
      : own_(view.own),
        centre_(view.centre.value_or(Vec3d())),
        per_radius_squared_(static_cast<float>(1 / (settings.interest_radius_m > 0
                                                        ? settings.interest_radius_m * settings.interest_radius_m
                                                        : kUnlimitedRadius_m * kUnlimitedRadius_m))),
        placed_(view.centre.has_value()),
        limited_(placed_ && settings.interest_radius_m > 0) {}

  // Squared distance of a body in radii of interest; without a radius in units of 100 m, which serves for the order
  // alone. 0 where the client's place is unknown.
  float DistanceSquared(const HotData& body) const {
    return placed_ ? LengthSquared(body.position - centre_) * per_radius_squared_ : 0;
  }
  // The same of a distance in m.
  float Squared(double distance_m) const { return static_cast<float>(distance_m * distance_m) * per_radius_squared_; }
  Ring RingAt(float distance_squared) const {
    if (!limited_ || distance_squared <= kNear * kNear) return Ring::kNear;
    return distance_squared <= kMiddle * kMiddle ? Ring::kMiddle : Ring::kFar;
  }
  static constexpr std::uint32_t Period(Ring ring, std::uint32_t thinning) {
    if (ring == Ring::kNear) return kNearPeriod;
    return (ring == Ring::kMiddle ? kMiddlePeriod : kFarPeriod) << thinning;
  }
  BodyId own() const { return own_; }

 private:
  static constexpr double kUnlimitedRadius_m = 100;
  // Shares of the radius within which bodies are near, and neither near nor far.
  static constexpr float kNear = 0.25f, kMiddle = 0.5f;
  static_assert(std::has_single_bit(kNearPeriod) && std::has_single_bit(kMiddlePeriod) &&
                std::has_single_bit(kFarPeriod));

  BodyId own_;
  Vec3f centre_;
  float per_radius_squared_;
  bool placed_, limited_;
};

}  // namespace tessera::replication

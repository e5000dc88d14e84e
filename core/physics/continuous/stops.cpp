#include "core/physics/continuous/stops.h"

#include <algorithm>
#include <tuple>

#include "core/physics/motion/turn.h"
#include "core/physics/tuning.h"

namespace tessera::physics {

bool Carries(const RigidBody& body, const RigidBody& other) {
  if (!other.awake() || !other.joints.empty()) return false;
  return body.moving() || (body.awake() && body.mass_kg() >= kCarrierMass * other.mass_kg());
}

void SortStops(std::span<RigidBody* const> awake, std::vector<Stop>* stops) {
  const auto key = [awake](const Stop& stop) { return std::tuple(awake[stop.index]->id(), stop.share, stop.by->id()); };
  const auto before = [&](const Stop& a, const Stop& b) { return key(a) < key(b); };
  const auto same = [](const Stop& a, const Stop& b) { return a.index == b.index; };
  std::sort(stops->begin(), stops->end(), before);
  const std::size_t count = stops->size();
  for (std::size_t i = 1; i < count; ++i) {
    const Stop stop = (*stops)[i];
    RigidBody* body = awake[stop.index];
    if (same((*stops)[i - 1], stop) && stop.by->awake() && Carries(*stop.by, *body)) {
      stops->push_back({stop.by->awake_index, stop.share, body});
    }
  }
  if (stops->size() > count) std::sort(stops->begin(), stops->end(), before);
  stops->erase(std::unique(stops->begin(), stops->end(), same), stops->end());
}

SweptMotion SweptMotionOf(const RigidBody& body, std::span<const BodyMotion> motions) {
  const Placement& from = body.placement();
  if (!body.awake()) {
    const Vec3d turned_rad = body.moving() ? Vec3d(body.state().angular_velocity) * body.driven_s : Vec3d();
    return {body.geometry(), from.position, from.position + Vec3d(body.predicted.move_m), from.orientation, turned_rad};
  }
  const BodyMotion& motion = motions[body.awake_index];
  return {body.geometry(), from.position, motion.position, from.orientation, Vec3d(motion.turned_rad)};
}

void MoveBack(std::span<RigidBody* const> awake, std::span<Stop> stops, std::span<BodyMotion> motions) {
  for (Stop& stop : stops) {
    BodyMotion& motion = motions[stop.index];
    const Placement& from = awake[stop.index]->placement();
    stop.end_m = motion.position;
    stop.velocity_m_s = motion.velocity;
    motion.position = from.position + (motion.position - from.position) * stop.share;
    motion.orientation = Turned(from.orientation, Vec3d(motion.turned_rad) * stop.share);
    motion.turned_rad *= static_cast<float>(stop.share);
  }
}

}  // namespace tessera::physics

#include "core/physics/narrow_phase.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <utility>

#include "core/physics/motion/sweep.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// Radius about which a surface bends where its outward normal is `normal`, m; 0 for what is flat there.
float RoundnessOf(const RigidBody& body, Vec3f normal) {
  const Geometry& geometry = body.geometry();
  switch (geometry.kind) {
    case GeometryKind::kSphere:
    case GeometryKind::kCapsule:
      return geometry.radius_m;
    case GeometryKind::kCylinder:
    case GeometryKind::kCone: {
      const float axial = Dot(body.placement().rotation.y, normal);
      const float radial = std::sqrt(std::max(0.0f, 1 - axial * axial));
      return radial > 0.5f ? geometry.radius_m * radial : 0;
    }
    default:
      return 0;
  }
}

// Notes how near the surfaces of a pair are, and whether one of its points may come to push in this step.
void MeasureContacts(Pair* pair, float dt_s) {
  const PredictedMotion &low = pair->low->predicted, &high = pair->high->predicted;
  pair->separation_m = std::numeric_limits<float>::max();
  pair->live = false;
  if (pair->manifolds.empty()) return;
  const Vec3f velocity = high.velocity_m_s - low.velocity_m_s;
  for (Manifold& manifold : pair->manifolds) {
    manifold.round_a_m = RoundnessOf(*pair->low, manifold.normal);
    manifold.round_b_m = RoundnessOf(*pair->high, -manifold.normal);
    const float approach = Dot(velocity, manifold.normal);
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      pair->separation_m = std::min(pair->separation_m, point.separation_m);
      const Vec3f turning = Cross(high.spin_rad_s, point.r_b) - Cross(low.spin_rad_s, point.r_a);
      const float closing = (approach + Dot(turning, manifold.normal)) * dt_s;
      if (point.separation_m + std::min(closing, 0.0f) < kTouchSoon_m) pair->live = true;
    }
  }
}

float Approach(const Pair& pair, const Manifold& manifold, const ManifoldPoint& point) {
  const auto velocity = [](const RigidBody& body, Vec3f r) {
    if (!body.stirs()) return Vec3f();
    return body.state().linear_velocity + Cross(body.state().angular_velocity, r);
  };
  return -Dot(velocity(*pair.high, point.r_b) - velocity(*pair.low, point.r_a), manifold.normal);
}

ActiveContact ContactOf(Pair& pair) {
  const auto index = [](const RigidBody& body) { return body.awake() ? body.awake_index : kAsleep; };
  ActiveContact contact{.pair = &pair,
                        .low = index(*pair.low),
                        .high = index(*pair.high),
                        .low_tag = pair.low->tag,
                        .high_tag = pair.high->tag,
                        .manifolds = pair.manifolds.data(),
                        .count = static_cast<std::uint32_t>(pair.manifolds.size()),
                        .substeps = pair.substeps,
                        .responds = pair.responds(),
                        .live = pair.live,
                        .driven = pair.low->moving() || pair.high->moving(),
                        .points = static_cast<std::uint8_t>(pair.manifolds.front().count),
                        .penetration_m = 0,
                        .impact_m_s = 0,
                        .load_ns = pair.load_ns,
                        .inner_m = pair.inner_m,
                        .slop_m = pair.slop_m,
                        .normal = pair.manifolds.front().normal,
                        .material = pair.material};
  if (!contact.live || !contact.responds) return contact;
  for (const Manifold& manifold : pair.manifolds) {
    for (int i = 0; i < manifold.count; ++i) {
      const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      contact.penetration_m = std::max(contact.penetration_m, -point.separation_m);
      contact.impact_m_s = std::max(contact.impact_m_s, Approach(pair, manifold, point));
    }
  }
  return contact;
}

SweptMotion PredictedSweep(const RigidBody& body, double dt_s) {
  const Placement& from = body.placement();
  if (!body.stirs()) return {body.geometry(), from.position, from.position, from.orientation, {}};
  return {body.geometry(), from.position, from.position + Vec3d(body.predicted.move_m), from.orientation,
          Vec3d(body.predicted.spin_rad_s) * dt_s};
}

// Collides two bodies that move by much of their own size in a step. Their nearest points of now say nothing about
// where they will meet, so contacts are found where they do, and are taken to be as far apart as the motion to that
// place is long. Two that only pass by have none.
void CollideFast(Pair& pair, double dt_s) {
  const SweptMotion low = PredictedSweep(*pair.low, dt_s), high = PredictedSweep(*pair.high, dt_s);
  pair.manifolds.clear();
  pair.cache = {};
  const std::optional<Impact> impact = FirstImpact(low, high, kImpactDistance_m);
  if (!impact) return;
  const Placement low_then = low.At(impact->fraction), high_then = high.At(impact->fraction);
  PairCache cache;
  Collide({low.geometry, low_then}, {high.geometry, high_then}, 2 * kImpactDistance_m, cache, pair.manifolds);
  const Vec3f moved(((high.to - high.from) - (low.to - low.from)) * impact->fraction);
  const Vec3f low_turned(low.turned_rad * impact->fraction), high_turned(high.turned_rad * impact->fraction);
  pair.swept = true;
  for (Manifold& manifold : pair.manifolds) {
    manifold.ahead_m = moved;
    for (int i = 0; i < manifold.count; ++i) {
      ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
      const Vec3f way = moved + Cross(high_turned, point.r_b) - Cross(low_turned, point.r_a);
      point.separation_m -= Dot(way, manifold.normal);
    }
  }
}

void ForgetContact(Pair& pair) {
  if (std::exchange(pair.apart, true)) return;
  pair.manifolds.clear();
  pair.cache = {};
  pair.impulse_ns = pair.load_ns = 0;
  pair.substeps = 0;
}

}  // namespace

void NarrowPhase::Run(double dt_s, PairTable& pairs, Waking& waking) {
  Clear();
  sleepers_.clear();
  const std::size_t count = pairs.SortIn();
  findings_.resize(count);
  if (listings_.size() < count) listings_.resize(count);
  pairs.Walk(
      team_, [this, dt_s](std::size_t i, Pair& pair) { findings_[i] = Examine(pair, dt_s, &listings_[i]); },
      [&](std::size_t i, Pair& pair) {
        if (findings_[i].contact) contacts_.push_back(listings_[i]);
        Settle(pair, findings_[i], pairs);
      });
  if (!sleepers_.empty()) WakeSleepers(dt_s, pairs, waking);
}

// A body that wakes brings pairs of its own, in which it may wake others. In the end all bodies that are awake have
// another place than before, so everything is listed anew.
void NarrowPhase::WakeSleepers(double dt_s, PairTable& pairs, Waking& waking) {
  while (!sleepers_.empty()) {
    std::swap(waking_, sleepers_);
    sleepers_.clear();
    for (RigidBody* body : waking_) waking.Wake(*body);
    for (Pair* pair : pairs.News()) {
      Finding finding;
      Search(*pair, dt_s, &finding);
      Settle(*pair, finding, pairs);
    }
  }
  Clear();
  pairs.Revisit([this](Pair& pair) {
    Finding finding;
    ActiveContact contact;
    List(pair, &finding, &contact);
    if (finding.contact) contacts_.push_back(contact);
    if (finding.parting) parting_.push_back(&pair);
  });
}

void NarrowPhase::Clear() {
  contacts_.clear();
  parting_.clear();
}

NarrowPhase::Finding NarrowPhase::Examine(Pair& pair, double dt_s, ActiveContact* contact) {
  Finding finding;
  Search(pair, dt_s, &finding);
  if (!finding.apart) List(pair, &finding, contact);
  return finding;
}

void NarrowPhase::Settle(Pair& pair, const Finding& finding, PairTable& pairs) {
  if (finding.parting) parting_.push_back(&pair);
  if (finding.wakes_low) sleepers_.push_back(pair.low);
  if (finding.wakes_high) sleepers_.push_back(pair.high);
  if (finding.apart) pairs.End(pair);
}

void NarrowPhase::List(Pair& pair, Finding* finding, ActiveContact* contact) {
  if (pair.manifolds.empty()) {
    finding->parting = pair.touching;
    return;
  }
  *contact = ContactOf(pair);
  // A kinematic body that passes by a sleeper has not woken it.
  finding->contact = !contact->driven || pair.low->awake() || pair.high->awake();
}

void NarrowPhase::Search(Pair& pair, double dt_s, Finding* finding) {
  const RigidBody &low = *pair.low, &high = *pair.high;
  if (!low.fat.Overlaps(high.fat)) {
    finding->apart = true;
    return;
  }
  pair.searched = true;
  pair.live = pair.swept = false;
  pair.separation_m = std::numeric_limits<float>::max();
  if (pair.jointed && !pair.trigger) return;
  const bool excluded = Excludes(low.exclusion_group, high.exclusion_group) && !pair.trigger;
  if (excluded || !low.reach.Overlaps(high.reach)) {
    ForgetContact(pair);
    return;
  }
  pair.apart = false;
  const float move =
      Length(low.predicted.move_m - high.predicted.move_m) + low.predicted.sweep_m + high.predicted.sweep_m;
  const bool fast = move > kFastShare * pair.inner_m;
  const float speculative = kSpeculative_m + (fast ? 0.0f : move);
  Collide({low.geometry(), low.placement()}, {high.geometry(), high.placement()}, speculative, pair.cache,
          pair.manifolds);
  MeasureContacts(&pair, static_cast<float>(dt_s));
  if (fast && !pair.trigger && pair.separation_m > kTouchEnd_m) {
    CollideFast(pair, dt_s);
    MeasureContacts(&pair, static_cast<float>(dt_s));
  }
  if (!pair.live || (pair.trigger && !low.moving() && !high.moving())) return;
  finding->wakes_low = low.dynamic() && !low.awake();
  finding->wakes_high = high.dynamic() && !high.awake();
}

bool NarrowPhase::Validate(std::span<RigidBody* const> awake) const {
  const auto names = [awake](std::uint32_t index, const RigidBody& body) {
    return index == kAsleep ? !body.awake() : index < awake.size() && awake[index] == &body;
  };
  const auto ids = [](const ActiveContact& contact) {
    return std::tuple(contact.pair->low->id(), contact.pair->high->id());
  };
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const ActiveContact& contact = contacts_[i];
    const Pair& pair = *contact.pair;
    if (i > 0 && !(ids(contacts_[i - 1]) < ids(contact))) return false;
    if (contact.low == kAsleep && contact.high == kAsleep) return false;
    if (!names(contact.low, *pair.low) || !names(contact.high, *pair.high)) return false;
    if (contact.count == 0 || contact.count != pair.manifolds.size()) return false;
  }
  return std::all_of(parting_.begin(), parting_.end(),
                     [](const Pair* pair) { return pair->touching && pair->manifolds.empty(); });
}

}  // namespace tessera::physics

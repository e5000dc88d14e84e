#include "core/physics/motion/sweep.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/physics/collide/gjk.h"
#include "core/physics/motion/ball_sweep.h"
#include "core/physics/motion/sweep_parts.h"
#include "core/physics/motion/turn.h"

namespace tessera::physics {

Placement SweptMotion::At(double fraction) const {
  Placement placement{from + (to - from) * fraction, Turned(orientation, turned_rad * fraction), {}};
  placement.rotation = RotationOf(placement.orientation);
  return placement;
}
namespace {

// Distances this near to the target count as reaching it, m.
constexpr double kTolerance_m = 1e-5;
// Enough for a rod that spins past a wall half a dozen times; a sweep that takes more ends where it is still safe.
constexpr int kSweepIterations = 100;
// Number of parts in which the rest of a motion is bounded, to tell a graze from an impact.
constexpr int kGrazeParts = 16;

// Conservative advancement of two convex parts, or of a plane and a convex part.
class Advance {
 public:
  Advance(const Part& a, const Part& b, const SweptPair& pair, double target_m, double slack_m)
      : a_(a),
        b_(b),
        pair_(pair),
        target_(target_m),
        slack_(slack_m),
        radius_(a.core.radius() + b.core.radius()),
        axis_(pair.start) {}

  // Finds the first impact before `until`, a share of the step.
  std::optional<Impact> Find(double until) {
    if (until <= 0) return {};
    Apart now = Measure(0);
    if (!StartNear(&now)) return {};
    double t = 0;
    for (int i = 0; i < kSweepIterations; ++i) {
      if (!now.apart || now.distance_m <= target_ + kTolerance_m) break;
      t += SafeTime(now, t, until - t);
      if (t >= until) return {};
      now = Measure(t);
    }
    if (!now.apart) now = {false, target_, axis_};
    if (Grazes(now, t)) return {};
    return Impact{t, Vec3f(now.axis)};
  }

 private:
  struct Apart {
    bool apart = false;
    double distance_m = 0;
    Vec3d axis;  // from a to b, unit, world axes
  };

  Apart Measure(double t) {
    if (a_.plane) return {true, Along(a_.plane_normal, t), a_.plane_normal};
    const Vec3d to_b = pair_.ToB(t);
    const Quatd q_a = pair_.a.At(t), into_a = Conjugate(q_a);
    b_.PlaceIn(Rotate(into_a, to_b), into_a * pair_.b.At(t));
    const GjkResult found = Gjk(a_.core, b_.placed, Rotate(into_a, axis_), std::numeric_limits<double>::infinity());
    if (found.kind == GjkResult::Kind::kOverlap) return {};
    axis_ = Rotate(q_a, found.axis);
    return {true, found.distance_m - radius_, axis_};
  }

  // Lowers the target for two that start nearer than that. Where it comes to lie deeper than the cores can measure,
  // smaller cores are taken; false if even these overlap.
  bool StartNear(Apart* now) {
    if (now->apart && now->distance_m > target_ + kTolerance_m) return true;
    if (!now->apart || (!a_.plane && now->distance_m - slack_ < slack_ - radius_)) {
      radius_ += a_.Shrink() + b_.Shrink();
      *now = Measure(0);
    }
    target_ = now->distance_m - slack_;
    return now->apart;
  }

  // Distance of the two at t along a fixed axis.
  double Along(Vec3d axis, double t) const {
    const double between = Dot(axis, pair_.ToB(t));
    const Vec3d in_b = Rotate(Conjugate(pair_.b.At(t)), -axis);
    const double reach_b = Dot(in_b, b_.core.Support(in_b));
    if (a_.plane) return between - reach_b - radius_ - a_.plane_offset_m;
    const Vec3d in_a = Rotate(Conjugate(pair_.a.At(t)), axis);
    return between - Dot(in_a, a_.core.Support(in_a)) - reach_b - radius_;
  }

  // A bound of the second derivative of that distance: a point at r from the axis of a turn w moves along `axis` like
  // w^2 r at most.
  double Curvature(Vec3d axis) const {
    const auto of = [axis](const Turning& turning, double reach) {
      const double w = Length(turning.turn);
      return w > 0 ? w * Length(Cross(turning.turn, axis)) * reach : 0;
    };
    return (a_.plane ? 0 : of(pair_.a, a_.reach_m)) + of(pair_.b, b_.reach_m);
  }

  // How long from t on, at most `rest`, the two surely stay further apart than the target.
  double SafeTime(const Apart& now, double t, double rest) const {
    const double start = std::min(now.distance_m, Along(now.axis, t));
    const double spare = std::max(start - target_, kTolerance_m / 4), curvature = Curvature(now.axis);
    double span = rest;
    // The turns may use up no more than the distance to spare.
    if (curvature * rest * rest > 8 * spare) span = std::sqrt(8 * spare / curvature);
    const double then = Along(now.axis, t + span);
    // The earlier root of spare + slope s + curvature s^2 / 2 = 0.
    const double slope = (then - start) / span - curvature * span / 2;
    if (slope >= 0) return span;
    const double under = slope * slope - 2 * curvature * spare;
    if (under < 0) return span;
    return std::min(span, 2 * spare / (std::sqrt(under) - slope));
  }

  // Whether the two surely come nearer along this axis by no more than the slack in the rest of the step.
  bool Grazes(const Apart& now, double t) const {
    const double curvature = Curvature(now.axis), part = (1 - t) / kGrazeParts, bulge = curvature * part * part / 8;
    const double least = now.distance_m - slack_;
    const int parts = curvature > 0 ? kGrazeParts : 1;
    for (int i = 1; i <= parts; ++i) {
      if (Along(now.axis, i == parts ? 1 : t + i * part) - bulge < least) return false;
    }
    return true;
  }

  Part a_, b_;
  const SweptPair& pair_;
  double target_, slack_, radius_;
  Vec3d axis_;  // the last axis that separated them; at first any
};

}  // namespace

std::optional<Impact> FirstImpact(const SweptMotion& a, const SweptMotion& b, float target_m) {
  assert(target_m > 0);
  if (HasNoParts(a.geometry) && HasNoParts(b.geometry)) return {};
  const bool turned = HasNoParts(b.geometry);
  const SweptPair pair = turned ? SweptPair(b, a) : SweptPair(a, b);
  const double slack_m = double{target_m} / 2;
  std::optional<Impact> first;
  if (IsBallSweep(pair)) {
    first = FirstImpactOfBall(pair, target_m, slack_m);
  } else {
    ForPartsThatMayMeet(pair, target_m, [&](const Part& part_a, const Part& part_b) {
      const double until = first ? first->fraction : 1;
      const std::optional<Impact> found = Advance(part_a, part_b, pair, target_m, slack_m).Find(until);
      if (found) first = found;
    });
  }
  if (first && turned) first->normal = -first->normal;
  return first;
}

namespace {

double ReachThrough(const Geometry& convex, const Placement& placement, Vec3d point, Vec3f normal) {
  Core core(AtOrigin(convex), 0);
  const Mat3f& r = placement.rotation;
  core.Place(placement.position - point, {Vec3d(r.x), Vec3d(r.y), Vec3d(r.z)});
  return core.radius() - Dot(core.Support(-Vec3d(normal)), Vec3d(normal));
}

Placement PartOf(const Placement& whole, const Geometry::Child& child) {
  Placement part = whole;
  part.position += Vec3d(whole.rotation * child.position);
  part.rotation = whole.rotation * child.rotation;
  return part;
}

}  // namespace

bool CameThrough(const SweptMotion& motion, Vec3d from, Vec3d to, Vec3f normal, double depth_m) {
  const Geometry& geometry = motion.geometry;
  const Placement end = motion.At(1);
  const auto came = [&](const Geometry& convex, const Placement& after, const auto& part_before) {
    const double reach = ReachThrough(convex, after, to, normal);
    return reach > depth_m && reach - ReachThrough(convex, part_before(motion.At(0)), from, normal) > depth_m;
  };
  if (geometry.convex()) return came(geometry, end, [](const Placement& start) { return start; });
  return std::ranges::any_of(geometry.children, [&](const Geometry::Child& child) {
    return came(*child.geometry, PartOf(end, child), [&](const Placement& start) { return PartOf(start, child); });
  });
}

}  // namespace tessera::physics

#include "core/physics/body_path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

// From one pose to another: displacement, and rotation vector in world axes.
struct Stretch {
  Vec3d move_m, turn_rad;
};

Stretch Between(const Pose& from, const Pose& to) {
  return {to.position - from.position, RotationVectorOf(to.orientation * Conjugate(from.orientation))};
}

bool Waits(const Stretch& way) { return way.move_m == Vec3d() && way.turn_rad == Vec3d(); }

// Velocities at a point.
struct Speeds {
  Vec3d linear_m_s, angular_rad_s;
};

Speeds SpeedsAt(const BodyPath& path, std::size_t point) {
  const std::size_t last = path.points.size() - 1;
  const bool ends = point == 0 || point == last;
  if (ends && path.repeat != PathRepeat::kLoop) return {};
  const std::size_t before = point == 0 ? last - 1 : point - 1, after = point == last ? 1 : point + 1;
  const PathPoint &here = path.points[point], &a = path.points[before], &b = path.points[after];
  const Stretch in = Between(a.pose, here.pose), out = Between(here.pose, b.pose);
  if (Waits(in) || Waits(out)) return {};
  // The last point of a loop is the first one again.
  const double loop_s = path.points.back().time_s;
  const double in_s = here.time_s - a.time_s + (point == 0 ? loop_s : 0);
  const double out_s = b.time_s - here.time_s + (point == last ? loop_s : 0);
  // The slope that a parabola through the three points has at the middle one.
  const double total_s = in_s + out_s;
  const double of_in = out_s / (in_s * total_s), of_out = in_s / (out_s * total_s);
  return {in.move_m * of_in + out.move_m * of_out, in.turn_rad * of_in + out.turn_rad * of_out};
}

// A cubic from 0 to `end` in `length_s`, with these slopes there, at a share of the time.
Vec3d Hermite(Vec3d end, Vec3d first, Vec3d last, double length_s, double share) {
  const double u = share, u2 = u * u, u3 = u2 * u;
  return end * (3 * u2 - 2 * u3) + first * (length_s * (u3 - 2 * u2 + u)) + last * (length_s * (u3 - u2));
}

// The time within the points' at which the body is where it is at `time_s`.
double Folded(const BodyPath& path, double time_s) {
  const double length_s = path.points.back().time_s;
  switch (path.repeat) {
    case PathRepeat::kLoop:
      return std::fmod(time_s, length_s);
    case PathRepeat::kPingPong: {
      const double there_and_back = std::fmod(time_s, 2 * length_s);
      return there_and_back > length_s ? 2 * length_s - there_and_back : there_and_back;
    }
    case PathRepeat::kOnce:
      break;
  }
  return std::min(time_s, length_s);
}

Pose OnCurve(const BodyPath& path, double time_s) {
  if (path.points.size() == 1) return path.points.front().pose;
  const double at_s = Folded(path, time_s);
  const auto after = std::ranges::upper_bound(path.points, at_s, {}, &PathPoint::time_s);
  if (after == path.points.end()) return path.points.back().pose;
  const auto to = static_cast<std::size_t>(after - path.points.begin()), from = to - 1;
  const PathPoint &a = path.points[from], &b = path.points[to];
  const Stretch way = Between(a.pose, b.pose);
  if (Waits(way)) return a.pose;
  const double length_s = b.time_s - a.time_s, share = (at_s - a.time_s) / length_s;
  const Speeds first = SpeedsAt(path, from), last = SpeedsAt(path, to);
  const Vec3d turn = Hermite(way.turn_rad, first.angular_rad_s, last.angular_rad_s, length_s, share);
  return {a.pose.position + Hermite(way.move_m, first.linear_m_s, last.linear_m_s, length_s, share),
          turn == Vec3d() ? a.pose.orientation : Normalized(TurnBy(turn) * a.pose.orientation)};
}

}  // namespace

Pose PoseOn(const BodyPath& path, double time_s) {
  Pose pose = OnCurve(path, time_s);
  if (path.spin_rad_s == Vec3d()) return pose;
  pose.orientation = Normalized(TurnBy(path.spin_rad_s * time_s) * pose.orientation);
  return pose;
}

BodyState StateOn(const BodyPath& path, Tick tick, double tick_rate_hz) {
  const auto time_s = [&](std::uint64_t at) { return static_cast<double>(at) / tick_rate_hz; };
  const Pose here = PoseOn(path, time_s(tick.value())), next = PoseOn(path, time_s(tick.value() + 1));
  const Stretch way = Between(here, next);
  BodyState state;
  state.position = here.position;
  state.orientation = here.orientation;
  state.linear_velocity = Vec3f(way.move_m * tick_rate_hz);
  state.angular_velocity = Vec3f(way.turn_rad * tick_rate_hz);
  state.asleep = Waits(way);
  return state;
}

}  // namespace tessera::physics

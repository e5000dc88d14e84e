#include "core/world/resolve_path.h"

#include <cmath>
#include <numbers>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/world/limits.h"
#include "core/world/proto_math.h"

namespace tessera {
namespace {

PathRepeat RepeatOf(Faults& faults, v1::Kinematic::Repeat in) {
  switch (in) {
    case v1::Kinematic::REPEAT_UNSPECIFIED:
    case v1::Kinematic::REPEAT_LOOP:
      return PathRepeat::kLoop;
    case v1::Kinematic::REPEAT_PING_PONG:
      return PathRepeat::kPingPong;
    case v1::Kinematic::REPEAT_ONCE:
      return PathRepeat::kOnce;
    default:
      faults.Add(absl::StrCat("kinematic.path.repeat must be REPEAT_LOOP, REPEAT_PING_PONG or REPEAT_ONCE, got ",
                              static_cast<int>(in)));
      return PathRepeat::kLoop;
  }
}

// Angle of the shortest turn, rad.
double AngleBetween(const Quatd& a, const Quatd& b) {
  const Quatd turn = b * Conjugate(a);
  return 2 * std::atan2(Length(Vec3d{turn.x, turn.y, turn.z}), std::abs(turn.w));
}

// The time of a point, s; nothing after a fault.
bool TimeOf(Faults& faults, const std::string& field, const v1::Kinematic::Point& in, const PathPoint& before,
            double way_m, double& time_s) {
  const bool timed = in.time() != 0, paced = in.speed() != 0;  // NaN is given, too
  if (timed == paced) {
    faults.Add(field + " needs either time or speed");
    return false;
  }
  if (paced) {
    if (!faults.Positive(field + ".speed", in.speed(), kMinPathSpeed_m_s, kMaxPathSpeed_m_s)) return false;
    if (way_m == 0) {
      faults.Add(field + ".speed: it is in the place of the point before, so it needs time");
      return false;
    }
    time_s = before.time_s + way_m / in.speed();
    return true;
  }
  if (!faults.Positive(field + ".time", in.time(), kMinPathTime_s, kMaxPathTime_s)) return false;
  if (!(in.time() >= before.time_s + kMinPathTime_s)) {
    faults.Add(absl::StrCat(field, ".time must be at least ", kMinPathTime_s, " s after the point before, at ",
                            before.time_s, ", got ", in.time()));
    return false;
  }
  time_s = in.time();
  return true;
}

bool AddPoint(Faults& faults, int index, const v1::Kinematic::Point& in, const Aabb& bounds, BodyPath& path) {
  const std::string field = absl::StrCat("kinematic.path.points[", index, "]");
  const std::size_t faults_before = faults.count();
  const PathPoint& before = path.points.back();
  v1::Pose proto;
  *proto.mutable_position() = in.position();
  *proto.mutable_orientation() = in.orientation();
  PathPoint point{0, faults.Normalised(field, proto, kMaxCoordinate_m)};
  if (!in.has_orientation()) point.pose.orientation = before.pose.orientation;
  if (faults.count() != faults_before) return false;
  if (!bounds.Contains(point.pose.position)) {
    faults.Add(field + ".position is outside the scene's bounds");
    return false;
  }
  const double way_m = Length(point.pose.position - before.pose.position);
  if (!TimeOf(faults, field, in, before, way_m, point.time_s)) return false;
  const double length_s = point.time_s - before.time_s;
  const double turn_rad_s = AngleBetween(before.pose.orientation, point.pose.orientation) / length_s;
  if (way_m / length_s > kMaxPathSpeed_m_s) {
    faults.Add(absl::StrCat(field, " is reached at ", way_m / length_s, " m/s, at most ", kMaxPathSpeed_m_s));
  }
  if (turn_rad_s > kMaxPathSpin_rad_s) {
    faults.Add(absl::StrCat(field, " is reached turning at ", turn_rad_s, " rad/s, at most ", kMaxPathSpin_rad_s));
  }
  if (point.time_s > kMaxPathTime_s) faults.Add(absl::StrCat(field, " is reached after ", point.time_s, " s"));
  path.points.push_back(point);
  return faults.count() == faults_before;
}

}  // namespace

std::shared_ptr<const BodyPath> ResolvePath(Faults& faults, const v1::Kinematic::Path& in, const Pose& begin,
                                            const Aabb& bounds) {
  auto path = std::make_shared<BodyPath>();
  path->repeat = RepeatOf(faults, in.repeat());
  path->points.push_back({0, begin});
  if (faults.Length("kinematic.path.spin", in.spin(), kMaxPathSpin_rad_s)) path->spin_rad_s = FromProto(in.spin());
  if (in.points().empty() && !in.has_spin()) {
    faults.Add("kinematic.path has neither points nor spin: leave it out for a body that a game moves");
    return path;
  }
  if (static_cast<std::size_t>(in.points_size()) > kMaxPathPoints) {
    faults.Add(absl::StrCat("kinematic.path.points: at most ", kMaxPathPoints, ", got ", in.points_size()));
    return path;
  }
  for (int i = 0; i < in.points_size(); ++i) {
    if (!AddPoint(faults, i, in.points(i), bounds, *path)) return path;
  }
  if (in.points().empty() || path->repeat != PathRepeat::kLoop) return path;
  const Pose& end = path->points.back().pose;
  if (in.points_size() < 2) {
    faults.Add("kinematic.path.points: a loop needs at least two, the last one at the body's own pose");
  } else if (Length(end.position - begin.position) > kLoopTolerance_m ||
             AngleBetween(end.orientation, begin.orientation) > kLoopTolerance_rad) {
    faults.Add("kinematic.path.points: the last one of a loop must be the body's own pose");
  } else {
    path->points.back().pose = begin;
  }
  return path;
}

}  // namespace tessera

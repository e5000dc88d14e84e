#include "client_sdk/shape_radius.h"

#include <algorithm>
#include <cmath>

namespace tessera::client {
namespace {

struct FormRadius {
  double operator()(const BoxShape& s) const { return Length(s.half_extents_m); }
  double operator()(const SphereShape& s) const { return s.radius_m; }
  double operator()(const CapsuleShape& s) const { return s.radius_m + s.half_height_m; }
  double operator()(const CylinderShape& s) const { return std::hypot(s.radius_m, s.half_height_m); }
  double operator()(const ConeShape& s) const { return std::hypot(s.radius_m, s.height_m); }
  double operator()(const ConvexHullShape& s) const {
    double most = 0;
    for (const Vec3f& point : s.points) most = std::max<double>(most, Length(point));
    return 2 * most;  // the centre of mass is somewhere within
  }
  double operator()(const CompoundShape& s) const {
    double most = 0;
    for (const CompoundChild& c : s.children) most = std::max(most, Length(c.pose.position) + RadiusOf(*c.shape));
    return 2 * most;
  }
  template <class StaticOnly>
  double operator()(const StaticOnly&) const {
    return 0;
  }
};

}  // namespace

double RadiusOf(const Shape& shape) { return std::visit(FormRadius{}, shape.form); }

}  // namespace tessera::client

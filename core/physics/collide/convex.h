// Convex: a convex geometry, or one triangle, where it lies in the frame of a pair; and its core for GJK.
//
//   const Convex box = Placed(geometry, pose), face = TriangleAt(corners);
//   const Core core(box, InsetOf(box));
//   const Vec3d far = core.Support({0, 1, 0});
//
// Thread rule: values; any thread.
#pragma once

#include <array>
#include <cstdint>

#include "core/physics/collide/geometry.h"
#include "core/physics/collide/pair_functions.h"

namespace tessera::physics {

struct Convex {
  const Geometry* geometry = nullptr;  // none: a triangle
  std::array<Vec3f, 3> triangle;       // counter-clockwise from where it looks
  Vec3f position;
  Mat3f rotation;

  Vec3f Out(Vec3f local) const { return position + rotation * local; }
};

Convex AtOrigin(const Geometry& geometry);
Convex Placed(const Geometry& geometry, const LocalPose& pose);
Convex TriangleAt(const std::array<Vec3f, 3>& corners);

// Somewhere inside.
Vec3f MiddleOf(const Convex& convex);
// max dot(direction, p) over the shape, with its true surface.
double ReachOf(const Convex& convex, Vec3f direction);

// How far a core may lie below the surface. Cores of shapes that overlap by less than that are apart, so that GJK finds
// the way between them. Larger spares EPA in deeper overlaps; smaller keeps the ways at edges truer.
float InsetOf(const Convex& convex);

// A convex shape with `inset` taken off all round, as a support function in doubles. The rounding `radius` about it
// gives spheres and capsules exactly, and everything else with an inset of 0. A hull is scaled about its middle
// instead, by as much as moves its nearest face by the inset.
class Core {
 public:
  Core(const Convex& convex, double inset);

  double radius() const { return radius_; }
  // Somewhere else, in doubles. A triangle stays where its corners are.
  void Place(Vec3d position, const std::array<Vec3d, 3>& axes) {
    position_ = position;
    x_ = axes[0], y_ = axes[1], z_ = axes[2];
  }
  // A point of the core farthest along `direction`, which need not be a unit vector but not 0. Without `radius`.
  Vec3d Support(Vec3d direction) const;

 private:
  enum class Form : std::uint8_t { kPoint, kSegment, kBox, kCylinder, kCone, kPoints };
  Vec3d LocalSupport(Vec3d direction) const;

  Form form_ = Form::kPoint;
  double radius_ = 0;
  Vec3d half_;                      // box; segment and cylinder: y
  double round_ = 0;                // radius of cylinder, of a cone's base
  double base_y_ = 0, apex_y_ = 0;  // cone
  const Vec3f* points_ = nullptr;   // hull
  std::size_t count_ = 0;
  double scale_ = 1;  // factor of the hull, about its middle
  Vec3d middle_;      // shift that the scaling causes
  std::array<Vec3f, 3> triangle_{};
  Vec3d x_{1, 0, 0}, y_{0, 1, 0}, z_{0, 0, 1}, position_;
};

}  // namespace tessera::physics

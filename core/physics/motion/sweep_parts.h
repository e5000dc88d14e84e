// The convex parts of two bodies on their ways: what a sweep tests against each other.
#pragma once

#include <array>
#include <functional>

#include "core/physics/collide/convex.h"
#include "core/physics/motion/sweep.h"
#include "core/physics/trig.h"

namespace tessera::physics {

// An orientation that turns by `turn` over the step, world axes.
struct Turning {
  Quatd from;
  Vec3d turn;

  Quatd At(double t) const { return turn == Vec3d() ? from : TurnBy(turn * t) * from; }
};

// Of two bodies, a first. Where they are does not matter, only where b is from a.
struct Ways {
  Ways(const Way& way_a, const Way& way_b);
  Vec3d ToB(double t) const { return start + travel * t; }

  const Geometry &geometry_a, &geometry_b;
  Turning a, b;
  Vec3d start, travel;
};

struct Part {
  explicit Part(const Convex& in_body);
  Part(const Geometry& plane, const Turning& turning);

  // Makes `placed` from the body's frame as seen from another.
  void PlaceIn(Vec3d position, Quatd orientation);
  // Takes the inset off `core`; returns how much that was.
  double Shrink();

  Convex convex;  // in the body's frame
  Core core;      // likewise
  Core placed;    // in the other body's
  Vec3d middle;   // of a ball that holds all of it, in the body's frame, and the ball's radius
  double size_m = 0;
  double reach_m = 0;  // of the core, without its rounding, from the body's origin
  bool plane = false;
  Vec3d plane_normal;  // world axes
  double plane_offset_m = 0;
};

// A mesh, height field or plane.
bool HasNoParts(const Geometry& geometry);

// Calls `test` for each pair of parts whose balls come nearer than `target_m`, in an order that is always the same.
// Only a may be without parts: its triangles that b sweeps over, or the plane, are taken.
void ForPartsThatMayMeet(const Ways& ways, double target_m, const std::function<void(const Part&, const Part&)>& test);

}  // namespace tessera::physics

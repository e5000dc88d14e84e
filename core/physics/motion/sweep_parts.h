// SweptPair and Part: the motions of two bodies against each other, and the convex parts that a sweep tests.
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

// The motions of two bodies, a first. Only the position of b relative to a matters.
struct SweptPair {
  SweptPair(const SweptMotion& motion_a, const SweptMotion& motion_b);
  Vec3d ToB(double t) const { return start + travel * t; }

  const Geometry &geometry_a, &geometry_b;
  Turning a, b;
  Vec3d start, travel;
};

struct Part {
  explicit Part(const Convex& in_body);
  Part(const Geometry& plane, const Turning& turning);

  // Makes `placed`, where the body's frame is given as seen from the other body.
  void PlaceIn(Vec3d position, Quatd orientation);
  // Takes the inset off `core`; returns that inset, m.
  double Shrink();

  Convex convex;       // in the body's frame
  Core core;           // in the body's frame
  Core placed;         // in the other body's frame
  Vec3d middle;        // centre of a ball that holds all of the part, in the body's frame
  double size_m = 0;   // radius of that ball
  double reach_m = 0;  // from the body's origin to the farthest point of the core, without its rounding
  bool plane = false;
  Vec3d plane_normal;  // world axes
  double plane_offset_m = 0;
};

// A mesh, height field or plane.
bool HasNoParts(const Geometry& geometry);

// Calls `test` for each pair of parts whose balls come nearer than `target_m`, in an order that is always the same.
// Only a may be without parts: then its triangles that b sweeps over are its parts, or the plane is.
void ForPartsThatMayMeet(const SweptPair& pair, double target_m,
                         const std::function<void(const Part&, const Part&)>& test);

}  // namespace tessera::physics

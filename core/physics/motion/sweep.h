// Sweep: when in a step two moving, turning shapes first touch.
//
// Conservative advancement (Mirtich 1996) along the axis that parts the two: the distance along it is known now and at
// a later time, and between those it falls below their line by no more than the turns allow (as Redon, Kim, Lin and
// Manocha 2004 bound them, but to second order). So it never passes an impact and never reports a near miss, and takes
// as few steps as Newton's method where nothing turns.
//
// Reckoned in doubles from relative positions, which makes it the same anywhere in the world.
// Thread rule: Bullet's trees of triangles allow one thread at a time.
#pragma once

#include <optional>

#include "core/physics/collide/collide.h"

namespace tessera::physics {

// A body's way through one step: straight, turning at a constant rate. What has no convex parts
// (mesh, height field, plane) stays where it is.
struct Way {
  const Geometry& geometry;
  Vec3d from, to;     // of the centre of mass, m
  Quatd orientation;  // at the start
  Vec3d turned_rad;   // rotation vector of the whole step, world axes; any length

  Placement At(double fraction) const;
};

struct Impact {
  double fraction = 0;  // of the step, 0 to 1: where their distance falls to `target_m`
  Vec3f normal;         // from a to b at that moment, unit
};

// Nothing if they stay further apart than `target_m` > 0, or come nearer by less than half of it in what is left of the
// step. Two that are nearer at the start, or overlap, count from where they are: an impact is where they are nearer by
// another half of `target_m`. Deep overlaps are left to contacts.
std::optional<Impact> FirstImpact(const Way& a, const Way& b, float target_m);

// By how much further than at the start of its way a convex part of the shape reaches, at the end, through a plane with
// the unit normal `normal` that goes from `from` to `to`, against the normal, m; what it had reached through by then
// does not count: of a dumbbell that is touched at one ball, the other may lie beyond that contact's plane. 0 for what
// is not made of convex parts.
double CameThrough(const Way& way, Vec3d from, Vec3d to, Vec3f normal);

}  // namespace tessera::physics

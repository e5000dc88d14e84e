// Sweep: when in a step two moving, turning shapes first touch.
//
// The method is conservative advancement (Mirtich 1996) along the axis that separates the two: the distance along it is
// known now and at a later time, and between those it falls below their line by no more than the turns allow (as Redon,
// Kim, Lin and Manocha 2004 bound them, but to second order). So a sweep never passes an impact and never reports a
// near miss, and takes as few steps as Newton's method where nothing turns.
//
// It is computed in doubles from relative positions, which makes it the same anywhere in the world.
// Pure functions, any thread.
#pragma once

#include <optional>

#include "core/physics/collide/collide.h"

namespace tessera::physics {

// The motion of a body through one step: straight, turning at a constant rate. A shape without convex parts (mesh,
// height field, plane) stays where it is.
struct SweptMotion {
  const Geometry& geometry;
  Vec3d from, to;     // centre of mass at the start and the end, m
  Quatd orientation;  // at the start
  Vec3d turned_rad;   // rotation vector of the whole step, world axes; any length

  Placement At(double fraction) const;
};

struct Impact {
  double fraction = 0;  // share of the step after which their distance falls to `target_m`
  Vec3f normal;         // from a to b at that moment, unit
};

// The first impact; nothing if the two stay further apart than `target_m` > 0, or come nearer by less than half of it
// in the rest of the step. Two that are nearer at the start, or overlap, count from where they are: an impact is where
// they are nearer by another half of `target_m`. Deep overlaps are left to contacts.
std::optional<Impact> FirstImpact(const SweptMotion& a, const SweptMotion& b, float target_m);

// Whether a convex part of the shape came through a plane by more than `depth_m` >= 0 in this motion: how much further
// it reaches through the plane at the end than at the start, against the plane's unit normal `normal`. The plane itself
// moves from `from` to `to`. Depth at the start does not count: a dumbbell that is touched at one ball may reach beyond
// that contact's plane with the other. A shape without convex parts never does.
bool CameThrough(const SweptMotion& motion, Vec3d from, Vec3d to, Vec3f normal, double depth_m);

}  // namespace tessera::physics

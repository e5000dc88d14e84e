// Manifold: where two bodies touch or are about to, and what the solver did there last.
//
// Body a has the lower id, always. All vectors have world axes; points are relative to each body's centre of mass, so
// nothing here depends on where in the world the bodies are.
#pragma once

#include <absl/container/inlined_vector.h>

#include <array>
#include <cstdint>

#include "core/physics/linear.h"

namespace tessera::physics {

inline constexpr int kManifoldPoints = 4;

struct ManifoldPoint {
  Vec3f r_a, r_b;             // from each centre of mass to the middle between the two surfaces, m
  float separation_m = 0;     // along the normal; negative where they overlap
  std::uint32_t feature = 0;  // names the point from step to step: which face, edge or vertex made it
  float normal_impulse = 0;   // N s, of the last substep: what the next step starts with
  float total_impulse = 0;    // N s, summed over the last step
};

struct Manifold {
  Vec3f normal;  // unit, from a to b
  int count = 0;
  std::uint32_t key = 0;  // which of the pair's manifolds: part of a compound, group of triangles; 0 for convex pairs
  // How far the surface bends round a point within the body, m: a ball's radius, 0 for a face or a corner. What turns
  // about that point brings up new surface and stays where it was.
  float round_a_m = 0, round_b_m = 0;
  Vec3f friction_impulse;            // N s on b, last substep: what the next step starts with
  Vec3f rolling_impulse;             // N m s on b, rolling and twist, last substep
  Vec3f friction_r_a, friction_r_b;  // from each centre of mass to where the solver let friction act, m
  Vec3f total_friction;              // summed over the last step, N s on b
  Vec3f total_rolling;               // N m s on b
  Vec3f ahead_m;                     // by which b must yet move against a to be where the points were found
  Vec3f turn_on_a, turn_on_b;        // N m s over the last step, for what the points lagged behind the bodies
  // Last: most manifolds have one or two, and leave the rest of the memory alone.
  std::array<ManifoldPoint, kManifoldPoints> points;
};

// The manifolds of one pair: almost always one, which is then stored within the pair.
using Manifolds = absl::InlinedVector<Manifold, 1>;

// Combined material of two surfaces in contact.
struct PairMaterial {
  float friction = 0;  // Coulomb
  float rolling_m = 0, spinning_m = 0;
  float restitution = 0;
};

}  // namespace tessera::physics

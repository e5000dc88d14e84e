// Constants of queries. Each has its unit, its reason, and what breaks if it changes.
#pragma once

#include <cstdint>

namespace tessera::physics {

// Work in instructions of a game, some 5 ns each. Games are charged by these figures, which are about twice the time
// that each took: larger ones leave fewer queries to a callback, smaller ones let it take longer than its budget means.
inline constexpr std::uint64_t kQueryWork = 100;     // a query that meets nothing
inline constexpr std::uint64_t kCandidateWork = 20;  // a body whose bounds the way crosses
inline constexpr std::uint64_t kPastWork = 2;        // a body that a query into the past looks at, near or not
inline constexpr std::uint64_t kAcceptWork = 20;     // asking whether a body is meant
inline constexpr std::uint64_t kPartWork = 20;       // a convex part, or a plane
inline constexpr std::uint64_t kCastStepWork = 60;   // one run of GJK
inline constexpr std::uint64_t kPieceWork = 40;      // looking for triangles
inline constexpr std::uint64_t kTriangleWork = 10;

// Most pieces of a way over a surface. More cost a walk through the tree each; fewer hold more triangles each.
inline constexpr int kMostSurfacePieces = 4096;
// Bounds are in single precision about the origin of a world. A query widens them by so much, m, and by this share of
// their coordinates, so that rounding hides no body.
inline constexpr double kQueryMargin_m = 1e-3, kQueryMarginShare = 1e-6;

}  // namespace tessera::physics

#include "core/physics/collide/collide.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/tuning.h"

namespace tessera::physics {

struct PairCache::Parts {
  PartCaches caches;
  std::vector<LocalManifold> manifolds;
  Manifolds previous;
};

void PairCache::DeleteParts::operator()(Parts* doomed) const { delete doomed; }

namespace {

// A pair in the order of its search.
struct OrderedPair {
  const Geometry &a, &b;
  const Placement &at_a, &at_b;
  bool flipped = false;
};

OrderedPair Ordered(const Collidable& a, const Collidable& b) {
  if (InOrder(a.geometry, b.geometry)) return {a.geometry, b.geometry, a.placement, b.placement, false};
  return {b.geometry, a.geometry, b.placement, a.placement, true};
}

LocalPose PoseOf(const OrderedPair& pair, Vec3d between) {
  const Mat3f &ra = pair.at_a.rotation, &rb = pair.at_b.rotation;
  const auto along = [&](Vec3f axis) { return -Dot(Vec3d(axis), between); };
  return {.position = Into(ra, Vec3f(between)),
          .rotation = Into(ra, rb),
          .a_in_b = {along(rb.x), along(rb.y), along(rb.z)}};
}

// The same of what quick searches look at: a ball's centre, a capsule's axis.
LocalPose QuickPoseOf(const OrderedPair& pair, Vec3d between) {
  if (pair.b.kind == GeometryKind::kPlane) return PoseOf(pair, between);
  LocalPose pose;
  pose.position = Into(pair.at_a.rotation, Vec3f(between));
  if (pair.b.kind == GeometryKind::kCapsule) pose.rotation.y = Into(pair.at_a.rotation, pair.at_b.rotation.y);
  return pose;
}

// --- Reuse.

bool IsRound(const Geometry& g) { return g.kind == GeometryKind::kSphere || g.kind == GeometryKind::kCapsule; }

// Searching is as quick as remembering.
bool Quick(const Geometry& a, const Geometry& b) {
  if (b.kind == GeometryKind::kPlane) return IsRound(a) || a.kind == GeometryKind::kBox;
  if (b.kind == GeometryKind::kSphere) return IsRound(a) || a.kind == GeometryKind::kBox;
  return IsRound(a) && IsRound(b);
}

// How far any point of the smaller body may have moved against the other before the two are searched anew.
float Leeway(const OrderedPair& pair) {
  return std::min(kReuseMove_m, kReuseShare * std::min(pair.a.outer_radius_m, pair.b.outer_radius_m));
}

struct Change {
  float moved_m = 0;  // no point of the smaller body moved further
  float turned = 0;   // chord of the turn, about rad
};

Change ChangeSince(const PairCache& cache, const OrderedPair& pair, const LocalPose& pose) {
  const Mat3f &r = pose.rotation, &s = cache.pose.rotation;
  // The Frobenius norm of a difference of rotations is sqrt(8) sin(angle / 2); a point at radius 1 moves 2 sin(angle /
  // 2).
  const float square = LengthSquared(r.x - s.x) + LengthSquared(r.y - s.y) + LengthSquared(r.z - s.z);
  Change change;
  change.turned = std::sqrt(square * 0.5f);
  if (pair.b.outer_radius_m <= pair.a.outer_radius_m) {
    change.moved_m = Length(pose.position - cache.pose.position) + change.turned * pair.b.outer_radius_m;
  } else {
    change.moved_m = Length(Vec3f(pose.a_in_b - cache.pose.a_in_b)) + change.turned * pair.a.outer_radius_m;
  }
  return change;
}

// Anchors of b relative to a's origin at the search, along b's axes: small numbers however large b is.
void Anchor(const LocalPose& pose, LocalManifold* manifold) {
  for (LocalPoint& point : std::span(manifold->points).first(static_cast<std::size_t>(manifold->count)))
    point.on_b = Into(pose.rotation, point.on_b);
}

// --- Output.

// Where a contact is on the way from a's surface, 0, to b's, 1: half way, but for something round on something else.
// That rolls by its radius, whatever the depth.
float ShareOfB(const OrderedPair& pair) {
  if (IsRound(pair.a) == IsRound(pair.b)) return 0.5f;
  return IsRound(pair.a) ? 0.0f : 1.0f;
}

// From the frame of the search to the world's axes.
struct Outlet {
  Outlet(const OrderedPair& of, Vec3f between_m, float speculative)
      : pair(of), between(between_m), speculative_m(speculative), share_b(ShareOfB(of)) {}

  const OrderedPair& pair;
  Vec3f between;  // from a's centre of mass to b's, world axes
  float speculative_m;
  float share_b;

  // Anchors of b by now, in a's frame, and separations there. `on_b(point)` gives the former.
  struct Anchors {
    std::array<Vec3f, kManifoldPoints> on_b;
    std::array<float, kManifoldPoints> separation_m;
    int near = 0;  // number of points that are not too far apart
  };
  template <class OnB>
  Anchors AnchorsOf(const LocalManifold& from, OnB on_b) const {
    Anchors anchors;
    for (std::size_t i = 0; i < static_cast<std::size_t>(from.count); ++i) {
      anchors.on_b[i] = on_b(from.points[i]);
      anchors.separation_m[i] = Dot(anchors.on_b[i] - from.points[i].on_a, from.normal);
      if (!(anchors.separation_m[i] > speculative_m)) ++anchors.near;
    }
    return anchors;
  }

  // Sets all but what the solver writes. With `kKeep`, all points are near, and `to` has them with their impulses.
  template <bool kKeep>
  void Write(const LocalManifold& from, const Anchors& anchors, Manifold* to) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(from.count); ++i) {
      if (!kKeep && anchors.separation_m[i] > speculative_m) continue;
      const LocalPoint& point = from.points[i];
      const Vec3f at = point.on_a + (anchors.on_b[i] - point.on_a) * share_b;
      const Vec3f r_a = pair.at_a.rotation * at, r_b = r_a - between;
      ManifoldPoint& out = to->points[count++];
      out.r_a = pair.flipped ? r_b : r_a;
      out.r_b = pair.flipped ? r_a : r_b;
      out.separation_m = anchors.separation_m[i];
      out.total_impulse = 0;
      if constexpr (kKeep) continue;
      out.feature = point.feature;
      out.normal_impulse = 0;
    }
    to->count = static_cast<int>(count);
    const Vec3f normal = pair.at_a.rotation * from.normal;
    to->normal = pair.flipped ? -normal : normal;
    to->key = from.key;
    to->total_friction = to->total_rolling = to->ahead_m = to->turn_on_a = to->turn_on_b = {};
  }
};

// Carries the solver's impulses over from old points to new ones: by feature key, else to the nearest one left over.
void CarryOver(std::span<const ManifoldPoint> olds, float tolerance_m, Manifold* now) {
  std::array<bool, kManifoldPoints> taken{}, found{};
  const auto points = std::span(now->points).first(static_cast<std::size_t>(now->count));
  std::size_t left = points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < olds.size(); ++j) {
      if (taken[j] || olds[j].feature != points[i].feature) continue;
      points[i].normal_impulse = olds[j].normal_impulse;
      taken[j] = found[i] = true;
      --left;
      break;
    }
  }
  for (std::size_t i = 0; left > 0 && i < points.size(); ++i) {
    if (found[i]) continue;
    float nearest = tolerance_m * tolerance_m;
    std::size_t best = olds.size();
    for (std::size_t j = 0; j < olds.size(); ++j) {
      if (taken[j]) continue;
      // One of the two bodies may have turned; the other decides.
      const float square =
          std::min(LengthSquared(points[i].r_a - olds[j].r_a), LengthSquared(points[i].r_b - olds[j].r_b));
      if (square < nearest) nearest = square, best = j;
    }
    if (best == olds.size()) continue;
    points[i].normal_impulse = olds[best].normal_impulse;
    taken[best] = true;
  }
}

float CarryTolerance(const OrderedPair& pair) {
  return std::min(kCarry_m, kCarryShare * std::min(pair.a.outer_radius_m, pair.b.outer_radius_m));
}

// --- Pairs with one manifold.

void SearchOne(const OrderedPair& pair, const LocalPose& pose, float reach_m, ConvexCache& cache,
               LocalManifold* manifold) {
  cache.apart_m = 0;
  if (pair.b.kind == GeometryKind::kPlane) {
    CollidePlane(pair.a, PlaneIn(pair.b, pose), reach_m, manifold);
  } else {
    CollideConvex(pair.a, pair.b, pose, reach_m, cache, manifold);
  }
}

// In place: it is still warm from the last step. `again`: the last call wrote the same manifold. Where it wrote all of
// its points, and they are all written now, each has its impulse already.
template <class OnB>
void WriteOne(const Outlet& outlet, const LocalManifold& manifold, bool again, OnB on_b, Manifolds& manifolds) {
  const Outlet::Anchors anchors = outlet.AnchorsOf(manifold, on_b);
  if (anchors.near == 0) {
    manifolds.clear();
    return;
  }
  const bool fresh = manifolds.empty();
  if (fresh) manifolds.resize(1);
  Manifold& now = manifolds[0];
  if (again && now.count == manifold.count && anchors.near == manifold.count) {
    outlet.Write<true>(manifold, anchors, &now);
    return;
  }
  std::array<ManifoldPoint, kManifoldPoints> olds;
  const auto count = static_cast<std::size_t>(now.count);
  std::copy_n(now.points.begin(), count, olds.begin());
  outlet.Write<false>(manifold, anchors, &now);
  if (!fresh) CarryOver(std::span(olds).first(count), CarryTolerance(outlet.pair), &now);
}

// --- Pairs with any number.

void SearchMany(const OrderedPair& pair, const LocalPose& pose, float reach_m, PairCache& cache) {
  if (!cache.parts) cache.parts.reset(new PairCache::Parts);
  PairCache::Parts& parts = *cache.parts;
  parts.manifolds.clear();
  CollideLocal(pair.a, pair.b, pose, reach_m, parts.caches, &parts.manifolds);
  std::stable_sort(parts.manifolds.begin(), parts.manifolds.end(),
                   [](const LocalManifold& x, const LocalManifold& y) { return x.key < y.key; });
  for (LocalManifold& manifold : parts.manifolds) Anchor(pose, &manifold);
}

// Both ascend by key.
template <class OnB>
void WriteMany(const Outlet& outlet, PairCache::Parts& parts, OnB on_b, Manifolds& manifolds) {
  parts.previous.swap(manifolds);
  manifolds.clear();
  const float tolerance = CarryTolerance(outlet.pair);
  auto old = parts.previous.cbegin();
  for (const LocalManifold& local : parts.manifolds) {
    while (old != parts.previous.cend() && old->key < local.key) ++old;
    const bool stays = old != parts.previous.cend() && old->key == local.key;
    Manifold now = stays ? *old : Manifold();
    outlet.Write<false>(local, outlet.AnchorsOf(local, on_b), &now);
    if (now.count == 0) continue;
    if (stays) CarryOver(std::span(old->points).first(static_cast<std::size_t>(old->count)), tolerance, &now);
    manifolds.push_back(now);
  }
}

// Nothing is remembered.
void CollideQuick(const OrderedPair& pair, Vec3d between, float speculative_m, Manifolds& manifolds) {
  const LocalPose pose = QuickPoseOf(pair, between);
  const Outlet outlet(pair, Vec3f(between), speculative_m);
  LocalManifold manifold;
  ConvexCache unused;
  SearchOne(pair, pose, speculative_m, unused, &manifold);
  WriteOne(
      outlet, manifold, false, [](const LocalPoint& point) { return point.on_b; }, manifolds);
}

}  // namespace

void Collide(const Collidable& a, const Collidable& b, float speculative_m, PairCache& cache, Manifolds& manifolds) {
  const OrderedPair pair = Ordered(a, b);
  const Vec3d between = pair.at_b.position - pair.at_a.position;
  if (Quick(pair.a, pair.b)) return CollideQuick(pair, between, speculative_m, manifolds);

  const LocalPose pose = PoseOf(pair, between);
  const Outlet outlet(pair, Vec3f(between), speculative_m);
  const bool one = pair.a.convex() && (pair.b.convex() || pair.b.kind == GeometryKind::kPlane);
  const float leeway = Leeway(pair);
  bool search = true;
  if (cache.searched) {
    const Change change = ChangeSince(cache, pair, pose);
    if (one && cache.apart_m > speculative_m + change.moved_m) {
      manifolds.clear();
      return;
    }
    search =
        change.moved_m > leeway || change.turned > kReuseTurn_rad || speculative_m + change.moved_m > cache.reach_m;
  }
  if (search) {
    cache.searched = true;
    cache.reach_m = speculative_m + leeway;
    cache.pose = pose;
    if (one) {
      SearchOne(pair, pose, cache.reach_m, cache.convex, &cache.manifold);
      cache.apart_m = cache.manifold.count == 0 ? cache.convex.apart_m : 0;
      Anchor(pose, &cache.manifold);
    } else {
      SearchMany(pair, pose, cache.reach_m, cache);
    }
  }
  const auto on_b = [&pose, moved = Vec3f(pose.a_in_b - cache.pose.a_in_b)](const LocalPoint& point) {
    return pose.rotation * (point.on_b - moved);
  };
  if (one)
    WriteOne(outlet, cache.manifold, !search, on_b, manifolds);
  else
    WriteMany(outlet, *cache.parts, on_b, manifolds);
}

bool Remembers(const Geometry& a, const Geometry& b) { return InOrder(a, b) ? !Quick(a, b) : !Quick(b, a); }

}  // namespace tessera::physics

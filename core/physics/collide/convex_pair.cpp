#include "core/physics/collide/convex_pair.h"

#include <algorithm>
#include <cmath>

#include "core/physics/collide/gjk.h"
#include "core/physics/collide/penetration.h"

namespace tessera::physics {
namespace {

// A direction from GJK is worth something only where the cores are this far apart, m.
constexpr double kWorth_m = 1e-6;
// Tolerance of the cores' distance, m: the axis between cores that are centimetres apart is then right to a thousandth.
constexpr double kCloseEnough_m = 1e-6;
// Faces and edges within about 2 degrees (cosine, sine) count as lying across a normal.
constexpr float kAligned = 0.9994f, kAcross = 0.035f;
// The face of a is the reference unless b's lies straighter by this, so that equal ones do not change places.
constexpr float kStraighter = 1e-6f;
// Faces are this much wider than they are, as a share of their sides, so that nothing falls between two of them.
constexpr float kSlack = 1e-5f;
// Where a point was made: features of one family.
constexpr std::uint32_t kNearest = 0x4000, kOnSegment = 0x5000, kOnSide = 0x6000;

Gap GapOf(const Convex& a, const Convex& b, Vec3f normal, Vec3f middle) {
  return {normal, SeparationAlong(a, b, normal), middle, false};
}

void Try(const Convex& a, const Convex& b, Vec3f normal, Gap* best) {
  const float separation = SeparationAlong(a, b, normal);
  if (separation > best->separation_m) best->normal = normal, best->separation_m = separation;
}

// Overlapping, the way is a guess; a face near it, or far from it if `deep`, may be shorter.
void TryFaces(const Convex& a, const Convex& b, bool deep, Gap* gap) {
  Vec3f normal;
  const Vec3f guess = gap->normal;
  if (SurfaceNormal(a, guess, &normal)) Try(a, b, normal, gap);
  if (SurfaceNormal(b, -guess, &normal)) Try(a, b, -normal, gap);
  if (!deep) return;
  const Vec3f apart = Normalized(MiddleOf(b) - MiddleOf(a), guess);
  Try(a, b, apart, gap);
  if (SurfaceNormal(a, apart, &normal)) Try(a, b, normal, gap);
  if (SurfaceNormal(b, -apart, &normal)) Try(a, b, -normal, gap);
}

Vec3d Centres(const Convex& a, const Convex& b) { return Vec3d(MiddleOf(b)) - Vec3d(MiddleOf(a)); }

bool Deep(const Convex& a, const Convex& b, const Core& whole_a, const Core& whole_b, Gap* gap) {
  const Vec3d apart = Centres(a, b);
  const Vec3f fallback = Normalized(Vec3f(apart), {0, 1, 0});
  Vec3f normal, middle;
  if (DeepestWay(whole_a, whole_b, apart, &normal, &middle)) {
    *gap = GapOf(a, b, normal, middle);
  } else {
    *gap = GapOf(a, b, fallback, (MiddleOf(a) + MiddleOf(b)) * 0.5f);
  }
  TryFaces(a, b, true, gap);
  return true;
}

// How much farther apart than the shapes their cores can be.
double SlackOf(const Convex& convex, double inset) {
  if (convex.geometry == nullptr || inset <= 0) return 0;
  const Geometry& g = *convex.geometry;
  return inset * static_cast<double>(g.outer_radius_m + Length(g.middle)) / static_cast<double>(g.middle_radius_m);
}

// --- Manifolds across a way -----------------------------------------------------------------------------------------

LocalPoint PointAcross(Vec3f middle, Vec3f normal, double reach_a, double reach_b, std::uint32_t feature) {
  const auto along = static_cast<double>(Dot(normal, middle));
  return {middle + normal * static_cast<float>(reach_a - along), middle + normal * static_cast<float>(reach_b - along),
          static_cast<float>(reach_b - reach_a), feature};
}

void NearestOnly(const Convex& a, const Convex& b, const Gap& gap, LocalManifold* out) {
  out->normal = gap.normal;
  out->count = 1;
  out->points[0] = PointAcross(gap.middle, gap.normal, ReachOf(a, gap.normal), -ReachOf(b, -gap.normal), kNearest);
}

// The part of a polygon that looks along `out`, if the polygon leans: its farthest edge if that lies across, else its
// farthest corner.
void Narrow(Vec3f out, SupportFace* face) {
  if (face->count < 2) return;
  const auto at = [&](int i) { return face->vertices[static_cast<std::size_t>((i + face->count) % face->count)]; };
  const auto across = [&](Vec3f p, Vec3f q) { return std::abs(Dot(Normalized(q - p), out)); };
  if (face->count == 2) {
    if (across(at(0), at(1)) <= kAcross) return;
    face->vertices[0] = Dot(at(0), out) >= Dot(at(1), out) ? at(0) : at(1);
    face->count = 1;
    return;
  }
  int far = 0;
  for (int i = 1; i < face->count; ++i) {
    if (Dot(at(i), out) > Dot(at(far), out)) far = i;
  }
  const Vec3f before = at(far - 1), corner = at(far), after = at(far + 1);
  const bool forward = across(corner, after) <= across(before, corner);
  const float lean = forward ? across(corner, after) : across(before, corner);
  face->vertices[0] = corner;
  face->vertices[1] = forward ? after : before;
  face->count = lean <= kAcross ? 2 : 1;
}

// Two edges that run side by side: the ends of what they share.
bool CollideSegments(const SupportFace& a, const SupportFace& b, const Gap& gap, float speculative_m,
                     LocalManifold* out) {
  const Vec3f p = a.vertices[0], along = a.vertices[1] - p;
  const float length = Length(along);
  const Vec3f other = b.vertices[1] - b.vertices[0];
  if (!(length > 0) || !(LengthSquared(other) > 0)) return false;
  const Vec3f u = along / length;
  if (Length(Cross(u, Normalized(other))) > kAcross) return false;
  const float b0 = Dot(u, b.vertices[0] - p), b1 = Dot(u, b.vertices[1] - p);
  const float low = std::max(0.0f, std::min(b0, b1)), high = std::min(length, std::max(b0, b1));
  if (!(high > low) || b0 == b1) return false;
  std::array<LocalPoint, 2> ends;
  int count = 0;
  for (const float t : {low, high}) {
    const Vec3f on_a = p + u * t, on_b = b.vertices[0] + other * ((t - b0) / (b1 - b0));
    const float separation = Dot(gap.normal, on_b - on_a);
    if (separation > speculative_m) continue;
    const Vec3f middle = (on_a + on_b) * 0.5f;
    ends[static_cast<std::size_t>(count)] = {middle - gap.normal * (separation / 2),
                                             middle + gap.normal * (separation / 2), separation,
                                             kOnSegment + (t == low ? 0u : 1u)};
    ++count;
  }
  if (count == 0) return false;
  out->normal = gap.normal;
  Reduce({ends.data(), static_cast<std::size_t>(count)}, gap.normal, out);
  return out->count > 0;
}

// A segment over a face: its ends, cut to the prism over the face.
bool CollideSegmentFace(const FaceView& face, const SupportFace& segment, bool face_is_a, float speculative_m,
                        LocalManifold* out) {
  const Vec3f p = segment.vertices[0], along = segment.vertices[1] - p;
  float low = 0, high = 1;
  std::uint32_t low_id = 0, high_id = 1;
  for (std::size_t i = 0; i < face.loop.size(); ++i) {
    const Vec3f v = face.loop[i];
    const Vec3f side = Cross(face.loop[(i + 1) % face.loop.size()] - v, face.normal);  // outward
    const float start = Dot(side, p - v) - kSlack * LengthSquared(side), change = Dot(side, along);
    if (std::abs(change) <= 1e-12f) {
      if (start > 0) return false;
      continue;
    }
    const float t = -start / change;
    const std::uint32_t id = 2 + static_cast<std::uint32_t>(i);
    if (change > 0 && t < high) high = t, high_id = id;
    if (change < 0 && t > low) low = t, low_id = id;
  }
  if (low > high) return false;
  std::array<LocalPoint, 2> ends;
  int count = 0;
  for (const float t : {low, high}) {
    const Vec3f on_segment = p + along * t;
    const float separation = Dot(face.normal, on_segment - face.loop[0]);
    if (separation > speculative_m || (count == 1 && low == high)) continue;
    const Vec3f on_face = on_segment - face.normal * separation;
    const std::uint32_t feature = kOnSide + (count == 0 ? low_id : 0x100 + high_id);
    ends[static_cast<std::size_t>(count++)] = {face_is_a ? on_face : on_segment, face_is_a ? on_segment : on_face,
                                               separation, feature};
  }
  if (count == 0) return false;
  out->normal = face_is_a ? face.normal : -face.normal;
  Reduce({ends.data(), static_cast<std::size_t>(count)}, out->normal, out);
  return out->count > 0;
}

FaceView ViewOf(const SupportFace& face) { return {face.normal, face.loop(), face.id}; }

bool Collide(const SupportFace& a, const SupportFace& b, const Gap& gap, float speculative_m, LocalManifold* out) {
  const float flat_a = a.count > 2 ? Dot(a.normal, gap.normal) : 0;
  const float flat_b = b.count > 2 ? -Dot(b.normal, gap.normal) : 0;
  const bool by_a = flat_a >= kAligned && flat_a >= flat_b - kStraighter;
  if (by_a || flat_b >= kAligned) {
    const SupportFace &reference = by_a ? a : b, &incident = by_a ? b : a;
    if (incident.count > 2) {
      CollideFaces(ViewOf(reference), ViewOf(incident), by_a, speculative_m, out);
      return out->count > 0;
    }
    return incident.count == 2 && CollideSegmentFace(ViewOf(reference), incident, by_a, speculative_m, out);
  }
  SupportFace edge_a = a, edge_b = b;
  Narrow(gap.normal, &edge_a);
  Narrow(-gap.normal, &edge_b);
  return edge_a.count == 2 && edge_b.count == 2 && CollideSegments(edge_a, edge_b, gap, speculative_m, out);
}

}  // namespace

float SeparationAlong(const Convex& a, const Convex& b, Vec3f normal) {
  return static_cast<float>(-ReachOf(b, -normal) - ReachOf(a, normal));
}

bool FindGap(const Convex& a, const Convex& b, float speculative_m, Gap* gap) {
  const double inset_a = InsetOf(a), inset_b = InsetOf(b);
  const Core core_a(a, inset_a), core_b(b, inset_b), whole_a(a, 0), whole_b(b, 0);
  const double radii = whole_a.radius() + whole_b.radius();
  const double within = static_cast<double>(speculative_m) + radii;
  const double slack = SlackOf(a, inset_a) + SlackOf(b, inset_b) + kWorth_m;
  const auto far = [&](double distance_m) {
    gap->separation_m = static_cast<float>(distance_m);
    return false;
  };
  const GjkResult inner =
      Gjk(core_a, core_b, Centres(a, b), within + slack, inset_a + inset_b > 0 ? kCloseEnough_m : 0);
  if (inner.kind == GjkResult::Kind::kFar) return far(inner.distance_m - radii - slack);
  if (inner.kind == GjkResult::Kind::kOverlap || inner.distance_m <= kWorth_m) return Deep(a, b, whole_a, whole_b, gap);
  Vec3f middle = Vec3f((inner.on_a + inner.on_b) * 0.5);
  if (inner.distance_m > inset_a + inset_b) {
    const bool same = inset_a + inset_b <= 0;
    const GjkResult outer = same ? inner : Gjk(whole_a, whole_b, inner.axis, within);
    if (outer.kind == GjkResult::Kind::kFar) return far(outer.distance_m - radii);
    if (outer.kind == GjkResult::Kind::kApart && outer.distance_m > kWorth_m) {
      const Vec3d half = outer.axis * ((outer.distance_m + whole_a.radius() - whole_b.radius()) / 2);
      *gap = {Vec3f(outer.axis), static_cast<float>(outer.distance_m - radii), Vec3f(outer.on_a + half), true};
      return gap->separation_m <= speculative_m;
    }
    if (outer.kind == GjkResult::Kind::kApart) middle = Vec3f((outer.on_a + outer.on_b) * 0.5);
  }
  *gap = GapOf(a, b, Vec3f(inner.axis), middle);
  TryFaces(a, b, false, gap);
  return gap->separation_m <= speculative_m;
}

bool CollideOnFace(const FaceView& face, const SupportFace& shape, float speculative_m, LocalManifold* out) {
  if (shape.count == 2) return CollideSegmentFace(face, shape, false, speculative_m, out);
  const Vec3f p = shape.vertices[0];
  for (std::size_t i = 0; i < face.loop.size(); ++i) {
    const Vec3f v = face.loop[i];
    const Vec3f along = face.loop[(i + 1) % face.loop.size()] - v;
    if (Dot(Cross(along, face.normal), p - v) > kSlack * LengthSquared(along)) return false;
  }
  const float separation = Dot(face.normal, p - face.loop[0]);
  if (separation > speculative_m) return false;
  out->normal = -face.normal;
  out->count = 1;
  out->points[0] = {p, p - face.normal * separation, separation, kNearest + shape.id};
  return true;
}

void MakeManifold(const Convex& a, const Convex& b, const Gap& gap, float speculative_m, LocalManifold* out) {
  out->count = 0;
  if (Collide(SupportFaceOf(a, gap.normal), SupportFaceOf(b, -gap.normal), gap, speculative_m, out)) return;
  NearestOnly(a, b, gap, out);
}

void CollideConvexPair(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                       ConvexCache& cache, LocalManifold* out) {
  out->count = 0;
  cache = {};
  Gap gap;
  const Convex at_a = AtOrigin(a), at_b = Placed(b, b_in_a);
  if (FindGap(at_a, at_b, speculative_m, &gap)) {
    MakeManifold(at_a, at_b, gap, speculative_m, out);
  } else {
    cache.apart_m = std::max(gap.separation_m, 0.0f);
  }
}

void CollideRoundPlane(const Geometry& a, const LocalPlane& plane, float speculative_m, LocalManifold* out) {
  out->count = 0;
  const SupportFace face = SupportFaceOf(AtOrigin(a), -plane.normal);
  std::array<LocalPoint, kSupportVertices> points;
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(face.count); ++i) {
    const Vec3f p = face.vertices[i];
    const float separation = Dot(plane.normal, p) - plane.offset_m;
    if (separation > speculative_m) continue;
    points[count++] = {p, p - plane.normal * separation, separation, (face.id << 8) + i};
  }
  out->normal = -plane.normal;
  if (count > 0) Reduce({points.data(), count}, out->normal, out);
}

void NearestPoint(const Geometry& a, const Geometry& b, const LocalPose& b_in_a, float speculative_m,
                  LocalManifold* out) {
  out->count = 0;
  Gap gap;
  const Convex at_a = AtOrigin(a), at_b = Placed(b, b_in_a);
  if (FindGap(at_a, at_b, speculative_m, &gap)) NearestOnly(at_a, at_b, gap, out);
}

}  // namespace tessera::physics

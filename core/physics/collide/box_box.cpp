// Box against box: separating axes (Gottschalk, Lin, Manocha 1996), then the incident face cut to the reference face,
// or the two edges' nearest points.
#include <algorithm>
#include <cmath>

#include "core/physics/collide/primary_pairs.h"
#include "core/physics/tuning.h"

namespace tessera::physics {
namespace {

// An axis in ConvexCache::feature: 0 none, 1 to 3 a's faces, 4 to 6 b's, then the nine pairs of edges.
constexpr std::uint32_t kFaceA = 1, kFaceB = 4, kEdges = 7;

// One box as seen from another, as arrays: the search indexes axes.
struct Relation {
  float ha[3], hb[3];
  float p[3];      // b's centre in a
  float q[3];      // the same along b's axes
  float c[3][3];   // c[i][j] = dot(a's axis i, b's axis j)
  float ac[3][3];  // absolute
};

void Load(Vec3f v, float* out) { out[0] = v.x, out[1] = v.y, out[2] = v.z; }

Relation Relate(Vec3f half_a, Vec3f half_b, const LocalPose& pose) {
  Relation r;
  Load(half_a, r.ha);
  Load(half_b, r.hb);
  Load(pose.position, r.p);
  Load(Into(pose.rotation, pose.position), r.q);
  const Vec3f columns[3] = {pose.rotation.x, pose.rotation.y, pose.rotation.z};
  for (int j = 0; j < 3; ++j) {
    r.c[0][j] = columns[j].x, r.c[1][j] = columns[j].y, r.c[2][j] = columns[j].z;
    for (int i = 0; i < 3; ++i) r.ac[i][j] = std::abs(r.c[i][j]);
  }
  return r;
}

// The same two as b sees them.
Relation Swapped(const Relation& r) {
  Relation s;
  for (int i = 0; i < 3; ++i) {
    s.ha[i] = r.hb[i], s.hb[i] = r.ha[i];
    s.p[i] = -r.q[i], s.q[i] = -r.p[i];
    for (int j = 0; j < 3; ++j) s.c[i][j] = r.c[j][i], s.ac[i][j] = r.ac[j][i];
  }
  return s;
}

float FaceSeparationA(const Relation& r, int i) {
  return std::abs(r.p[i]) - (r.ha[i] + r.ac[i][0] * r.hb[0] + r.ac[i][1] * r.hb[1] + r.ac[i][2] * r.hb[2]);
}
float FaceSeparationB(const Relation& r, int j) {
  return std::abs(r.q[j]) - (r.hb[j] + r.ac[0][j] * r.ha[0] + r.ac[1][j] * r.ha[1] + r.ac[2][j] * r.ha[2]);
}

// Along cross(a's axis i, b's axis j). Edges that are nearly parallel add nothing to the axis of a face.
constexpr float kParallelEdges = 1e-4f;  // squared sine
constexpr float kNoAxis = -1e30f;
float EdgeSeparation(const Relation& r, int i, int j) {
  const float square = 1 - r.c[i][j] * r.c[i][j];
  if (square < kParallelEdges) return kNoAxis;
  const int i1 = kNext[i], i2 = kAfter[i], j1 = kNext[j], j2 = kAfter[j];
  const float distance = std::abs(r.p[i2] * r.c[i1][j] - r.p[i1] * r.c[i2][j]);
  const float reach = r.ha[i1] * r.ac[i2][j] + r.ha[i2] * r.ac[i1][j] + r.hb[j1] * r.ac[i][j2] + r.hb[j2] * r.ac[i][j1];
  return (distance - reach) / std::sqrt(square);
}

float SeparationAlong(const Relation& r, std::uint32_t axis) {
  if (axis < kFaceB) return FaceSeparationA(r, static_cast<int>(axis - kFaceA));
  if (axis < kEdges) return FaceSeparationB(r, static_cast<int>(axis - kFaceB));
  return EdgeSeparation(r, static_cast<int>(axis - kEdges) / 3, static_cast<int>(axis - kEdges) % 3);
}

struct BestAxes {
  std::uint32_t face = kFaceA, edge = 0;
  float face_separation = kNoAxis, edge_separation = kNoAxis;
  float faces[6];  // separation along a's, then b's
};

// The best face and the best pair of edges; stops at an axis that has them further apart than `speculative_m`.
// The face of the last search is kept as long as no other is better by more than `keep_m`.
bool Search(const Relation& r, float speculative_m, float keep_m, std::uint32_t last, BestAxes* best) {
  float best_score = kNoAxis;
  for (std::uint32_t axis = kFaceA; axis < kEdges; ++axis) {
    const float separation = SeparationAlong(r, axis);
    best->faces[axis - kFaceA] = separation;
    if (separation > speculative_m) {
      best->face = axis;
      best->face_separation = separation;
      return false;
    }
    // The last one counts for more, and a's faces for more than b's: rounding decides nothing.
    const float score = separation + (axis == last ? keep_m : 0) - (axis >= kFaceB ? keep_m / 2 : 0);
    if (score > best_score) best_score = score, best->face = axis, best->face_separation = separation;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const float separation = EdgeSeparation(r, i, j);
      if (separation <= best->edge_separation) continue;
      best->edge = kEdges + static_cast<std::uint32_t>(3 * i + j);
      best->edge_separation = separation;
      if (separation > speculative_m) return false;
    }
  return true;
}

// Whether the two meet only in a strip that is thinner than `thin_m` across an axis that lies athwart the normal: a rim
// by a rim. There the normal is a toss-up, and one along the floor would stop what slides from one box to the next one
// flush with it. Whatever they do next, one of the axes soon separates or holds them.
bool Grazes(const LocalPose& pose, const BestAxes& axes, Vec3f normal, float thin_m) {
  constexpr float kAthwart = 0.5f;
  const Vec3f in_b = Into(pose.rotation, normal);
  const float along[6] = {normal.x, normal.y, normal.z, in_b.x, in_b.y, in_b.z};
  for (int k = 0; k < 6; ++k)
    if (std::abs(axes.faces[k]) < thin_m && std::abs(along[k]) < kAthwart) return true;
  return false;
}

// --- Faces.

// A corner of the incident face as it is cut: place on the reference face, height above it, and the edges that meet
// there (0 to 3 of the incident face, 4 to 7 the sides of the reference face).
struct Corner {
  float u, v, height;
  std::uint8_t in, out;
};

// Cuts to  sign * coordinate <= half.
int Cut(const Corner* from, int count, float Corner::*coordinate, float sign, float half, std::uint8_t side,
        Corner* to) {
  // A corner that lies on the border but for rounding is no cut: it keeps its name.
  const float slack = kClipSlack * half;
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Corner &p = from[i], &q = from[i + 1 == count ? 0 : i + 1];
    const float dp = half - sign * p.*coordinate, dq = half - sign * q.*coordinate;
    const bool p_in = dp >= -slack, q_in = dq >= -slack;
    if (p_in) to[kept++] = p;
    if (p_in == q_in) continue;
    const float t = std::clamp(dp / (dp - dq), 0.0f, 1.0f);
    Corner cut{p.u + t * (q.u - p.u), p.v + t * (q.v - p.v), p.height + t * (q.height - p.height), p.out, side};
    if (q_in) cut.in = side, cut.out = p.out;
    to[kept++] = cut;
  }
  return kept;
}

// The incident face of b over the face of a along axis i; `r` as the owner of the reference face sees it. Points come
// in its frame: on_a on the reference face, on_b on the incident one.
int ClipFace(const Relation& r, int i, float speculative_m, LocalPoint* points) {
  const float sign = r.p[i] >= 0 ? 1.0f : -1.0f;
  const int i1 = kNext[i], i2 = kAfter[i];
  int j = 0;
  for (int k = 1; k < 3; ++k)
    if (r.ac[i][k] > r.ac[i][j]) j = k;
  const float side = sign * r.c[i][j] > 0 ? -1.0f : 1.0f;
  const int j1 = kNext[j], j2 = kAfter[j];

  // Centre and half edges of the incident face in (u, v, height).
  const auto place = [&](int k, float scale, float* to) {
    to[0] = r.c[i1][k] * scale, to[1] = r.c[i2][k] * scale, to[2] = sign * r.c[i][k] * scale;
  };
  float center[3], first[3], second[3];
  place(j, side * r.hb[j], center);
  place(j1, r.hb[j1], first);
  place(j2, r.hb[j2], second);
  center[0] += r.p[i1], center[1] += r.p[i2], center[2] += sign * r.p[i] - r.ha[i];

  Corner corners[2][8];
  constexpr float kSigns[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
  bool inside = true;
  for (std::uint8_t k = 0; k < 4; ++k) {
    const float s = kSigns[k][0], t = kSigns[k][1];
    Corner& corner = corners[0][k];
    corner = {center[0] + s * first[0] + t * second[0], center[1] + s * first[1] + t * second[1],
              center[2] + s * first[2] + t * second[2], static_cast<std::uint8_t>((k + 3) & 3), k};
    inside &= std::abs(corner.u) <= r.ha[i1] * (1 + kClipSlack) && std::abs(corner.v) <= r.ha[i2] * (1 + kClipSlack);
  }
  int count = 4;
  if (!inside) {
    count = Cut(corners[0], count, &Corner::u, 1, r.ha[i1], 4, corners[1]);
    count = Cut(corners[1], count, &Corner::v, 1, r.ha[i2], 5, corners[0]);
    count = Cut(corners[0], count, &Corner::u, -1, r.ha[i1], 6, corners[1]);
    count = Cut(corners[1], count, &Corner::v, -1, r.ha[i2], 7, corners[0]);
  }

  const std::uint32_t faces =
      static_cast<std::uint32_t>(2 * i + (sign > 0)) << 9 | static_cast<std::uint32_t>(2 * j + (side > 0)) << 6;
  int kept = 0;
  for (int k = 0; k < count; ++k) {
    const Corner& corner = corners[0][k];
    if (corner.height > speculative_m) continue;
    float at[3];
    at[i1] = corner.u, at[i2] = corner.v, at[i] = sign * r.ha[i];
    LocalPoint& point = points[kept++];
    point.on_a = {at[0], at[1], at[2]};
    at[i] = sign * (r.ha[i] + corner.height);
    point.on_b = {at[0], at[1], at[2]};
    point.separation_m = corner.height;
    point.feature = faces | static_cast<std::uint32_t>(corner.in) << 3 | corner.out;
  }
  return kept;
}

Vec3f Axis(int i, float length) {
  return i == 0 ? Vec3f{length, 0, 0} : i == 1 ? Vec3f{0, length, 0} : Vec3f{0, 0, length};
}

void CollideFace(const Relation& r, const LocalPose& pose, std::uint32_t face, float speculative_m,
                 LocalManifold* out) {
  LocalPoint points[8];
  int count;
  if (face < kFaceB) {
    const int i = static_cast<int>(face - kFaceA);
    count = ClipFace(r, i, speculative_m, points);
    out->normal = Axis(i, r.p[i] >= 0 ? 1.0f : -1.0f);
  } else {
    const int j = static_cast<int>(face - kFaceB);
    const Relation swapped = Swapped(r);
    count = ClipFace(swapped, j, speculative_m, points);
    out->normal = pose.rotation * Axis(j, swapped.p[j] >= 0 ? -1.0f : 1.0f);
    for (LocalPoint* point = points; point != points + count; ++point) {
      const Vec3f on_b = pose.position + pose.rotation * point->on_a;
      point->on_a = pose.position + pose.rotation * point->on_b;
      point->on_b = on_b;
      point->feature |= 1u << 12;
    }
  }
  Reduce({points, static_cast<std::size_t>(count)}, out->normal, out);
}

// --- Edges.

// False where the nearest points of the two lines lie off the edges.
bool CollideEdges(const Relation& r, const LocalPose& pose, std::uint32_t axis, LocalManifold* out) {
  const int i = static_cast<int>(axis - kEdges) / 3, j = static_cast<int>(axis - kEdges) % 3;
  const Vec3f columns[3] = {pose.rotation.x, pose.rotation.y, pose.rotation.z};
  const Vec3f along_a = Axis(i, 1), along_b = columns[j];
  Vec3f normal = Normalized(Cross(along_a, along_b));
  if (Dot(normal, pose.position) < 0) normal = -normal;
  float n[3], at[3];
  Load(normal, n);
  std::uint32_t feature = 1u << 13 | axis << 4;
  for (int k = 0; k < 3; ++k) {
    at[k] = k == i ? 0 : n[k] >= 0 ? r.ha[k] : -r.ha[k];
    if (k != i && n[k] >= 0) feature |= k == kNext[i] ? 1u : 2u;
  }
  const Vec3f edge_a{at[0], at[1], at[2]};
  Vec3f edge_b = pose.position;
  for (int k = 0; k < 3; ++k) {
    if (k == j) continue;
    const bool away = Dot(normal, columns[k]) >= 0;
    edge_b += columns[k] * (away ? -r.hb[k] : r.hb[k]);
    if (away) feature |= k == kNext[j] ? 4u : 8u;
  }
  // Nearest points of two lines, clamped to the edges.
  const Vec3f between = edge_b - edge_a;
  const float c = r.c[i][j], da = Dot(between, along_a), db = Dot(between, along_b), square = 1 - c * c;
  const float s = (da - c * db) / square, t = (c * da - db) / square;
  const float s_on = std::clamp(s, -r.ha[i], r.ha[i]), t_on = std::clamp(t, -r.hb[j], r.hb[j]);
  const bool on_edges = std::abs(s - s_on) <= kClipSlack * r.ha[i] && std::abs(t - t_on) <= kClipSlack * r.hb[j];
  const Vec3f at_a = edge_a + along_a * s_on, at_b = edge_b + along_b * t_on;
  const Vec3f middle = (at_a + at_b) * 0.5f;
  const float separation = Dot(at_b - at_a, normal);
  out->normal = normal;
  out->count = 1;
  out->points[0] = {.on_a = middle - normal * (0.5f * separation),
                    .on_b = middle + normal * (0.5f * separation),
                    .separation_m = separation,
                    .feature = feature};
  return on_edges;
}

// The points along an axis, or where that misses the place where they are nearest, there.
void AddContacts(const Geometry& a, const Geometry& b, const Relation& r, const LocalPose& pose, const BestAxes& best,
                 std::uint32_t axis, float lead, float speculative_m, LocalManifold* out) {
  const bool edge = axis >= kEdges;
  if (edge) {
    if (CollideEdges(r, pose, axis, out)) return;
  } else {
    CollideFace(r, pose, axis, speculative_m, out);
    if (Nearest(*out) <= best.face_separation + lead) return;
  }
  if (std::max(best.face_separation, best.edge_separation) > 0) {
    // A corner near a corner, or an edge past the end of an edge.
    NearestPoint(a, b, pose, speculative_m, out);
  } else if (!edge && best.edge_separation > best.face_separation - lead) {
    // They overlap, but not over the reference face: the edges have it, if by less than the lead.
    CollideEdges(r, pose, best.edge, out);
  }
}

}  // namespace

void CollideBoxes(const Geometry& a, const Geometry& b, const LocalPose& pose, float speculative_m, ConvexCache& cache,
                  LocalManifold* out) {
  out->count = 0;
  cache.apart_m = 0;
  const Relation r = Relate(a.half_extents_m, b.half_extents_m, pose);
  if (cache.feature != 0) {
    const float separation = SeparationAlong(r, cache.feature);
    if (separation > speculative_m) {
      cache.apart_m = separation;
      return;
    }
  }
  const float size = std::min({r.ha[0], r.ha[1], r.ha[2], r.hb[0], r.hb[1], r.hb[2]});
  BestAxes best;
  const bool near = Search(r, speculative_m, std::min(kKeepFace_m, kKeepFaceShare * size), cache.feature, &best);
  const float lead = std::min(kEdgeLead_m, kEdgeLeadShare * size);
  const bool edge = best.edge_separation > best.face_separation + lead;
  cache.feature = edge ? best.edge : best.face;
  if (!near) {
    cache.apart_m = std::max(best.face_separation, best.edge_separation);
    return;
  }
  AddContacts(a, b, r, pose, best, edge ? best.edge : best.face, lead, speculative_m, out);
  if (out->count == 0 && best.face_separation > 0) cache.apart_m = speculative_m;
  if (Grazes(pose, best, out->normal, std::min(kGraze_m, kGrazeShare * size))) out->count = 0;
}

}  // namespace tessera::physics

#include "core/world/scene_warnings.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

namespace tessera {
namespace {

// Points this near to a plane lie in it, m; three whose triangle is smaller lie on a line.
constexpr double kOnPlane_m = 1e-4, kFlat_m2 = 1e-9;

class Warnings {
 public:
  void Add(std::string text) {
    if (++count_ <= kMaxSceneWarnings) texts_.push_back(std::move(text));
  }
  std::vector<std::string> Take() {
    if (count_ > kMaxSceneWarnings) texts_.push_back(absl::StrCat("and ", count_ - kMaxSceneWarnings, " more"));
    return std::move(texts_);
  }

 private:
  std::vector<std::string> texts_;
  std::size_t count_ = 0;
};

std::string NameOf(const BodyDef& body) {
  const std::string id = absl::StrCat("body ", body.id.value());
  return body.name.empty() ? id : absl::StrCat(id, " \"", body.name, "\"");
}

const BodyDef* Find(const Scene& scene, BodyId id) {
  const auto found = std::ranges::lower_bound(scene.bodies, id, {}, &BodyDef::id);
  return found != scene.bodies.end() && found->id == id ? &*found : nullptr;
}

// --- Meshes and hulls.

// Every edge belongs to two triangles, once in each direction.
bool IsClosed(const TriangleMeshShape& mesh) {
  std::vector<std::uint64_t> there, back;
  there.reserve(3 * mesh.triangles.size());
  back.reserve(3 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint64_t from = triangle[corner], to = triangle[(corner + 1) % 3];
      there.push_back(from << 32 | to);
      back.push_back(to << 32 | from);
    }
  }
  std::ranges::sort(there);
  std::ranges::sort(back);
  return there == back && std::ranges::adjacent_find(there) == there.end();
}

bool FacesInward(const TriangleMeshShape& mesh) {
  double six_volumes = 0;
  const Vec3d origin(mesh.vertices.empty() ? Vec3f() : mesh.vertices.front());
  for (const auto& triangle : mesh.triangles) {
    const Vec3d a = Vec3d(mesh.vertices[triangle[0]]) - origin, b = Vec3d(mesh.vertices[triangle[1]]) - origin,
                c = Vec3d(mesh.vertices[triangle[2]]) - origin;
    six_volumes += Dot(a, Cross(b, c));
  }
  return six_volumes < 0 && IsClosed(mesh);
}

// How deep a point is inside the hull, m: its distance from the nearest of the planes through three of the points that
// all points are on one side of.
double DepthInHull(const std::vector<Vec3f>& points, Vec3d p) {
  double depth = std::numeric_limits<double>::infinity();
  const auto side = [&](std::size_t i, std::size_t j, std::size_t k) {
    const Vec3d at(points[i]);
    Vec3d normal = Cross(Vec3d(points[j]) - at, Vec3d(points[k]) - at);
    const double length = Length(normal);
    if (length < kFlat_m2) return;
    normal = normal / length;
    double above = 0, below = 0;
    for (const Vec3f& point : points) {
      const double height = Dot(normal, Vec3d(point) - at);
      above = std::max(above, height);
      below = std::min(below, height);
      if (above > kOnPlane_m && below < -kOnPlane_m) return;
    }
    const double height = Dot(normal, p - at);
    depth = std::min(depth, above > kOnPlane_m ? height : -height);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      for (std::size_t k = j + 1; k < points.size(); ++k) side(i, j, k);
    }
  }
  return depth;
}

// How often the mesh goes round the point: 1 inside a closed one that faces outward, 0 outside.
double TurnsRound(const TriangleMeshShape& mesh, Vec3d p) {
  double angles = 0;  // solid ones, halved: van Oosterom and Strackee, 1983
  for (const auto& triangle : mesh.triangles) {
    const Vec3d a = Vec3d(mesh.vertices[triangle[0]]) - p, b = Vec3d(mesh.vertices[triangle[1]]) - p,
                c = Vec3d(mesh.vertices[triangle[2]]) - p;
    const double la = Length(a), lb = Length(b), lc = Length(c);
    angles += std::atan2(Dot(a, Cross(b, c)), la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb);
  }
  return angles / (2 * std::numbers::pi);
}

bool InBounds(const TriangleMeshShape& mesh, Vec3d p) {
  Vec3d low(mesh.vertices.front()), high = low;
  for (const Vec3f& vertex : mesh.vertices) {
    const Vec3d at(vertex);
    low = {std::min(low.x, at.x), std::min(low.y, at.y), std::min(low.z, at.z)};
    high = {std::max(high.x, at.x), std::max(high.y, at.y), std::max(high.z, at.z)};
  }
  return p.x > low.x && p.y > low.y && p.z > low.z && p.x < high.x && p.y < high.y && p.z < high.z;
}

// Whether the point and all around it as far as kBuriedSpawn_m are inside a closed mesh; one that faces inward is a
// room.
bool IsDeepInMesh(const TriangleMeshShape& mesh, Vec3d p) {
  if (!InBounds(mesh, p) || !IsClosed(mesh)) return false;
  constexpr double kWay = kBuriedSpawn_m;
  for (const Vec3d& way : {Vec3d(), Vec3d{kWay, 0, 0}, Vec3d{-kWay, 0, 0}, Vec3d{0, kWay, 0}, Vec3d{0, -kWay, 0},
                           Vec3d{0, 0, kWay}, Vec3d{0, 0, -kWay}}) {
    if (TurnsRound(mesh, p + way) < 0.5) return false;
  }
  return true;
}

// --- Spawn points.

Vec3d Into(const Pose& pose, Vec3d point) { return Rotate(Conjugate(pose.orientation), point - pose.position); }

// How deep a point, in the shape's coordinates, is inside it, m; not above 0: it is outside, or the shape is an open
// mesh. Of a closed mesh it says no more than that it is deep enough.
struct Depth {
  Vec3d p;

  double operator()(const BoxShape& s) const {
    return std::min(
        {s.half_extents_m.x - std::abs(p.x), s.half_extents_m.y - std::abs(p.y), s.half_extents_m.z - std::abs(p.z)});
  }
  double operator()(const SphereShape& s) const { return s.radius_m - Length(p); }
  double operator()(const CapsuleShape& s) const {
    const double y = p.y - std::clamp(p.y, -s.half_height_m, s.half_height_m);
    return s.radius_m - std::hypot(p.x, y, p.z);
  }
  double operator()(const CylinderShape& s) const {
    return std::min(s.half_height_m - std::abs(p.y), s.radius_m - std::hypot(p.x, p.z));
  }
  double operator()(const ConeShape& s) const {
    const double below_apex = s.height_m / 2 - p.y;
    const double to_side =
        (s.radius_m * below_apex - s.height_m * std::hypot(p.x, p.z)) / std::hypot(s.radius_m, s.height_m);
    return std::min(p.y + s.height_m / 2, to_side);
  }
  double operator()(const CompoundShape& s) const {
    double most = 0;
    for (const CompoundChild& child : s.children)
      most = std::max(most, std::visit(Depth{Into(child.pose, p)}, child.shape->form));
    return most;
  }
  double operator()(const PlaneShape& s) const { return s.offset_m - Dot(s.normal, p); }
  double operator()(const HeightFieldShape& s) const {
    const double column = p.x / s.spacing_m + (s.columns - 1) / 2.0, row = p.z / s.spacing_m + (s.rows - 1) / 2.0;
    if (!(column >= 0 && row >= 0 && column <= s.columns - 1 && row <= s.rows - 1)) return 0;
    const auto i = std::min(static_cast<std::uint32_t>(column), s.columns - 2);
    const auto j = std::min(static_cast<std::uint32_t>(row), s.rows - 2);
    // Below all four corners of its cell, it is below each of the two triangles.
    const auto at = [&](std::uint32_t x, std::uint32_t z) {
      return static_cast<double>(s.heights_m[std::size_t{z} * s.columns + x]);
    };
    return std::min({at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)}) - p.y;
  }
  double operator()(const ConvexHullShape& s) const { return DepthInHull(s.points, p); }
  double operator()(const TriangleMeshShape& s) const { return IsDeepInMesh(s, p) ? kBuriedSpawn_m : 0; }
};

void WarnOfSpawnPoints(const Scene& scene, const PlayerRules& player, Warnings& warnings) {
  for (std::size_t i = 0; i < player.spawn_points.size(); ++i) {
    for (const BodyDef& body : scene.bodies) {
      const bool solid = body.motion == Motion::kStatic && body.path == nullptr && !body.trigger &&
                         body.layer.CollidesWith(player.body.layer);
      if (!solid) continue;
      const Pose pose{body.initial.position, body.initial.orientation};
      if (std::visit(Depth{Into(pose, player.spawn_points[i])}, body.shape->form) < kBuriedSpawn_m) continue;
      warnings.Add(absl::StrCat("player: spawn_points[", i, "] is inside static ", NameOf(body)));
      break;
    }
  }
}

// --- Joints.

// Where the frame of a joint is in the world at the start; nothing where that takes the shape's centre of mass.
std::optional<Pose> FrameIn(const BodyDef& body, const Pose& frame) {
  const auto& form = body.shape->form;
  const bool elsewhere = std::holds_alternative<ConeShape>(form) || std::holds_alternative<ConvexHullShape>(form) ||
                         std::holds_alternative<CompoundShape>(form);
  if (body.motion == Motion::kDynamic && elsewhere) return std::nullopt;
  const Quatd& q = body.initial.orientation;
  return Pose{body.initial.position + Rotate(q, frame.position), q * frame.orientation};
}

// How far the frames are apart where the joint lets them be nowhere but together, m; `way` goes from a's frame to b's,
// along a's axes.
struct Apart {
  Vec3d way;

  double operator()(const PointJoint&) const { return Length(way); }
  double operator()(const FixedJoint&) const { return Length(way); }
  double operator()(const HingeJoint&) const { return Length(way); }
  double operator()(const ConeTwistJoint&) const { return Length(way); }
  double operator()(const UniversalJoint&) const { return Length(way); }
  double operator()(const SliderJoint&) const { return std::hypot(way.y, way.z); }
  double operator()(const Hinge2Joint&) const { return std::hypot(way.x, way.y); }  // sprung along z
  double operator()(const SixDofJoint& joint) const {
    const double along[] = {way.x, way.y, way.z};
    double squares = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const SixDofAxis& has = joint.axes[axis];
      if (has.limit.free() || has.spring.stiffness > 0) continue;
      const double beyond = along[axis] - std::clamp(along[axis], has.limit.lower, has.limit.upper);
      squares += beyond * beyond;
    }
    return std::sqrt(squares);
  }
  double operator()(const GearJoint&) const { return 0; }
};

void WarnOfJoints(const Scene& scene, Warnings& warnings) {
  for (const JointDef& joint : scene.joints) {
    const BodyDef* a = Find(scene, joint.body_a);
    const BodyDef* b = Find(scene, joint.body_b);
    if (a == nullptr || (b == nullptr && joint.body_b != BodyId())) continue;
    const std::optional<Pose> at_a = FrameIn(*a, joint.frame_a);
    const std::optional<Pose> at_b = b == nullptr ? joint.frame_b : FrameIn(*b, joint.frame_b);
    if (!at_a || !at_b) continue;
    // In a joint to the world, the world takes the part of body_a.
    const Pose& from = b == nullptr ? *at_b : *at_a;
    const Pose& to = b == nullptr ? *at_a : *at_b;
    const double apart_m = std::visit(Apart{Into(from, to.position)}, joint.kind);
    if (apart_m <= kTornJoint_m) continue;
    warnings.Add(absl::StrCat("joints (id ", joint.id.value(), "): the frames are ", std::round(apart_m * 1000) / 1000,
                              " m apart at the start; the joint pulls them together"));
  }
}

// --- Bodies.

void WarnOfBodies(const Scene& scene, Warnings& warnings) {
  std::vector<BodyId> held;
  for (const JointDef& joint : scene.joints) held.insert(held.end(), {joint.body_a, joint.body_b});
  std::ranges::sort(held);
  for (const BodyDef& body : scene.bodies) {
    const bool falls = body.motion == Motion::kDynamic && !body.kinematic && body.trigger && body.gravity_scale != 0 &&
                       scene.gravity_m_s2 != Vec3d() && !std::ranges::binary_search(held, body.id);
    if (falls) warnings.Add(absl::StrCat(NameOf(body), ": is dynamic and a trigger: it falls through everything"));
    const auto* mesh = std::get_if<TriangleMeshShape>(&body.shape->form);
    if (mesh == nullptr || !FacesInward(*mesh)) continue;
    warnings.Add(absl::StrCat(NameOf(body),
                              ": the mesh is closed and its triangles face inward: bodies fall in and are "
                              "held there"));
  }
}

}  // namespace

std::vector<std::string> SceneWarnings(const Scene& scene) {
  Warnings warnings;
  if (scene.player) {
    if (scene.player->max_force_n == 0 && !scene.player->character) {
      warnings.Add("player: max_force is 0 and there is no character, so inputs move nobody");
    }
    WarnOfSpawnPoints(scene, *scene.player, warnings);
  }
  WarnOfJoints(scene, warnings);
  WarnOfBodies(scene, warnings);
  return warnings.Take();
}

}  // namespace tessera

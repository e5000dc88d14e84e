#include "core/world/level_tiles.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/world/level_bounds.h"
#include "core/world/limits.h"

namespace tessera {
namespace {

// A mesh of no more triangles is never cut.
constexpr std::size_t kWholeTriangles = 128;
// A surface that more bodies have is not cut, for each would have its own.
constexpr std::size_t kMostSharers = 2;
// Bytes of the packed form, about: a triangle with its share of vertices and its number, a sample, a body.
constexpr std::size_t kTriangle_bytes = 24, kSample_bytes = 4, kBody_bytes = 64, kPoint_bytes = 12;

Pose StandsAt(const BodyDef& body) { return {body.initial.position, body.initial.orientation}; }

const TriangleMeshShape* MeshOf(const BodyDef& body) { return std::get_if<TriangleMeshShape>(&body.shape->form); }
const HeightFieldShape* FieldOf(const BodyDef& body) { return std::get_if<HeightFieldShape>(&body.shape->form); }

Aabb TriangleBounds(const TriangleMeshShape& mesh, std::size_t triangle, const Pose& pose) {
  GrowingBounds bounds;
  for (const std::uint32_t corner : mesh.triangles[triangle]) bounds.Add(PlacedAt(pose, Vec3d(mesh.vertices[corner])));
  return bounds.Get();
}

TileSquare SquareAt(Vec3d place, double edge_m) {
  const auto along = [&](double coordinate) { return static_cast<std::int32_t>(std::floor(coordinate / edge_m)); };
  return {along(place.z), along(place.x)};
}
TileSquare SquareOf(const Aabb& bounds, double edge_m) { return SquareAt((bounds.min + bounds.max) * 0.5, edge_m); }

// The bodies of a scene that may be in tiles, and how many have each shape.
struct Candidates {
  explicit Candidates(const Scene& scene) {
    std::unordered_set<BodyId> jointed;
    for (const JointDef& joint : scene.joints) jointed.insert({joint.body_a, joint.body_b});
    for (const BodyDef& body : scene.bodies) {
      const bool stands = body.motion == Motion::kStatic && body.path == nullptr && !body.trigger;
      if (!stands || std::holds_alternative<PlaneShape>(body.shape->form) || jointed.contains(body.id)) continue;
      bodies.push_back(&body);
      ++sharers[body.shape.get()];
    }
  }
  bool MayCut(const BodyDef& body) const {
    if (!body.shape->visuals.empty() || sharers.at(body.shape.get()) > kMostSharers) return false;
    const TriangleMeshShape* mesh = MeshOf(body);
    return mesh != nullptr ? mesh->triangles.size() > kWholeTriangles : FieldOf(body) != nullptr;
  }

  std::vector<const BodyDef*> bodies;
  std::unordered_map<const Shape*, std::size_t> sharers;
};

struct HashOfSquare {
  std::size_t operator()(const TileSquare& square) const {
    return std::hash<std::uint64_t>()(static_cast<std::uint64_t>(static_cast<std::uint32_t>(square.row)) << 32 |
                                      static_cast<std::uint32_t>(square.column));
  }
};

// How many bytes lie on each of the smallest squares, about.
static_assert(kTiledFrom_bytes >= 4 * kMeanTile_bytes);
class Weights {
 public:
  explicit Weights(const Candidates& candidates) {
    std::unordered_set<const Shape*> weighed;
    for (const BodyDef* body : candidates.bodies) {
      const Pose pose = StandsAt(*body);
      if (candidates.MayCut(*body)) {
        AddSurface(*body, pose);
        continue;
      }
      const std::size_t shape = weighed.insert(body->shape.get()).second ? BytesOf(*body->shape) : 0;
      Add(pose.position, kBody_bytes + shape);
    }
  }
  std::size_t total() const { return total_; }
  // The edge with which tiles are as large as they should be; 0: all would be on one square. Requires kTiledFrom_bytes:
  // four squares that meet in one point, which never become one, are enough then.
  double Edge() {
    double edge = kLeastTileEdge_m;
    while (squares_.size() > kMaxTiles || (squares_.size() > 1 && total_ / squares_.size() < kMeanTile_bytes)) {
      std::unordered_map<TileSquare, std::size_t, HashOfSquare> twice;
      for (const auto& [square, bytes] : squares_) twice[{square.row >> 1, square.column >> 1}] += bytes;
      squares_ = std::move(twice);
      edge *= 2;
    }
    return squares_.size() > 1 ? edge : 0;
  }

 private:
  void Add(Vec3d place, std::size_t bytes) {
    squares_[SquareAt(place, kLeastTileEdge_m)] += bytes;
    total_ += bytes;
  }
  static std::size_t BytesOf(const Shape& shape) {
    if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape.form)) return kTriangle_bytes * mesh->triangles.size();
    if (const auto* field = std::get_if<HeightFieldShape>(&shape.form)) return kSample_bytes * field->heights_m.size();
    if (const auto* hull = std::get_if<ConvexHullShape>(&shape.form)) return kPoint_bytes * hull->points.size();
    return 0;
  }
  void AddSurface(const BodyDef& body, const Pose& pose) {
    if (const TriangleMeshShape* mesh = MeshOf(body)) {
      for (const auto& triangle : mesh->triangles) {
        Add(PlacedAt(pose, Vec3d(mesh->vertices[triangle[0]])), kTriangle_bytes);
      }
      return;
    }
    const HeightFieldShape& field = *FieldOf(body);
    for (std::uint32_t row = 0; row < field.rows; ++row) {
      for (std::uint32_t column = 0; column < field.columns; ++column) {
        Add(PlacedAt(pose, SampleAt(field, column, row)), kSample_bytes);
      }
    }
  }

  std::unordered_map<TileSquare, std::size_t, HashOfSquare> squares_;
  std::size_t total_ = 0;
};

// The part of a mesh that these triangles are, which ascend.
TilePart PartOf(const BodyDef& body, const TriangleMeshShape& mesh, std::vector<std::uint32_t> triangles) {
  MeshCut cut;
  for (const std::uint32_t triangle : triangles) {
    cut.vertices.insert(cut.vertices.end(), mesh.triangles[triangle].begin(), mesh.triangles[triangle].end());
  }
  std::ranges::sort(cut.vertices);
  cut.vertices.erase(std::unique(cut.vertices.begin(), cut.vertices.end()), cut.vertices.end());
  TriangleMeshShape part;
  part.vertices.reserve(cut.vertices.size());
  for (const std::uint32_t vertex : cut.vertices) part.vertices.push_back(mesh.vertices[vertex]);
  part.triangles.reserve(triangles.size());
  for (const std::uint32_t triangle : triangles) {
    auto& corners = part.triangles.emplace_back();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto at = std::ranges::lower_bound(cut.vertices, mesh.triangles[triangle][i]);
      corners[i] = static_cast<std::uint32_t>(at - cut.vertices.begin());
    }
  }
  cut.triangles = std::move(triangles);
  TilePart made{.body = body, .mesh = std::make_shared<const MeshCut>(std::move(cut))};
  made.body.shape = std::make_shared<const Shape>(Shape{std::move(part)});
  return made;
}

TilePart PartOf(const BodyDef& body, const HeightFieldShape& field, const FieldCut& cut, std::uint32_t columns,
                std::uint32_t rows) {
  HeightFieldShape part{.columns = columns, .rows = rows, .spacing_m = field.spacing_m, .heights_m = {}};
  part.heights_m.reserve(std::size_t{columns} * rows);
  for (std::uint32_t row = cut.first_row; row < cut.first_row + rows; ++row) {
    const auto from = field.heights_m.begin() + std::ptrdiff_t{row} * field.columns + cut.first_column;
    part.heights_m.insert(part.heights_m.end(), from, from + columns);
  }
  TilePart made{.body = body, .mesh = nullptr, .field = cut};
  made.body.shape = std::make_shared<const Shape>(Shape{std::move(part)});
  return made;
}

class Cutter {
 public:
  explicit Cutter(double edge_m) { cut_.edge_m = edge_m; }

  void CutMesh(const BodyDef& body, const TriangleMeshShape& mesh) {
    const Pose pose = StandsAt(body);
    std::map<TileSquare, std::vector<std::uint32_t>> by_square;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      by_square[SquareOf(TriangleBounds(mesh, i, pose), cut_.edge_m)].push_back(static_cast<std::uint32_t>(i));
    }
    for (auto& [square, triangles] : by_square) {
      cut_.tiles[square].parts.push_back(PartOf(body, mesh, std::move(triangles)));
    }
    cut_.in_tiles.push_back(body.id);
  }
  // By blocks of about a square, in the field's own rows and columns, however it is turned.
  void CutField(const BodyDef& body, const HeightFieldShape& field) {
    const double across = cut_.edge_m / field.spacing_m;
    const auto block =
        static_cast<std::uint32_t>(std::clamp(std::floor(across), 1.0, static_cast<double>(kMaxHeightSamples)));
    for (std::uint32_t row = 0; row + 1 < field.rows; row += std::min(block, field.rows - 1 - row)) {
      const std::uint32_t rows = std::min(block, field.rows - 1 - row) + 1;
      for (std::uint32_t column = 0; column + 1 < field.columns;
           column += std::min(block, field.columns - 1 - column)) {
        const std::uint32_t columns = std::min(block, field.columns - 1 - column) + 1;
        const FieldCut cut{field.columns, field.rows, column, row};
        TilePart part = PartOf(body, field, cut, columns, rows);
        const Aabb bounds = tessera::BoundsOf(*part.body.shape, tessera::PoseOf(part));
        cut_.tiles[SquareOf(bounds, cut_.edge_m)].parts.push_back(std::move(part));
      }
    }
    cut_.in_tiles.push_back(body.id);
  }
  void Put(const BodyDef& body, const Aabb& bounds) {
    cut_.tiles[SquareOf(bounds, cut_.edge_m)].parts.push_back({.body = body, .mesh = nullptr});
    cut_.in_tiles.push_back(body.id);
  }
  LevelCut Take() { return std::move(cut_); }

 private:
  LevelCut cut_;
};

}  // namespace

Pose PoseOf(const TilePart& part) {
  Pose pose = StandsAt(part.body);
  if (!part.field) return pose;
  const auto& shape = std::get<HeightFieldShape>(part.body.shape->form);
  const auto offset = [&](std::uint32_t first, std::uint32_t samples, std::uint32_t of) {
    return (2.0 * first + samples - of) / 2 * shape.spacing_m;
  };
  pose.position += Rotate(pose.orientation, Vec3d{offset(part.field->first_column, shape.columns, part.field->columns),
                                                  0, offset(part.field->first_row, shape.rows, part.field->rows)});
  return pose;
}

Aabb BoundsOf(const Tile& tile) {
  // Physics rounds a surface's coordinates to floats.
  constexpr double kRounding_m = 1e-2;
  GrowingBounds bounds;
  for (const TilePart& part : tile.parts) bounds.Add(BoundsOf(*part.body.shape, PoseOf(part)));
  return bounds.Get().Expanded(kRounding_m);
}

std::optional<LevelCut> CutLevel(const Scene& scene) {
  const Candidates candidates(scene);
  double edge_m = 0;
  {
    Weights weights(candidates);
    if (weights.total() < kTiledFrom_bytes) return std::nullopt;
    edge_m = weights.Edge();
  }
  if (edge_m == 0) return std::nullopt;
  Cutter cutter(edge_m);
  for (const BodyDef* body : candidates.bodies) {
    const Aabb bounds = BoundsOf(*body->shape, StandsAt(*body));
    const bool fits = bounds.max.x - bounds.min.x <= edge_m && bounds.max.z - bounds.min.z <= edge_m;
    if (fits) {
      cutter.Put(*body, bounds);
    } else if (!candidates.MayCut(*body)) {
      continue;  // it stays with those that everybody has
    } else if (const TriangleMeshShape* mesh = MeshOf(*body)) {
      cutter.CutMesh(*body, *mesh);
    } else {
      cutter.CutField(*body, *FieldOf(*body));
    }
  }
  LevelCut cut = cutter.Take();
  if (cut.tiles.size() < 2 || cut.tiles.size() > kMaxTiles) return std::nullopt;
  return cut;
}

}  // namespace tessera

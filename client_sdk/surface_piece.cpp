#include "client_sdk/surface_piece.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace tessera::client {
namespace {

// By so much a piece that has too many triangles shrinks at a time.
constexpr double kShrink = 0.75;

Aabb PieceBoundsOf(const TriangleMeshShape& mesh, std::size_t triangle) {
  const auto& corners = mesh.triangles[triangle];
  const Vec3d first(mesh.vertices[corners[0]]);
  Aabb bounds{first, first};
  for (std::size_t i = 1; i < 3; ++i) {
    const Vec3d corner(mesh.vertices[corners[i]]);
    bounds = bounds.United({corner, corner});
  }
  return bounds;
}

}  // namespace

bool MeshBlocks::Survey(WorkBudget& budget) {
  const std::size_t triangles = mesh_->triangles.size();
  for (std::size_t at = blocks_.size() * kTriangles; at < triangles; at = blocks_.size() * kTriangles) {
    if (!budget.left()) return false;
    const std::size_t end = std::min(at + kTriangles, triangles);
    Aabb bounds = PieceBoundsOf(*mesh_, at);
    for (std::size_t i = at + 1; i < end; ++i) bounds = bounds.United(PieceBoundsOf(*mesh_, i));
    blocks_.push_back(bounds);
    budget.Spend(static_cast<std::int64_t>(end - at));
  }
  return true;
}

MeshPiece::MeshPiece(const TriangleMeshShape& mesh, const MeshBlocks& blocks, const Reach& where)
    : mesh_(mesh), blocks_(blocks), where_(where) {}

Aabb MeshPiece::Box() const { return Aabb{where_.centre, where_.centre}.Expanded(where_.reach_m); }

bool MeshPiece::Meets(std::uint32_t triangle, const Aabb& box) const {
  return PieceBoundsOf(mesh_, triangle).Overlaps(box);
}

bool MeshPiece::Search(WorkBudget& budget) {
  const Aabb box = Box();
  for (; !narrows_ && next_block_ < blocks_.blocks().size(); ++next_block_) {
    if (!budget.left()) return false;
    budget.Spend(1);
    if (!blocks_.blocks()[next_block_].Overlaps(box)) continue;
    const std::size_t begin = next_block_ * MeshBlocks::kTriangles;
    const std::size_t end = std::min(begin + MeshBlocks::kTriangles, mesh_.triangles.size());
    for (std::size_t i = begin; i < end; ++i) {
      if (Meets(static_cast<std::uint32_t>(i), box)) found_.push_back(static_cast<std::uint32_t>(i));
    }
    budget.Spend(static_cast<std::int64_t>(end - begin));
  }
  while (narrows_ || (found_.size() > kMostPieceTriangles && where_.reach_m > where_.least_m)) {
    if (!Narrow(budget)) return false;
  }
  return true;
}

// Leaves out those found that a smaller cube does not meet.
bool MeshPiece::Narrow(WorkBudget& budget) {
  if (!narrows_) {
    where_.reach_m = std::max(where_.least_m, kShrink * where_.reach_m);
    narrows_ = true;
    next_found_ = kept_ = 0;
  }
  const Aabb box = Box();
  for (; next_found_ < found_.size(); ++next_found_) {
    if (!budget.left()) return false;
    budget.Spend(1);
    if (Meets(found_[next_found_], box)) found_[kept_++] = found_[next_found_];
  }
  found_.resize(kept_);
  narrows_ = false;
  return true;
}

ShapePtr MeshPiece::Make(WorkBudget& budget) const {
  if (found_.empty()) return nullptr;
  TriangleMeshShape piece;
  std::vector<std::uint32_t> used;
  used.reserve(3 * found_.size());
  for (const std::uint32_t i : found_) used.insert(used.end(), mesh_.triangles[i].begin(), mesh_.triangles[i].end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  for (const std::uint32_t vertex : used) piece.vertices.push_back(mesh_.vertices[vertex]);
  for (const std::uint32_t i : found_) {
    auto& triangle = piece.triangles.emplace_back();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto at = std::lower_bound(used.begin(), used.end(), mesh_.triangles[i][corner]);
      triangle[corner] = static_cast<std::uint32_t>(at - used.begin());
    }
  }
  budget.Spend(static_cast<std::int64_t>(found_.size()) * kUnitsToBuildATriangle / 4);
  return std::make_shared<const Shape>(Shape{std::move(piece)});
}

FieldPiece PieceOf(const HeightFieldShape& field, const Reach& where, WorkBudget& budget) {
  struct Run {
    std::int64_t first, last;  // samples
    std::int64_t cells() const { return last - first; }
  };
  const auto run_of = [&](double centre, std::uint32_t samples, double reach) {
    const double middle = (samples - 1) / 2.0, most = samples - 1.0;
    const double low = std::floor((centre - reach) / field.spacing_m + middle);
    const double high = std::ceil((centre + reach) / field.spacing_m + middle);
    if (high < 0 || low > most) return Run{0, 0};
    return Run{static_cast<std::int64_t>(std::clamp(low, 0.0, most)),
               static_cast<std::int64_t>(std::clamp(high, 0.0, most))};
  };
  double reach = where.reach_m;
  Run across = run_of(where.centre.x, field.columns, reach), along = run_of(where.centre.z, field.rows, reach);
  while (reach > where.least_m && 2 * across.cells() * along.cells() > static_cast<std::int64_t>(kMostPieceTriangles)) {
    reach = std::max(where.least_m, kShrink * reach);
    across = run_of(where.centre.x, field.columns, reach);
    along = run_of(where.centre.z, field.rows, reach);
  }
  if (across.cells() == 0 || along.cells() == 0) return {};
  HeightFieldShape piece;
  piece.columns = static_cast<std::uint32_t>(across.cells() + 1);
  piece.rows = static_cast<std::uint32_t>(along.cells() + 1);
  piece.spacing_m = field.spacing_m;
  piece.heights_m.reserve(std::size_t{piece.columns} * piece.rows);
  for (std::int64_t row = along.first; row <= along.last; ++row) {
    const auto from = field.heights_m.begin() + (row * field.columns + across.first);
    piece.heights_m.insert(piece.heights_m.end(), from, from + piece.columns);
  }
  budget.Spend(std::int64_t{2} * across.cells() * along.cells() * kUnitsToBuildATriangle / 10);
  const auto offset = [&](const Run& run, std::uint32_t samples) {
    return (static_cast<double>(run.first + run.last) - (samples - 1.0)) / 2 * field.spacing_m;
  };
  const Vec3d middle{offset(across, field.columns), 0, offset(along, field.rows)};
  return {std::make_shared<const Shape>(Shape{std::move(piece)}), middle, reach};
}

}  // namespace tessera::client

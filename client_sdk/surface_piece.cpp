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
    budget.Spend(static_cast<std::int64_t>(end - at) * 3 / 4);
  }
  return true;
}

Aabb MeshPiece::Box() const { return Aabb{where_.centre, where_.centre}.Expanded(where_.reach_m); }

bool MeshPiece::Meets(Found found, const Aabb& box) const {
  return PieceBoundsOf(*parts_[found.part].mesh, found.triangle).Overlaps(box);
}

bool MeshPiece::SearchPart(const MeshSource& part, const Aabb& box, WorkBudget& budget) {
  const std::vector<Aabb>& blocks = part.blocks->blocks();
  for (; next_block_ < blocks.size(); ++next_block_) {
    if (!budget.left()) return false;
    budget.Spend(1);
    if (!blocks[next_block_].Overlaps(box)) continue;
    const std::size_t begin = next_block_ * MeshBlocks::kTriangles;
    const std::size_t end = std::min(begin + MeshBlocks::kTriangles, part.mesh->triangles.size());
    for (std::size_t i = begin; i < end; ++i) {
      const Found found{static_cast<std::uint32_t>(next_part_), static_cast<std::uint32_t>(i)};
      if (Meets(found, box)) found_.push_back(found);
    }
    budget.Spend(static_cast<std::int64_t>(end - begin));
  }
  next_block_ = 0;
  return true;
}

bool MeshPiece::Search(WorkBudget& budget) {
  const Aabb box = Box();
  for (; !narrows_ && next_part_ < parts_.size(); ++next_part_) {
    if (!SearchPart(parts_[next_part_], box, budget)) return false;
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
  const auto vertex_of = [&](const Found& found, std::size_t corner) {
    const MeshSource& part = parts_[found.part];
    const std::uint32_t here = part.mesh->triangles[found.triangle][corner];
    return part.cut != nullptr ? part.cut->vertices[here] : here;
  };
  const auto number_of = [&](const Found& found) {
    const MeshCut* cut = parts_[found.part].cut;
    return cut != nullptr ? cut->triangles[found.triangle] : found.triangle;
  };
  std::vector<Found> found = found_;
  std::ranges::sort(found, {}, number_of);
  // Each vertex once, by its number in the whole mesh.
  std::vector<std::pair<std::uint32_t, Vec3f>> used;
  used.reserve(3 * found.size());
  for (const Found& one : found) {
    const TriangleMeshShape& mesh = *parts_[one.part].mesh;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      used.emplace_back(vertex_of(one, corner), mesh.vertices[mesh.triangles[one.triangle][corner]]);
    }
  }
  const auto number = [](const auto& vertex) { return vertex.first; };
  std::ranges::stable_sort(used, {}, number);
  const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
  used.erase(std::unique(used.begin(), used.end(), same), used.end());
  TriangleMeshShape piece;
  for (const auto& [at, place] : used) piece.vertices.push_back(place);
  for (const Found& one : found) {
    auto& triangle = piece.triangles.emplace_back();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto at = std::ranges::lower_bound(used, vertex_of(one, corner), {}, number);
      triangle[corner] = static_cast<std::uint32_t>(at - used.begin());
    }
  }
  budget.Spend(static_cast<std::int64_t>(found_.size()) * kUnitsToBuildATriangle / 4);
  return std::make_shared<const Shape>(Shape{std::move(piece)});
}

namespace {

// Samples of a height field from one to another, both among them.
struct Run {
  std::int64_t first, last;
  std::int64_t cells() const { return last - first; }
};

// The place of a part among the samples of the whole; a part that is the whole begins with the first one.
FieldCut CutOf(const FieldSource& part) {
  return part.cut != nullptr ? *part.cut : FieldCut{part.field->columns, part.field->rows, 0, 0};
}

// Copies those of a part's samples that are among the piece's, whose first ones are at `across` and `along`.
void CopyPart(const FieldSource& part, const Run& across, const Run& along, HeightFieldShape& piece) {
  const FieldCut cut = CutOf(part);
  const std::int64_t left = std::max<std::int64_t>(across.first, cut.first_column);
  const std::int64_t right =
      std::min<std::int64_t>(across.last, std::int64_t{cut.first_column} + part.field->columns - 1);
  const std::int64_t top = std::max<std::int64_t>(along.first, cut.first_row);
  const std::int64_t bottom = std::min<std::int64_t>(along.last, std::int64_t{cut.first_row} + part.field->rows - 1);
  if (left > right) return;
  for (std::int64_t row = top; row <= bottom; ++row) {
    const auto from = part.field->heights_m.begin() +
                      ((row - cut.first_row) * std::int64_t{part.field->columns} + (left - cut.first_column));
    std::copy(from, from + (right - left + 1),
              piece.heights_m.begin() + ((row - along.first) * std::int64_t{piece.columns} + (left - across.first)));
  }
}

}  // namespace

FieldPiece PieceOf(const std::vector<FieldSource>& parts, const Reach& where, WorkBudget& budget) {
  const FieldCut whole = CutOf(parts.front());
  const double spacing_m = parts.front().field->spacing_m;
  const auto run_of = [&](double centre, std::uint32_t samples, double reach) {
    const double middle = (samples - 1) / 2.0, most = samples - 1.0;
    const double low = std::floor((centre - reach) / spacing_m + middle);
    const double high = std::ceil((centre + reach) / spacing_m + middle);
    if (high < 0 || low > most) return Run{0, 0};
    return Run{static_cast<std::int64_t>(std::clamp(low, 0.0, most)),
               static_cast<std::int64_t>(std::clamp(high, 0.0, most))};
  };
  double reach = where.reach_m;
  Run across = run_of(where.centre.x, whole.columns, reach), along = run_of(where.centre.z, whole.rows, reach);
  while (reach > where.least_m && 2 * across.cells() * along.cells() > static_cast<std::int64_t>(kMostPieceTriangles)) {
    reach = std::max(where.least_m, kShrink * reach);
    across = run_of(where.centre.x, whole.columns, reach);
    along = run_of(where.centre.z, whole.rows, reach);
  }
  if (across.cells() == 0 || along.cells() == 0) return {};
  HeightFieldShape piece;
  piece.columns = static_cast<std::uint32_t>(across.cells() + 1);
  piece.rows = static_cast<std::uint32_t>(along.cells() + 1);
  piece.spacing_m = spacing_m;
  piece.heights_m.resize(std::size_t{piece.columns} * piece.rows);
  for (const FieldSource& part : parts) {
    const FieldCut cut = CutOf(part);
    const bool fits = cut.columns == whole.columns && cut.rows == whole.rows && part.field->spacing_m == spacing_m;
    if (fits) CopyPart(part, across, along, piece);
  }
  budget.Spend(std::int64_t{2} * across.cells() * along.cells() * kUnitsToBuildATriangle / 10);
  const auto offset = [&](const Run& run, std::uint32_t samples) {
    return (static_cast<double>(run.first + run.last) - (samples - 1.0)) / 2 * spacing_m;
  };
  const Vec3d middle{offset(across, whole.columns), 0, offset(along, whole.rows)};
  return {std::make_shared<const Shape>(Shape{std::move(piece)}), middle, reach};
}

}  // namespace tessera::client

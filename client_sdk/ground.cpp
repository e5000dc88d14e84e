#include "client_sdk/ground.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client_sdk/shape_radius.h"

namespace tessera::client {
namespace {

// Bodies are filed by cells of this size; larger ones are looked at one by one.
constexpr double kCell_m = 16;
// A mesh of no more triangles is built whole.
constexpr std::size_t kWholeTriangles = 128;
// An area reaches so far beyond what is asked for, so that it serves for a while.
constexpr double kLeastArea_m = 8, kAreaOfReach = 2, kAreaBeyond_m = 2;
// And where a surface is so fine that this would be too many triangles, at least so far.
constexpr double kLeastBeyond_m = 1;
// Units for looking at a body, and for putting one into the world.
constexpr std::int64_t kUnitsToFile = 4, kUnitsToLook = 2, kUnitsToPut = 100;
// Tiles of the list that a unit looks at, and how much further than it must.
constexpr std::int64_t kTilesAUnit = 2;
constexpr double kTileMargin_m = 0.1;

std::uint64_t CellAt(std::int64_t column, std::int64_t row) {
  return static_cast<std::uint64_t>(column) << 32 | (static_cast<std::uint64_t>(row) & 0xffffffff);
}
std::int64_t CellOf(double coordinate_m) { return static_cast<std::int64_t>(std::floor(coordinate_m / kCell_m)); }

const TriangleMeshShape* LargeMesh(const Shape& shape) {
  const auto* mesh = std::get_if<TriangleMeshShape>(&shape.form);
  return mesh != nullptr && mesh->triangles.size() > kWholeTriangles ? mesh : nullptr;
}

Rect OnGround(const Aabb& box) { return {box.min.x, box.min.z, box.max.x, box.max.z}; }

bool IsEndless(const Shape& shape) { return std::holds_alternative<PlaneShape>(shape.form); }
bool IsField(const Shape& shape) { return std::holds_alternative<HeightFieldShape>(shape.form); }

}  // namespace

void Ground::Begin() {
  here_.clear();
  area_.reset();
  search_.reset();
}

std::size_t Ground::piece_triangles() const {
  std::size_t triangles = 0;
  for (const auto& [id, piece] : here_) {
    if (piece == nullptr) continue;
    if (const auto* mesh = std::get_if<TriangleMeshShape>(&piece->form)) triangles += mesh->triangles.size();
    if (const auto* field = std::get_if<HeightFieldShape>(&piece->form)) {
      triangles += std::size_t{2} * (field->columns - 1) * (field->rows - 1);
    }
  }
  return triangles;
}

bool Ground::Covers(Vec3d at, double reach_m) const {
  if (!area_ || !area_->Covers(at, reach_m)) return false;
  // While the next area is built, pieces of it have taken the place of those of the old one.
  return !search_ || !search_->found || search_->area.Covers(at, reach_m);
}

void Ground::Work(physics::World& world, Vec3d at, double reach_m, WorkBudget& budget, double wish_m) {
  if (!Survey(budget)) return;
  if (search_ && !search_->area.Covers(at, reach_m)) {
    if (search_->found) area_.reset();  // some of its parts have been replaced
    search_.reset();
  }
  if (!search_) {
    const bool serves = area_ && Length(at - area_->centre) <= (area_->radius_m - reach_m) / 2;
    if (serves && area_->wished_m >= wish_m) return;
    const double radius = std::max({kLeastArea_m, kAreaOfReach * reach_m + kAreaBeyond_m, wish_m});
    const Area area{at, radius, wish_m};
    if (!HasTiles(area, budget)) return;
    search_.emplace(Search{.area = area, .least_m = reach_m + kLeastBeyond_m});
    Gather(budget);
    GatherTiles(budget);
  }
  if (!search_->found && !Cut(budget)) return;
  if (!Build(world, budget)) return;
  area_ = search_->area;
  search_.reset();
}

// --- Once: where everything is.

bool Ground::Survey(WorkBudget& budget) {
  for (; surveyed_ < scene_->bodies.size(); ++surveyed_) {
    if (!budget.left()) return false;
    if (!File(static_cast<std::uint32_t>(surveyed_), budget)) return false;
  }
  return std::ranges::all_of(laid_, [&](auto& entry) { return SurveyTile(*entry.second, budget); });
}

void Ground::AddTile(std::uint32_t number, std::shared_ptr<const Tile> tile) {
  laid_[number] = std::make_shared<Laid>(Laid{.tile = std::move(tile)});
}

// A search that is under way keeps what it refers to.
void Ground::DropTile(std::uint32_t number) { laid_.erase(number); }

bool Ground::SurveyTile(Laid& laid, WorkBudget& budget) {
  for (std::size_t at = laid.balls.size(); at < laid.tile->parts.size(); ++at) {
    if (!budget.left()) return false;
    const TilePart& part = laid.tile->parts[at];
    budget.Spend(kUnitsToLook);
    double ball_m = RadiusOf(*part.body.shape);
    if (const auto* mesh = std::get_if<TriangleMeshShape>(&part.body.shape->form)) {
      if (!laid.blocks.try_emplace(at, *mesh).first->second.Survey(budget)) return false;
      for (const Vec3f& vertex : mesh->vertices) ball_m = std::max(ball_m, Length(Vec3d(vertex)));
      budget.Spend(std::ssize(mesh->vertices) / 2);
    }
    laid.balls.push_back(ball_m);
  }
  return true;
}

// Whether all tiles are here that reach into the area's cube, however a surface is turned in it.
bool Ground::HasTiles(const Area& area, WorkBudget& budget) const {
  if (index_ == nullptr) return true;
  budget.Spend(std::ssize(index_->tiles) / kTilesAUnit);
  const double reach_m = std::sqrt(3.0) * area.radius_m + kTileMargin_m;
  for (std::uint32_t tile = 0; tile < index_->tiles.size(); ++tile) {
    const bool near = OnGround(index_->tiles[tile].bounds).DistanceTo(area.centre.x, area.centre.z) <= reach_m;
    if (near && !laid_.contains(tile)) return false;
  }
  return true;
}

bool Ground::File(std::uint32_t index, WorkBudget& budget) {
  const BodyDef& def = scene_->bodies[index];
  budget.Spend(kUnitsToFile);
  if (def.motion != Motion::kStatic || def.path != nullptr) return true;
  if (const TriangleMeshShape* mesh = LargeMesh(*def.shape)) {
    if (!meshes_.try_emplace(def.shape.get(), *mesh).first->second.Survey(budget)) return false;
    wide_.push_back(index);
    return true;
  }
  const bool wide = IsEndless(*def.shape) || IsField(*def.shape) || BallOf(def.shape, budget) > kCell_m;
  const Vec3d place = def.initial.position;
  (wide ? wide_ : small_[CellAt(CellOf(place.x), CellOf(place.z))]).push_back(index);
  return true;
}

double Ground::BallOf(const ShapePtr& shape, WorkBudget& budget) {
  const auto [at, fresh] = balls_.try_emplace(shape.get(), 0);
  if (!fresh) return at->second;
  if (const auto* mesh = std::get_if<TriangleMeshShape>(&shape->form)) {
    for (const auto& triangle : mesh->triangles) {
      for (const std::uint32_t corner : triangle) {
        at->second = std::max(at->second, Length(Vec3d(mesh->vertices[corner])));
      }
    }
    budget.Spend(static_cast<std::int64_t>(mesh->triangles.size()));
  } else {
    at->second = RadiusOf(*shape);
  }
  return at->second;
}

// --- Again and again: what is near.

void Ground::Gather(WorkBudget& budget) {
  const Vec3d centre = search_->area.centre;
  const double reach = search_->area.radius_m + kCell_m;
  for (std::int64_t column = CellOf(centre.x - reach); column <= CellOf(centre.x + reach); ++column) {
    for (std::int64_t row = CellOf(centre.z - reach); row <= CellOf(centre.z + reach); ++row) {
      budget.Spend(kUnitsToLook);
      const auto cell = small_.find(CellAt(column, row));
      if (cell == small_.end()) continue;
      budget.Spend(kUnitsToLook * std::ssize(cell->second));
      for (const std::uint32_t index : cell->second) {
        Take(scene_->bodies[index], balls_.at(scene_->bodies[index].shape.get()));
      }
    }
  }
  budget.Spend(kUnitsToLook * std::ssize(wide_));
  for (const std::uint32_t index : wide_) {
    const BodyDef& def = scene_->bodies[index];
    if (IsEndless(*def.shape)) {
      search_->parts.push_back({&def});
    } else if (const auto* field = std::get_if<HeightFieldShape>(&def.shape->form)) {
      search_->surfaces.push_back({.def = &def, .fields = {{field}}});
    } else if (const TriangleMeshShape* mesh = LargeMesh(*def.shape)) {
      search_->surfaces.push_back({.def = &def, .meshes = {{mesh, &meshes_.at(def.shape.get())}}});
    } else {
      Take(def, balls_.at(def.shape.get()));
    }
  }
}

void Ground::GatherTiles(WorkBudget& budget) {
  const Vec3d centre = search_->area.centre;
  const double reach_m = std::sqrt(3.0) * search_->area.radius_m + kTileMargin_m;
  std::map<BodyId, Surface> surfaces;
  for (const auto& [number, laid] : laid_) {
    budget.Spend(kUnitsToLook);
    if (OnGround(index_->tiles[number].bounds).DistanceTo(centre.x, centre.z) > reach_m) continue;
    search_->tiles.push_back(laid);
    budget.Spend(std::ssize(laid->tile->parts));
    for (std::size_t at = 0; at < laid->tile->parts.size(); ++at) {
      const TilePart& part = laid->tile->parts[at];
      const Shape& shape = *part.body.shape;
      if (const auto* field = std::get_if<HeightFieldShape>(&shape.form)) {
        Surface& surface = surfaces.try_emplace(part.body.id, Surface{.def = &part.body}).first->second;
        surface.fields.push_back({field, part.field ? &*part.field : nullptr});
      } else if (part.mesh != nullptr || LargeMesh(shape) != nullptr) {
        Surface& surface = surfaces.try_emplace(part.body.id, Surface{.def = &part.body}).first->second;
        surface.meshes.push_back({std::get_if<TriangleMeshShape>(&shape.form), &laid->blocks.at(at), part.mesh.get()});
      } else {
        Take(part.body, laid->balls[at]);
      }
    }
  }
  for (auto& [id, surface] : surfaces) search_->surfaces.push_back(std::move(surface));
}

void Ground::Take(const BodyDef& def, double ball_m) {
  const Area& area = search_->area;
  if (Length(def.initial.position - area.centre) <= area.radius_m + ball_m) search_->parts.push_back({&def});
}

Reach Ground::ReachIn(const BodyDef& def, const Search& search) {
  const Vec3d local = Rotate(Conjugate(def.initial.orientation), search.area.centre - def.initial.position);
  return {.centre = local, .reach_m = search.area.radius_m, .least_m = search.least_m};
}

bool Ground::Cut(WorkBudget& budget) {
  Search& search = *search_;
  while (!search.surfaces.empty()) {
    if (!budget.left()) return false;
    Surface& surface = search.surfaces.back();
    const BodyDef& def = *surface.def;
    if (!surface.fields.empty()) {
      FieldPiece piece = PieceOf(surface.fields, ReachIn(def, search), budget);
      search.area.radius_m = std::min(search.area.radius_m, piece.reach_m);
      if (piece.shape != nullptr) search.parts.push_back({&def, std::move(piece.shape), piece.offset});
    } else {
      if (!search.piece) search.piece.emplace(surface.meshes, ReachIn(def, search));
      if (!search.piece->Search(budget)) return false;
      search.area.radius_m = std::min(search.area.radius_m, search.piece->reach_m());
      if (ShapePtr shape = search.piece->Make(budget)) search.parts.push_back({&def, std::move(shape), Vec3d()});
      search.piece.reset();
    }
    search.surfaces.pop_back();
  }
  std::map<BodyId, bool> wanted;
  for (const Part& part : search.parts) wanted[part.def->id] = true;
  for (const auto& [id, piece] : here_) {
    if (!wanted.contains(id)) search.leaving.push_back(id);
  }
  budget.Spend(std::ssize(search.parts) + std::ssize(here_));
  return search.found = true;
}

// Where something of a budget was spent and the rest is too little, the next one is waited for.
bool Ground::Build(physics::World& world, WorkBudget& budget) {
  Search& search = *search_;
  for (; !search.parts.empty(); search.parts.pop_back()) {
    if (!budget.left()) return false;
    if (budget.spent() > 0 && UnitsToBuild(search.parts.back()) > budget.units_left()) return false;
    Put(world, search.parts.back(), budget);
  }
  for (; !search.leaving.empty(); search.leaving.pop_back()) {
    if (!budget.left()) return false;
    if (world.Has(search.leaving.back())) world.Remove(search.leaving.back());
    here_.erase(search.leaving.back());
    budget.Spend(kUnitsToPut / 2);
  }
  return true;
}

void Ground::Put(physics::World& world, const Part& part, WorkBudget& budget) {
  const BodyDef& def = *part.def;
  const auto here = here_.find(def.id);
  if (here != here_.end() && here->second == nullptr && part.piece == nullptr) return budget.Spend(kUnitsToLook);
  if (world.Has(def.id)) world.Remove(def.id);
  budget.Spend(kUnitsToPut);
  here_[def.id] = part.piece;
  if (part.piece == nullptr) return world.Add(def, def.initial);
  BodyDef cut = def;
  cut.shape = part.piece;
  cut.initial.position += Rotate(def.initial.orientation, part.offset);
  world.Add(cut, cut.initial);
  budget.Spend(UnitsToBuild(part));
}

std::int64_t Ground::UnitsToBuild(const Part& part) {
  if (part.piece == nullptr) return 0;
  if (const auto* mesh = std::get_if<TriangleMeshShape>(&part.piece->form)) {
    return std::ssize(mesh->triangles) * kUnitsToBuildATriangle;
  }
  return std::ssize(std::get<HeightFieldShape>(part.piece->form).heights_m) * kUnitsToBuildATriangle / 4;
}

}  // namespace tessera::client

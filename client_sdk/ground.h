// Ground: the static bodies near the own body, as bodies of the prediction's world: a few of all that a scene has.
//
// A scene may have a million of them, and one mesh a million triangles; building all of it takes seconds. Here all is
// looked at once, in goes, and what is near is built: small bodies whole, of large meshes and height fields a piece
// (surface_piece.h). When the own body has come half-way to the rim of what is there, the next area is searched and
// built, in goes again, while the old one still serves.
//
//   Ground ground(scene);
//   ground.Begin();                                            // the world is a new, empty one
//   ground.Work(world, own.position, reach_m, budget);         // once a poll
//   if (ground.Covers(own.position, reach_m)) ...              // all within `reach_m` is in the world
//
// A level in tiles (core/world/level_tiles.h) has ground where all tiles are that reach there, to the bit what
// it would be with the whole level:
//
//   Ground ground(scene, index);
//   ground.AddTile(7, tile);  ...  ground.DropTile(7);
//
// Static bodies with a path are not its business. Work is counted (work_budget.h), never measured.
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "client_sdk/surface_piece.h"
#include "client_sdk/work_budget.h"
#include "core/physics/world.h"
#include "core/world/scene.h"

namespace tessera::client {

class Ground {
 public:
  // `index`: the level's tiles; null: all of it is in the scene.
  explicit Ground(std::shared_ptr<const Scene> scene, std::shared_ptr<const LevelIndex> index = nullptr)
      : scene_(std::move(scene)), index_(std::move(index)) {}

  // Nothing of the ground is in the world that the next Work gets.
  void Begin();
  // Requires 0 < reach_m. `wish_m`: a larger area is welcome, as far as surfaces are coarse enough for it.
  void Work(physics::World& world, Vec3d at, double reach_m, WorkBudget& budget, double wish_m = 0);
  bool Covers(Vec3d at, double reach_m) const;
  // A tile has come, or goes.
  void AddTile(std::uint32_t number, std::shared_ptr<const Tile> tile);
  void DropTile(std::uint32_t number);
  // Static bodies in the world, and triangles of the pieces among them.
  std::size_t bodies() const { return here_.size(); }
  std::size_t piece_triangles() const;

 private:
  struct Area {
    Vec3d centre;
    double radius_m = 0;
    double wished_m = 0;
    bool Covers(Vec3d at, double reach_m) const { return Length(at - centre) + reach_m <= radius_m; }
  };
  // A body that is to be in the world: whole, or a piece of it.
  struct Part {
    const BodyDef* def = nullptr;
    ShapePtr piece{};  // null: whole
    Vec3d offset{};    // where the piece is, in the body's frame
  };
  // A mesh or height field of which a piece is to be cut, or the parts of it in the tiles that are here.
  struct Surface {
    const BodyDef* def = nullptr;
    std::vector<MeshSource> meshes{};
    std::vector<FieldSource> fields{};
  };
  // A tile that is here, with what has been seen of its parts, by their places.
  struct Laid {
    std::shared_ptr<const Tile> tile;
    std::vector<double> balls{};
    std::map<std::size_t, MeshBlocks> blocks{};
  };
  // The next area on its way.
  struct Search {
    Area area;
    double least_m = 0;
    std::vector<std::shared_ptr<const Laid>> tiles{};  // which the rest refers to
    std::vector<Surface> surfaces{};                   // still to be cut
    std::optional<MeshPiece> piece{};                  // the last one's
    std::vector<Part> parts{};
    bool found = false;             // all parts are known
    std::vector<BodyId> leaving{};  // after all parts are in the world
  };

  bool Survey(WorkBudget& budget);
  bool File(std::uint32_t index, WorkBudget& budget);
  static bool SurveyTile(Laid& laid, WorkBudget& budget);
  bool HasTiles(const Area& area, WorkBudget& budget) const;
  double BallOf(const ShapePtr& shape, WorkBudget& budget);
  void Gather(WorkBudget& budget);
  void GatherTiles(WorkBudget& budget);
  void Take(const BodyDef& def, double ball_m);
  bool Cut(WorkBudget& budget);
  bool Build(physics::World& world, WorkBudget& budget);
  void Put(physics::World& world, const Part& part, WorkBudget& budget);
  static std::int64_t UnitsToBuild(const Part& part);
  static Reach ReachIn(const BodyDef& def, const Search& search);

  std::shared_ptr<const Scene> scene_;
  std::shared_ptr<const LevelIndex> index_;
  std::map<std::uint32_t, std::shared_ptr<Laid>> laid_;                  // tiles that are here, by number
  std::size_t surveyed_ = 0;                                             // bodies of the scene
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> small_;  // by cell on the ground
  std::vector<std::uint32_t> wide_;                                      // and those larger than a cell
  std::unordered_map<const Shape*, double> balls_;                       // for wide and small ones
  std::map<const Shape*, MeshBlocks> meshes_;                            // those that are cut

  std::map<BodyId, ShapePtr> here_;  // in the world; null: whole
  std::optional<Area> area_;         // that is in the world whole
  std::optional<Search> search_;
};

}  // namespace tessera::client

// TiledLevel: a level for the golden forms of tiles. A height field in the west makes it large enough for tiles, and is
// all that two of them hold. Three light ones in the east have all that a tile can have, so that their bytes are few:
// parts of a mesh and of a height field that are in each of them, a turned box that is drawn by a file's mesh, and a
// rock whose form two tiles share.
//
// Coordinates are whole numbers and halves, and no angle is computed: the forms are the same on each machine.
// Thread rule: a free function on values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/world/level_tiles.h"
#include "core/world/scene.h"

namespace tessera {

inline constexpr std::size_t kTiledLevelTiles = 5;
// The light tile with one of everything: its square, and its place in the list.
inline constexpr TileSquare kGoldenSquare{0, 2};
inline constexpr std::size_t kGoldenTile = 3;

namespace tiled_level {

inline ShapePtr Field(std::uint32_t columns, std::uint32_t rows, double spacing_m) {
  HeightFieldShape field{.columns = columns, .rows = rows, .spacing_m = spacing_m, .heights_m = {}};
  for (std::uint32_t i = 0; i < columns * rows; ++i) field.heights_m.push_back(static_cast<float>(i % 5) / 2);
  return std::make_shared<const Shape>(Shape{std::move(field)});
}

// A strip of `cells` squares of 3 m along x from 0 on, two triangles each.
inline ShapePtr Strip(std::uint32_t cells) {
  TriangleMeshShape mesh;
  for (std::uint32_t i = 0; i <= cells; ++i) {
    const auto x = static_cast<float>(3 * i), y = static_cast<float>(i % 3);
    mesh.vertices.push_back({x, y, 0});
    mesh.vertices.push_back({x, y, 3});
  }
  for (std::uint32_t i = 0; i < cells; ++i) {
    mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
    mesh.triangles.push_back({2 * i + 2, 2 * i + 1, 2 * i + 3});
  }
  return std::make_shared<const Shape>(Shape{std::move(mesh)});
}

inline ShapePtr DrawnBox() {
  Shape box{BoxShape{{1, 2, 3}}};
  Visual visual;
  visual.sha256 = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
  visual.mesh = 300;
  visual.pose.position = {0, -2, 0};
  visual.scale = {-0.5, 2, 1};
  box.visuals.push_back(visual);
  return std::make_shared<const Shape>(std::move(box));
}

inline BodyDef& Add(Scene& scene, const char* name, ShapePtr shape, Vec3d place) {
  BodyDef& def = scene.bodies.emplace_back();
  def.id = BodyId(scene.bodies.size());
  def.name = name;
  def.shape = std::move(shape);
  def.motion = Motion::kStatic;
  def.mass_kg = 0;
  def.initial.position = place;
  return def;
}

}  // namespace tiled_level

inline Scene TiledLevel() {
  Scene scene;
  scene.name = "tiled";
  scene.bounds = {{-600, -50, -600}, {600, 50, 600}};
  tiled_level::Add(scene, "plain", tiled_level::Field(600, 600, 0.25), {-100, 0, 0});
  tiled_level::Add(scene, "hills", tiled_level::Field(9, 5, 20), {330, -1, 20});
  tiled_level::Add(scene, "road", tiled_level::Strip(66), {202, 5, 60});
  tiled_level::Add(scene, "crate", tiled_level::DrawnBox(), {300, 8, 20}).initial.orientation = Quatd{0, 1, 0, 0};
  const auto rock = std::make_shared<const Shape>(Shape{ConvexHullShape{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}});
  tiled_level::Add(scene, "rock", rock, {310, 8, 30}).material.friction = 0.25;
  tiled_level::Add(scene, "rock", rock, {400, 8, 30});
  BodyDef& ball = tiled_level::Add(scene, "ball", std::make_shared<const Shape>(Shape{SphereShape{0.5}}), {300, 20, 0});
  ball.motion = Motion::kDynamic;
  ball.mass_kg = 1;
  return scene;
}

}  // namespace tessera

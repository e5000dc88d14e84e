// World: the scene and its bodies as a picture, seen from behind the own body.
//
//   World world(renderer, visuals, client);              // once: meshes of the scene's shapes
//   renderer.Draw(world.Look(client, hands), w, h);      // each frame
//
// The level of a large scene comes in tiles: each is drawn from the frame on in which it is here, and its meshes are
// freed when it has gone.
//
// A shape that refers to meshes of a file is drawn by them, in their colours, where the file can be had.
//
// Thread rule: the thread of the OpenGL context. The client and the visuals outlive it.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "input.h"
#include "renderer.h"
#include "tessera/tessera.hpp"
#include "visuals.h"

namespace desktop {

// One for each region, again from the beginning after the last.
Vec3 ColourOf(std::uint32_t region);

class World {
 public:
  World(Renderer& renderer, Visuals& visuals, const tessera::Client& client);

  const Picture& Look(tessera::Client& client, const Hands& hands, float seconds);
  // Where the own body was shown last; nothing while it is out of the world.
  const std::optional<std::array<double, 3>>& own_position() const { return own_position_; }
  // True: the camera looks at the own body, and no longer comes after it.
  bool camera_arrived() const { return camera_arrived_; }

 private:
  struct Placed {
    std::size_t mesh = 0;
    Part part;
    bool coloured = false;  // it has its own colours, out of a file
  };
  using Shapes = std::map<const tessera_shape*, std::vector<Placed>>;
  const std::vector<Placed>& MeshesOf(const tessera_shape* shape, Shapes& shapes);
  const std::vector<Placed>& MeshesOf(const tessera_shape* shape) { return MeshesOf(shape, shapes_); }
  const std::vector<Placed>* MeshesOf(const tessera::Client& client, std::uint64_t body);
  void Paint(const std::vector<Placed>& meshes, const double* position, const double* orientation, Copy as);
  struct Standing {
    const std::vector<Placed>* meshes = nullptr;
    tessera::BodyInfo info;
  };
  void Paint(const std::vector<Standing>& standing);
  void FollowTiles(const tessera::Client& client);
  void PaintStatic();
  void PlaceCamera(const tessera::Client& client, const std::vector<tessera::Body>& bodies, const Hands& hands,
                   float seconds);

  // Meshes of a tile are its own, for its shapes go with it.
  struct Tile {
    Shapes shapes;
    std::vector<Standing> standing;
  };

  Renderer& renderer_;
  Visuals& visuals_;
  tessera::SceneInfo scene_;
  Shapes shapes_;
  std::map<std::uint32_t, Tile> tiles_;  // that are here
  std::unordered_map<std::uint64_t, const std::vector<Placed>*> bodies_;
  std::vector<Standing> standing_;
  Picture picture_;
  std::optional<std::array<double, 3>> own_position_;
  std::array<double, 3> target_{};  // the point that the camera looks at
  bool placed_ = false, camera_arrived_ = false;
};

}  // namespace desktop

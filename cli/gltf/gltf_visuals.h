// The meshes of a level as they are drawn: a glTF file of its own with those that bodies refer to, and nothing else.
//
// The file has positions, normals and one colour for each material, and all of it within itself: a page that loads it
// asks no other place for anything. Textures, skins, animations and further attributes are left out.
//
//   VisualMeshes meshes(model);
//   const std::optional<std::uint32_t> number = meshes.Add(node.mesh);   // its place in the file
//   const std::string glb = meshes.Glb();                                // kept under its SHA-256
//
// Thread rule: one thread. The model outlives it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cli/gltf/gltf_geometry.h"

namespace tessera::cli {

class VisualMeshes {
 public:
  explicit VisualMeshes(const tinygltf::Model& model) : model_(model) {}

  // Place of this mesh in the file; nothing for one without a triangle, for one that is damaged, and for all once they
  // have more than kMaxVisualTriangles.
  std::optional<std::uint32_t> Add(int mesh);
  // All that were added; empty if there is none, or if they are too large to be drawn.
  std::string Glb() const;

  std::size_t triangles() const { return triangles_; }
  bool too_large() const;
  std::size_t textures() const { return textures_; }  // materials of these meshes whose texture was left out
  const std::vector<std::string>& notes() const { return notes_; }  // damaged meshes, one line each

 private:
  struct Drawn {
    std::string name;
    std::vector<Surface> surfaces;
  };

  const tinygltf::Model& model_;
  std::map<int, std::optional<std::uint32_t>> places_;  // by number in the model
  std::vector<Drawn> meshes_;
  std::vector<std::string> notes_;
  std::size_t triangles_ = 0, bytes_ = 0, textures_ = 0;
};

}  // namespace tessera::cli

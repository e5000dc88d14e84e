// The meshes of a level as they are drawn: a glTF file of its own with those that bodies refer to, and nothing else.
//
// The file has positions, normals, colours of vertices, and of each material its base colour and the picture of it, and
// all of that within itself: a page that loads it asks no other place for anything. Skins, animations, other pictures
// and further attributes are left out.
//
//   VisualMeshes meshes(model, pictures);
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
#include "cli/gltf/gltf_textures.h"

namespace tessera::cli {

// A PNG or JPEG file within the file of meshes.
struct VisualPicture {
  const char* type = nullptr;  // "image/png"
  std::string file;
};

class VisualMeshes {
 public:
  // `beside`: pictures that do not lie in the model's buffers. Both outlive this.
  VisualMeshes(const tinygltf::Model& model, const Pictures& beside) : model_(model), beside_(beside) {}

  // Place of this mesh in the file; nothing for one without a triangle, for one that is damaged, and for all once they
  // have more than kMaxVisualTriangles.
  std::optional<std::uint32_t> Add(int mesh);
  // All that were added; empty if there is none, or if they are too large to be drawn.
  std::string Glb() const;

  std::size_t triangles() const { return triangles_; }
  bool too_large() const;
  std::size_t textures() const { return textures_; }  // surfaces of these meshes whose picture was left out
  std::size_t pictures() const { return pictures_.size(); }
  const std::vector<std::string>& notes() const { return notes_; }  // damaged meshes and pictures, one line each

 private:
  // A primitive, and the picture of it; -1: none.
  struct Painted {
    Surface surface;
    int picture = -1;
  };
  struct Drawn {
    std::string name;
    std::vector<Painted> surfaces;
  };
  int PictureOf(const Surface& surface);
  int KeepPictureOf(int image);

  const tinygltf::Model& model_;
  const Pictures& beside_;
  std::map<int, int> picture_of_;  // by image of the model; -1: it cannot be kept
  std::vector<VisualPicture> pictures_;
  std::map<int, std::optional<std::uint32_t>> places_;  // by number in the model
  std::vector<Drawn> meshes_;
  std::vector<std::string> notes_;
  std::size_t triangles_ = 0, bytes_ = 0, textures_ = 0, pixels_ = 0;
};

}  // namespace tessera::cli

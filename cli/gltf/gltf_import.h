// glTF 2.0 levels as scenes: what a modelling program exports becomes bodies that a world can run.
//
//   absl::StatusOr<GltfImport> level = ImportGltf(bytes, "models", "level");
//   level->scene;   // to be written, and checked as any other scene
//   level->notes;   // what became of the rest
//
// A node with a mesh becomes a static body with that triangle mesh. Nodes with OMI_physics_body become what they say:
// dynamic, kinematic and static bodies and triggers, of the shapes of OMI_physics_shape; what hangs below a body that
// moves and has a shape is part of it. The meshes themselves, with their colours, are kept in a file of their own, to
// be drawn in place of the shapes. glTF's units and axes are those of scenes: metres, y up, right-handed.
//
// Thread rule: a free function.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "tessera/v1/scene.pb.h"

namespace tessera::cli {

struct GltfImport {
  v1::Scene scene;
  std::size_t nodes = 0, static_bodies = 0, dynamic_bodies = 0, kinematic_bodies = 0, triggers = 0, triangles = 0;
  std::size_t spawn_points = 0;
  // A glTF file (.glb) with the meshes that the scene's shapes refer to as their visuals, and its SHA-256, by which
  // they do; both are empty if none does.
  std::string visual_file, visual_sha256;
  std::size_t drawn_triangles = 0;  // in that file
  std::vector<std::string> notes;   // parts that were left out or changed, one line each
};

// `bytes`: a .glb or .gltf file; `folder`: where the files lie that it names; `name`: of the scene. Errors:
// INVALID_ARGUMENT that names the node, mesh or accessor at fault.
absl::StatusOr<GltfImport> ImportGltf(std::span<const std::uint8_t> bytes, const std::string& folder,
                                      const std::string& name);

// More nodes than this are refused: each may become a body.
inline constexpr std::size_t kMaxGltfNodes = 500'000;

}  // namespace tessera::cli

// Shapes of OMI_physics_shape as shapes of scenes, one or several of them for a body.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "cli/gltf/gltf_transform.h"
#include "core/world/bounds.h"
#include "core/world/math.h"
#include "tessera/v1/scene.pb.h"

namespace tinygltf {
class Model;
class Value;
}  // namespace tinygltf

namespace tessera::cli {

// One shape of a body, in the world.
struct ShapePart {
  Pose pose;
  v1::Shape shape;                     // not set for a hull and for a mesh:
  std::vector<Vec3d> points;           // m in the world
  std::vector<std::uint32_t> indices;  // only for a mesh, three a triangle
};

struct JoinedShape {
  v1::Shape shape;
  Vec3d center;  // the body's position in its node's coordinates: the centre of mass of one that moves
  Aabb box;      // in the world
  bool thinned = false;
};

// Three numbers.
std::optional<Vec3d> VectorOf(const tinygltf::Value& list);

// The shape of this number as `map` puts it into the world. Errors: INVALID_ARGUMENT that begins with `where`.
absl::StatusOr<ShapePart> ReadShape(const tinygltf::Model& model, int shape, const Affine& map,
                                    const std::string& where);

// All parts of a body whose node is at `pose` as one shape.
absl::StatusOr<JoinedShape> JoinParts(const std::vector<ShapePart>& parts, const Pose& pose, bool moves,
                                      const std::string& where);

}  // namespace tessera::cli

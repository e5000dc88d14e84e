// Attributes of glTF vertices, read with every index, length and offset checked.
//
// Thread rule: free functions. What they give refers to the model.
#pragma once

#include <tiny_gltf.h>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/world/math.h"

namespace tessera::cli {

// Null where the model has nothing of that number.
template <class T>
const T* At(const std::vector<T>& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)] : nullptr;
}

// The elements of an accessor: `count` of them, `stride` bytes apart.
struct Elements {
  std::span<const unsigned char> bytes;
  std::size_t count = 0, stride = 0;
  int component = 0;
};

// Errors: INVALID_ARGUMENT that begins with `where` and names the accessor.
absl::StatusOr<Elements> ElementsOf(const tinygltf::Model& model, int index, int type, const std::string& where);

// Colours of a primitive's `count` vertices, red, green and blue, linear, 0 to 1. Empty where there are none that could
// be used.
std::vector<Vec3f> ColoursOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive, std::size_t count);

// Their places in the picture of the primitive's material, moved, turned and scaled as KHR_texture_transform says.
// Empty where there are none that could be used.
std::vector<std::array<float, 2>> PlacesOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                           std::size_t count);

}  // namespace tessera::cli

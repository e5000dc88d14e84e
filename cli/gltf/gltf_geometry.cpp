#include "cli/gltf/gltf_geometry.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>

#include "absl/strings/str_cat.h"
#include "cli/gltf/gltf_attributes.h"
#include "core/world/limits.h"

namespace tessera::cli {
namespace {

// A triangle is flat if its height is less than this share of its longest side.
constexpr double kFlat = 1e-7;

absl::Status Fault(const std::string& where, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

absl::Status ReadPositions(const tinygltf::Model& model, int index, const std::string& where,
                           std::vector<Vec3d>& positions) {
  const auto elements = ElementsOf(model, index, TINYGLTF_TYPE_VEC3, where);
  if (!elements.ok()) return elements.status();
  if (elements->component != TINYGLTF_COMPONENT_TYPE_FLOAT) return Fault(where, "its positions are no floats");
  if (positions.size() + elements->count > kMaxMeshVertices) {
    return Fault(where, absl::StrCat("has more than ", kMaxMeshVertices, " vertices; cut the mesh into several"));
  }
  positions.reserve(positions.size() + elements->count);
  for (std::size_t i = 0; i < elements->count; ++i) {
    float p[3];
    std::memcpy(p, elements->bytes.data() + i * elements->stride, sizeof p);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
      return Fault(where, absl::StrCat("vertex ", i, " is not finite"));
    }
    positions.push_back({p[0], p[1], p[2]});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::uint32_t>> ReadIndices(const tinygltf::Model& model, int index, std::size_t vertices,
                                                       const std::string& where) {
  const auto elements = ElementsOf(model, index, TINYGLTF_TYPE_SCALAR, where);
  if (!elements.ok()) return elements.status();
  std::vector<std::uint32_t> indices(elements->count);
  for (std::size_t i = 0; i < elements->count; ++i) {
    const unsigned char* const at = elements->bytes.data() + i * elements->stride;
    switch (elements->component) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        indices[i] = *at;
        break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
        std::uint16_t value = 0;
        std::memcpy(&value, at, sizeof value);
        indices[i] = value;
        break;
      }
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        std::memcpy(&indices[i], at, sizeof indices[i]);
        break;
      default:
        return Fault(where, "its indices are no unsigned integers");
    }
    if (indices[i] >= vertices) {
      return Fault(where, absl::StrCat("index ", i, " is ", indices[i], ", of ", vertices, " vertices"));
    }
  }
  return indices;
}

// Writes the triangles that `order` stands for, shifted by `first`.
void AddTriangles(int mode, std::span<const std::uint32_t> order, std::uint32_t first,
                  std::vector<std::uint32_t>& indices) {
  const auto add = [&](std::size_t a, std::size_t b, std::size_t c) {
    for (const std::size_t corner : {a, b, c}) indices.push_back(first + order[corner]);
  };
  if (mode == TINYGLTF_MODE_TRIANGLES) {
    for (std::size_t i = 0; i + 2 < order.size(); i += 3) add(i, i + 1, i + 2);
  } else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP) {
    for (std::size_t i = 0; i + 2 < order.size(); ++i) add(i, i + 1 + i % 2, i + 2 - i % 2);
  } else {
    for (std::size_t i = 1; i + 1 < order.size(); ++i) add(i, i + 1, 0);
  }
}

std::string PlaceOf(const tinygltf::Mesh& mesh, int number, std::size_t primitive) {
  return absl::StrCat("mesh ", number, " \"", mesh.name, "\": primitive ", primitive);
}

int ModeOf(const tinygltf::Primitive& primitive) {
  return primitive.mode == -1 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
}
bool HasTriangles(const tinygltf::Primitive& primitive) {
  return ModeOf(primitive) >= TINYGLTF_MODE_TRIANGLES && ModeOf(primitive) <= TINYGLTF_MODE_TRIANGLE_FAN;
}

// Adds the vertices and triangles of a primitive that has some.
absl::Status AddPrimitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive, const std::string& where,
                          Triangles& triangles) {
  const auto positions = primitive.attributes.find("POSITION");
  if (positions == primitive.attributes.end()) return Fault(where, "has no positions");
  const std::size_t first = triangles.vertices.size();
  if (absl::Status read = ReadPositions(model, positions->second, where, triangles.vertices); !read.ok()) return read;
  const std::size_t count = triangles.vertices.size() - first;
  std::vector<std::uint32_t> order;
  if (primitive.indices < 0) {
    order.resize(count);
    for (std::size_t k = 0; k < count; ++k) order[k] = static_cast<std::uint32_t>(k);
  } else {
    auto indices = ReadIndices(model, primitive.indices, count, where);
    if (!indices.ok()) return indices.status();
    order = *std::move(indices);
  }
  if (triangles.indices.size() / 3 + order.size() > 3 * kMaxMeshTriangles) {
    return Fault(where, absl::StrCat("has more than ", kMaxMeshTriangles, " triangles; cut the mesh into several"));
  }
  AddTriangles(ModeOf(primitive), order, static_cast<std::uint32_t>(first), triangles.indices);
  return absl::OkStatus();
}

// Empty where there are none that could be used: whoever draws makes some then.
std::vector<Vec3f> NormalsOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive, std::size_t count,
                             const std::string& where) {
  const auto attribute = primitive.attributes.find("NORMAL");
  std::vector<Vec3d> read;
  if (attribute == primitive.attributes.end() || !ReadPositions(model, attribute->second, where, read).ok() ||
      read.size() != count) {
    return {};
  }
  std::vector<Vec3f> normals;
  normals.reserve(count);
  for (const Vec3d& normal : read) normals.emplace_back(normal);
  return normals;
}

bool IsFlat(Vec3d a, Vec3d b, Vec3d c) {
  const double longest = std::max({Length(b - a), Length(c - b), Length(a - c)});
  return !(Length(Cross(b - a, c - a)) > kFlat * longest * longest);
}

}  // namespace

absl::StatusOr<Triangles> ReadMesh(const tinygltf::Model& model, int mesh) {
  const tinygltf::Mesh* const found = At(model.meshes, mesh);
  if (found == nullptr) return Fault("meshes", absl::StrCat("there is no mesh ", mesh));
  Triangles triangles;
  for (std::size_t i = 0; i < found->primitives.size(); ++i) {
    const tinygltf::Primitive& primitive = found->primitives[i];
    if (!HasTriangles(primitive)) {
      ++triangles.other_primitives;
      continue;
    }
    if (absl::Status added = AddPrimitive(model, primitive, PlaceOf(*found, mesh, i), triangles); !added.ok()) {
      return added;
    }
  }
  if (triangles.indices.size() / 3 > kMaxMeshTriangles) {
    return Fault(absl::StrCat("mesh ", mesh, " \"", found->name, "\""),
                 absl::StrCat("has more than ", kMaxMeshTriangles, " triangles; cut the mesh into several"));
  }
  return triangles;
}

absl::StatusOr<std::vector<Surface>> ReadSurfaces(const tinygltf::Model& model, int mesh) {
  const tinygltf::Mesh* const found = At(model.meshes, mesh);
  if (found == nullptr) return Fault("meshes", absl::StrCat("there is no mesh ", mesh));
  std::vector<Surface> surfaces;
  for (std::size_t i = 0; i < found->primitives.size(); ++i) {
    const tinygltf::Primitive& primitive = found->primitives[i];
    if (!HasTriangles(primitive)) continue;
    const std::string where = PlaceOf(*found, mesh, i);
    Triangles triangles;
    if (absl::Status added = AddPrimitive(model, primitive, where, triangles); !added.ok()) return added;
    if (triangles.indices.empty()) continue;
    Surface surface;
    surface.positions.reserve(triangles.vertices.size());
    for (const Vec3d& vertex : triangles.vertices) surface.positions.emplace_back(vertex);
    surface.normals = NormalsOf(model, primitive, triangles.vertices.size(), where);
    surface.colours = ColoursOf(model, primitive, triangles.vertices.size());
    surface.places = PlacesOf(model, primitive, triangles.vertices.size());
    surface.indices = std::move(triangles.indices);
    surface.material = primitive.material;
    surfaces.push_back(std::move(surface));
  }
  return surfaces;
}

void DropDegenerate(Triangles& triangles) {
  std::vector<std::uint32_t> kept;
  kept.reserve(triangles.indices.size());
  for (std::size_t i = 0; i + 2 < triangles.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) { return triangles.vertices[triangles.indices[i + k]]; };
    if (IsFlat(corner(0), corner(1), corner(2))) {
      ++triangles.degenerate;
      continue;
    }
    kept.insert(kept.end(), triangles.indices.begin() + static_cast<std::ptrdiff_t>(i),
                triangles.indices.begin() + static_cast<std::ptrdiff_t>(i + 3));
  }
  // Vertices in the order of their first use.
  constexpr std::uint32_t kUnused = 0xffffffff;
  std::vector<std::uint32_t> place(triangles.vertices.size(), kUnused);
  std::vector<Vec3d> vertices;
  for (std::uint32_t& index : kept) {
    if (place[index] == kUnused) {
      place[index] = static_cast<std::uint32_t>(vertices.size());
      vertices.push_back(triangles.vertices[index]);
    }
    index = place[index];
  }
  triangles.indices = std::move(kept);
  triangles.vertices = std::move(vertices);
}

}  // namespace tessera::cli

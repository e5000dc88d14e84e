#include "cli/gltf/gltf_visuals.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "core/world/bytes.h"
#include "core/world/limits.h"

namespace tessera::cli {
namespace {

using nlohmann::json;

constexpr int kFloats = 5126, kUnsignedInts = 5125;         // component types of glTF
constexpr int kVertexTarget = 34962, kIndexTarget = 34963;  // targets of buffer views
constexpr std::uint32_t kGlbMagic = 0x46546C67, kGlbVersion = 2, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kGlbHead_bytes = 12 + 8 + 8;

// Bytes of a surface in the file, about.
std::size_t BytesOf(const Surface& surface) {
  return (surface.positions.size() + surface.normals.size()) * sizeof(Vec3f) + surface.indices.size() * 4;
}

// Red, green and blue of a primitive's material, each 0 to 1; white without one.
std::array<double, 3> ColourOf(const tinygltf::Model& model, int material) {
  std::array<double, 3> colour{1, 1, 1};
  if (material < 0 || static_cast<std::size_t>(material) >= model.materials.size()) return colour;
  const std::vector<double>& factor =
      model.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorFactor;
  for (std::size_t i = 0; i < colour.size() && i < factor.size(); ++i) {
    if (std::isfinite(factor[i])) colour[i] = std::clamp(factor[i], 0.0, 1.0);
  }
  return colour;
}

bool HasTexture(const tinygltf::Model& model, int material) {
  return material >= 0 && static_cast<std::size_t>(material) < model.materials.size() &&
         model.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorTexture.index >= 0;
}

// The document and its buffer, which grow together.
class GlbWriter {
 public:
  GlbWriter() {
    document_ = {{"asset", {{"version", "2.0"}, {"generator", "tessera scene import"}}},
                 {"scene", 0},
                 {"scenes", json::array({{{"nodes", json::array()}}})},
                 {"nodes", json::array()},
                 {"meshes", json::array()},
                 {"materials", json::array()},
                 {"accessors", json::array()},
                 {"bufferViews", json::array()}};
  }

  // Begins a mesh; the surfaces that follow are its.
  void BeginMesh(const std::string& name) {
    const std::size_t number = document_["meshes"].size();
    document_["scenes"][0]["nodes"].push_back(number);
    document_["nodes"].push_back({{"mesh", number}});
    document_["meshes"].push_back({{"name", name}, {"primitives", json::array()}});
  }

  void AddSurface(const Surface& surface, const std::array<double, 3>& colour) {
    json primitive = {{"attributes", {{"POSITION", Positions(surface.positions)}}},
                      {"indices", Indices(surface.indices)},
                      {"material", Material(colour)}};
    if (!surface.normals.empty()) primitive["attributes"]["NORMAL"] = Vectors(surface.normals);
    document_["meshes"].back()["primitives"].push_back(std::move(primitive));
  }

  std::string Finish() {
    document_["buffers"] = json::array({{{"byteLength", buffer_.size()}}});
    // Names come from a stranger's file, and may have any bytes.
    std::string text = document_.dump(-1, ' ', false, json::error_handler_t::replace);
    text.resize((text.size() + 3) / 4 * 4, ' ');
    ByteWriter out;
    out.U32(kGlbMagic);
    out.U32(kGlbVersion);
    out.U32(static_cast<std::uint32_t>(kGlbHead_bytes + text.size() + buffer_.size()));
    out.U32(static_cast<std::uint32_t>(text.size()));
    out.U32(kJsonChunk);
    out.Text(text);
    out.U32(static_cast<std::uint32_t>(buffer_.size()));
    out.U32(kBinaryChunk);
    out.Bytes(buffer_.bytes());
    const std::vector<std::uint8_t> bytes = out.Take();
    return {bytes.begin(), bytes.end()};
  }

 private:
  std::size_t Accessor(std::size_t begin, int target, int component, const char* type, std::size_t count) {
    document_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", buffer_.size() - begin}, {"target", target}});
    document_["accessors"].push_back({{"bufferView", document_["bufferViews"].size() - 1},
                                      {"componentType", component},
                                      {"type", type},
                                      {"count", count}});
    return document_["accessors"].size() - 1;
  }
  std::size_t Vectors(const std::vector<Vec3f>& vectors) {
    const std::size_t begin = buffer_.size();
    for (const Vec3f& v : vectors) buffer_.V(v);
    return Accessor(begin, kVertexTarget, kFloats, "VEC3", vectors.size());
  }
  // The format wants to know how far they reach.
  std::size_t Positions(const std::vector<Vec3f>& positions) {
    const std::size_t accessor = Vectors(positions);
    Vec3f low = positions.front(), high = low;
    for (const Vec3f& p : positions) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    document_["accessors"][accessor]["min"] = {low.x, low.y, low.z};
    document_["accessors"][accessor]["max"] = {high.x, high.y, high.z};
    return accessor;
  }
  std::size_t Indices(const std::vector<std::uint32_t>& indices) {
    const std::size_t begin = buffer_.size();
    for (const std::uint32_t index : indices) buffer_.U32(index);
    return Accessor(begin, kIndexTarget, kUnsignedInts, "SCALAR", indices.size());
  }
  // Materials of one colour are one.
  std::size_t Material(const std::array<double, 3>& colour) {
    const auto [found, fresh] = materials_.emplace(colour, materials_.size());
    if (fresh) {
      document_["materials"].push_back(
          {{"pbrMetallicRoughness",
            {{"baseColorFactor", {colour[0], colour[1], colour[2], 1}}, {"metallicFactor", 0}}}});
    }
    return found->second;
  }

  json document_;
  ByteWriter buffer_;
  std::map<std::array<double, 3>, std::size_t> materials_;
};

}  // namespace

bool VisualMeshes::too_large() const { return triangles_ > kMaxVisualTriangles || bytes_ > kMaxVisualFile_bytes / 2; }

std::optional<std::uint32_t> VisualMeshes::Add(int mesh) {
  if (too_large()) return std::nullopt;
  const auto [place, fresh] = places_.emplace(mesh, std::nullopt);
  if (!fresh) return place->second;
  auto surfaces = ReadSurfaces(model_, mesh);
  if (!surfaces.ok()) {
    notes_.push_back("not drawn: " + std::string(surfaces.status().message()));
    return std::nullopt;
  }
  if (surfaces->empty()) return std::nullopt;
  for (const Surface& surface : *surfaces) {
    triangles_ += surface.indices.size() / 3;
    bytes_ += BytesOf(surface);
    if (HasTexture(model_, surface.material)) ++textures_;
  }
  place->second = static_cast<std::uint32_t>(meshes_.size());
  meshes_.push_back({model_.meshes[static_cast<std::size_t>(mesh)].name, *std::move(surfaces)});
  return place->second;
}

std::string VisualMeshes::Glb() const {
  if (meshes_.empty() || too_large()) return "";
  GlbWriter writer;
  for (const Drawn& mesh : meshes_) {
    writer.BeginMesh(mesh.name);
    for (const Surface& surface : mesh.surfaces) writer.AddSurface(surface, ColourOf(model_, surface.material));
  }
  std::string glb = writer.Finish();
  return glb.size() <= kMaxVisualFile_bytes ? glb : "";
}

}  // namespace tessera::cli

#include "cli/gltf/gltf_visuals.h"

#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
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
  return (surface.positions.size() + surface.normals.size() + surface.colours.size()) * sizeof(Vec3f) +
         surface.places.size() * sizeof(surface.places[0]) + surface.indices.size() * 4;
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

// The number of the texture of a primitive's material; -1: it has none.
int TextureOf(const tinygltf::Model& model, int material) {
  if (material < 0 || static_cast<std::size_t>(material) >= model.materials.size()) return -1;
  return model.materials[static_cast<std::size_t>(material)].pbrMetallicRoughness.baseColorTexture.index;
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

  void AddPicture(const VisualPicture& picture) {
    const std::size_t begin = buffer_.size();
    buffer_.Text(picture.file);
    document_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", begin}, {"byteLength", picture.file.size()}});
    buffer_.PadTo((buffer_.size() + 3) / 4 * 4);
    document_["textures"].push_back({{"source", document_["images"].size()}});
    document_["images"].push_back({{"bufferView", document_["bufferViews"].size() - 1}, {"mimeType", picture.type}});
  }

  void AddSurface(const Surface& surface, const std::array<double, 3>& colour, int picture) {
    json primitive = {{"attributes", {{"POSITION", Positions(surface.positions)}}},
                      {"indices", Indices(surface.indices)},
                      {"material", Material(colour, picture)}};
    json& attributes = primitive["attributes"];
    if (!surface.normals.empty()) attributes["NORMAL"] = Vectors(surface.normals);
    if (!surface.colours.empty()) attributes["COLOR_0"] = Vectors(surface.colours);
    if (picture >= 0) attributes["TEXCOORD_0"] = Places(surface.places);
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
  std::size_t Places(const std::vector<std::array<float, 2>>& places) {
    const std::size_t begin = buffer_.size();
    for (const std::array<float, 2>& place : places) {
      buffer_.F32(place[0]);
      buffer_.F32(place[1]);
    }
    return Accessor(begin, kVertexTarget, kFloats, "VEC2", places.size());
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
  // Materials of one colour and one picture are one.
  std::size_t Material(const std::array<double, 3>& colour, int picture) {
    const auto [found, fresh] = materials_.emplace(std::pair(colour, picture), materials_.size());
    if (fresh) {
      json rough = {{"baseColorFactor", {colour[0], colour[1], colour[2], 1}}, {"metallicFactor", 0}};
      if (picture >= 0) rough["baseColorTexture"]["index"] = picture;
      document_["materials"].push_back({{"pbrMetallicRoughness", std::move(rough)}});
    }
    return found->second;
  }

  json document_;
  ByteWriter buffer_;
  std::map<std::pair<std::array<double, 3>, int>, std::size_t> materials_;
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
  Drawn drawn{.name = model_.meshes[static_cast<std::size_t>(mesh)].name, .surfaces = {}};
  drawn.surfaces.reserve(surfaces->size());
  for (Surface& surface : *surfaces) {
    triangles_ += surface.indices.size() / 3;
    bytes_ += BytesOf(surface);
    const int picture = PictureOf(surface);
    if (picture < 0 && TextureOf(model_, surface.material) >= 0) ++textures_;
    drawn.surfaces.push_back({std::move(surface), picture});
  }
  place->second = static_cast<std::uint32_t>(meshes_.size());
  meshes_.push_back(std::move(drawn));
  return place->second;
}

// Without places in a picture there is none.
int VisualMeshes::PictureOf(const Surface& surface) {
  const int texture = TextureOf(model_, surface.material);
  if (surface.places.empty() || texture < 0 || static_cast<std::size_t>(texture) >= model_.textures.size()) return -1;
  const int image = model_.textures[static_cast<std::size_t>(texture)].source;
  const auto [found, fresh] = picture_of_.emplace(image, -1);
  if (fresh) found->second = KeepPictureOf(image);
  return found->second;
}

int VisualMeshes::KeepPictureOf(int image) {
  if (pictures_.size() == kMaxPictures) return -1;
  std::string file = PictureFile(model_, beside_, image);
  const auto kind = CheckPicture(file, kMaxPicturePixels - pixels_);
  if (!kind.ok()) {
    notes_.push_back(absl::StrCat("picture ", image, " ", kind.status().message(), "; it is not drawn"));
    return -1;
  }
  pixels_ += kind->pixels;
  if (bytes_ + file.size() > kMaxVisualFile_bytes / 2) {
    notes_.push_back(absl::StrCat("picture ", image, " has no room in a file of ", kMaxVisualFile_bytes >> 20,
                                  " MiB; it is not drawn"));
    return -1;
  }
  bytes_ += file.size();
  pictures_.push_back({kind->type, std::move(file)});
  return static_cast<int>(pictures_.size()) - 1;
}

std::string VisualMeshes::Glb() const {
  if (meshes_.empty() || too_large()) return "";
  GlbWriter writer;
  for (const VisualPicture& picture : pictures_) writer.AddPicture(picture);
  for (const Drawn& mesh : meshes_) {
    writer.BeginMesh(mesh.name);
    for (const Painted& painted : mesh.surfaces) {
      writer.AddSurface(painted.surface, ColourOf(model_, painted.surface.material), painted.picture);
    }
  }
  std::string glb = writer.Finish();
  return glb.size() <= kMaxVisualFile_bytes ? glb : "";
}

}  // namespace tessera::cli

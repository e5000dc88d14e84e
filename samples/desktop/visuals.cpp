#include "visuals.h"

#include <sodium.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace desktop {

struct VisualFile {
  tinygltf::Model model;
  std::map<int, std::shared_ptr<const Paint>> paints;  // by image; null: it cannot be drawn
};

namespace {

constexpr char kShapes[] = "shapes are drawn in its place";

std::string HashOf(const std::string& bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  hex.pop_back();
  return hex;
}

template <class T>
const T* At(const std::vector<T>& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)] : nullptr;
}

// Elements of an accessor, all of them within the buffer.
struct Elements {
  const unsigned char* bytes = nullptr;
  std::size_t count = 0, stride = 0;
  int component = 0;
};

std::optional<Elements> ElementsOf(const tinygltf::Model& model, int index, int type) {
  const tinygltf::Accessor* const accessor = At(model.accessors, index);
  if (accessor == nullptr || accessor->type != type || accessor->sparse.isSparse) return std::nullopt;
  const tinygltf::BufferView* const view = At(model.bufferViews, accessor->bufferView);
  const tinygltf::Buffer* const buffer = view == nullptr ? nullptr : At(model.buffers, view->buffer);
  if (buffer == nullptr) return std::nullopt;
  const int bytes = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor->componentType));
  if (bytes <= 0) return std::nullopt;
  const int parts = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
  const std::size_t element = static_cast<std::size_t>(bytes) * static_cast<std::size_t>(parts);
  const std::size_t stride = view->byteStride == 0 ? element : view->byteStride, size = buffer->data.size();
  // A count that would overflow is larger than any buffer.
  if (stride < element || stride > 255 || accessor->count > size || view->byteOffset > size ||
      view->byteLength > size - view->byteOffset || accessor->byteOffset > view->byteLength) {
    return std::nullopt;
  }
  const std::size_t room = view->byteLength - accessor->byteOffset;
  if (accessor->count > 0 && (accessor->count - 1) * stride + element > room) return std::nullopt;
  return Elements{buffer->data.data() + view->byteOffset + accessor->byteOffset, accessor->count, stride,
                  accessor->componentType};
}

std::optional<std::vector<Vec3>> VectorsOf(const tinygltf::Model& model, int accessor) {
  const auto elements = ElementsOf(model, accessor, TINYGLTF_TYPE_VEC3);
  if (!elements || elements->component != TINYGLTF_COMPONENT_TYPE_FLOAT) return std::nullopt;
  std::vector<Vec3> vectors(elements->count);
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    std::array<float, 3> v{};
    std::memcpy(v.data(), elements->bytes + i * elements->stride, sizeof v);
    if (!std::isfinite(v[0]) || !std::isfinite(v[1]) || !std::isfinite(v[2])) return std::nullopt;
    vectors[i] = {v[0], v[1], v[2]};
  }
  return vectors;
}

// Without an accessor vertices come in their order.
std::optional<std::vector<std::uint32_t>> IndicesOf(const tinygltf::Model& model, int accessor, std::size_t vertices) {
  if (accessor < 0) {
    std::vector<std::uint32_t> order(vertices);
    std::iota(order.begin(), order.end(), 0U);
    return order;
  }
  const auto elements = ElementsOf(model, accessor, TINYGLTF_TYPE_SCALAR);
  if (!elements) return std::nullopt;
  std::vector<std::uint32_t> indices(elements->count);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const unsigned char* const at = elements->bytes + i * elements->stride;
    if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) {
      indices[i] = *at;
    } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
      std::uint16_t value = 0;
      std::memcpy(&value, at, sizeof value);
      indices[i] = value;
    } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT) {
      std::memcpy(&indices[i], at, sizeof indices[i]);
    } else {
      return std::nullopt;
    }
    if (indices[i] >= vertices) return std::nullopt;
  }
  return indices;
}

// The first `kParts` numbers of each element: floats, or integers that stand for 0 to 1. Nothing if there are not
// `count` of them, or one is not finite.
template <std::size_t kParts>
std::optional<std::vector<std::array<float, kParts>>> SharesOf(const tinygltf::Model& model, int accessor, int type,
                                                               std::size_t count) {
  const auto elements = ElementsOf(model, accessor, type);
  if (!elements || elements->count != count) return std::nullopt;
  std::vector<std::array<float, kParts>> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned char* const at = elements->bytes + i * elements->stride;
    for (std::size_t k = 0; k < kParts; ++k) {
      float& value = values[i][k];
      std::uint16_t whole = 0;
      if (elements->component == TINYGLTF_COMPONENT_TYPE_FLOAT) {
        std::memcpy(&value, at + k * sizeof value, sizeof value);
      } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE) {
        value = static_cast<float>(at[k]) / 0xff;
      } else if (elements->component == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT) {
        std::memcpy(&whole, at + k * sizeof whole, sizeof whole);
        value = static_cast<float>(whole) / 0xffff;
      } else {
        return std::nullopt;
      }
      if (!std::isfinite(value)) return std::nullopt;
    }
  }
  return values;
}

Vec3 ColourOf(const tinygltf::Model& model, int material) {
  const tinygltf::Material* const found = At(model.materials, material);
  if (found == nullptr || found->pbrMetallicRoughness.baseColorFactor.size() < 3) return {1, 1, 1};
  const std::vector<double>& factor = found->pbrMetallicRoughness.baseColorFactor;
  const auto part = [&](std::size_t i) {
    return std::isfinite(factor[i]) ? static_cast<float>(std::clamp(factor[i], 0.0, 1.0)) : 1.0F;
  };
  return {part(0), part(1), part(2)};
}

// A mesh's way into its shape: scaled, turned, moved.
struct Placing {
  std::array<double, 3> position{}, scale{1, 1, 1};
  std::array<double, 4> orientation{0, 0, 0, 1};

  Vec3 Point(Vec3 v) const {
    const auto turned = Rotate(orientation, {v.x * scale[0], v.y * scale[1], v.z * scale[2]});
    return {static_cast<float>(turned[0] + position[0]), static_cast<float>(turned[1] + position[1]),
            static_cast<float>(turned[2] + position[2])};
  }
  Vec3 Normal(Vec3 v) const {
    const auto turned = Rotate(orientation, {v.x / scale[0], v.y / scale[1], v.z / scale[2]});
    return Unit({static_cast<float>(turned[0]), static_cast<float>(turned[1]), static_cast<float>(turned[2])});
  }
  bool mirrors() const { return scale[0] * scale[1] * scale[2] < 0; }
};

// Colours of a primitive's vertices, linear. Nothing if it has some that are damaged.
std::optional<std::vector<Vec3>> ColoursOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                           std::size_t count) {
  const Vec3 factor = ColourOf(model, primitive.material);
  std::vector<Vec3> colours(count, factor);
  const auto attribute = primitive.attributes.find("COLOR_0");
  if (attribute == primitive.attributes.end()) return colours;
  auto own = SharesOf<3>(model, attribute->second, TINYGLTF_TYPE_VEC3, count);
  if (!own) own = SharesOf<3>(model, attribute->second, TINYGLTF_TYPE_VEC4, count);
  if (!own) return std::nullopt;
  for (std::size_t i = 0; i < count; ++i) {
    const std::array<float, 3>& part = (*own)[i];
    colours[i] = {factor.x * std::clamp(part[0], 0.0F, 1.0F), factor.y * std::clamp(part[1], 0.0F, 1.0F),
                  factor.z * std::clamp(part[2], 0.0F, 1.0F)};
  }
  return colours;
}

// The texture of a material's base colour; null: it has none.
const tinygltf::TextureInfo* TextureOf(const tinygltf::Model& model, int material) {
  const tinygltf::Material* const found = At(model.materials, material);
  if (found == nullptr || found->pbrMetallicRoughness.baseColorTexture.index < 0) return nullptr;
  return &found->pbrMetallicRoughness.baseColorTexture;
}

// Places in the picture of a primitive's material; empty if it has none. Nothing if they are damaged.
std::optional<std::vector<std::array<float, 2>>> PlacesOf(const tinygltf::Model& model,
                                                          const tinygltf::Primitive& primitive, std::size_t count) {
  const tinygltf::TextureInfo* const texture = TextureOf(model, primitive.material);
  std::vector<std::array<float, 2>> none;
  if (texture == nullptr) return none;
  const auto attribute = primitive.attributes.find("TEXCOORD_" + std::to_string(texture->texCoord));
  if (attribute == primitive.attributes.end()) return none;
  return SharesOf<2>(model, attribute->second, TINYGLTF_TYPE_VEC2, count);
}

// Nothing for a primitive that is damaged, or is not made of triangles. It is not painted yet.
std::optional<Painted> PrimitiveOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   const Placing& placing) {
  const auto named = primitive.attributes.find("POSITION"), normal = primitive.attributes.find("NORMAL");
  const bool triangles = primitive.mode == -1 || primitive.mode == TINYGLTF_MODE_TRIANGLES;
  if (!triangles || named == primitive.attributes.end()) return std::nullopt;
  const auto positions = VectorsOf(model, named->second);
  const auto indices = positions ? IndicesOf(model, primitive.indices, positions->size()) : std::nullopt;
  if (!indices) return std::nullopt;
  std::optional<std::vector<Vec3>> normals;
  if (normal != primitive.attributes.end()) normals = VectorsOf(model, normal->second);
  if (normals && normals->size() != positions->size()) return std::nullopt;
  const auto colours = ColoursOf(model, primitive, positions->size());
  const auto places = PlacesOf(model, primitive, positions->size());
  if (!colours || !places) return std::nullopt;
  Painted painted;
  painted.mesh.reserve(indices->size());
  for (std::size_t i = 0; i + 2 < indices->size(); i += 3) {
    std::array<std::uint32_t, 3> corner{(*indices)[i], (*indices)[i + 1], (*indices)[i + 2]};
    if (placing.mirrors()) std::swap(corner[1], corner[2]);
    std::array<Vertex, 3> vertices;
    for (std::size_t k = 0; k < 3; ++k) {
      vertices[k].position = placing.Point((*positions)[corner[k]]);
      vertices[k].colour = (*colours)[corner[k]];
      if (!places->empty()) vertices[k].place = (*places)[corner[k]];
      if (normals) vertices[k].normal = placing.Normal((*normals)[corner[k]]);
    }
    const Vec3 flat =
        Unit(Cross(vertices[1].position - vertices[0].position, vertices[2].position - vertices[0].position));
    for (Vertex& vertex : vertices) {
      if (!normals) vertex.normal = flat;
      painted.mesh.push_back(vertex);
    }
  }
  return painted;
}

std::size_t TrianglesOf(const tinygltf::Model& model) {
  std::size_t triangles = 0;
  for (const tinygltf::Mesh& mesh : model.meshes) {
    for (const tinygltf::Primitive& primitive : mesh.primitives) {
      const auto positions = primitive.attributes.find("POSITION");
      const int vertices = positions == primitive.attributes.end() ? -1 : positions->second;
      const tinygltf::Accessor* const corners =
          At(model.accessors, primitive.indices < 0 ? vertices : primitive.indices);
      if (corners != nullptr) triangles += corners->count / 3;
    }
  }
  return triangles;
}

// Nothing is read beside the file: whatever names another one is refused.
bool NamesOthers(const tinygltf::Model& model) {
  const auto elsewhere = [](const auto& one) { return !one.uri.empty(); };
  return std::any_of(model.buffers.begin(), model.buffers.end(), elsewhere) ||
         std::any_of(model.images.begin(), model.images.end(), elsewhere);
}

bool LoadNoImage(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) {
  return true;
}

// Gives why not, empty if all is well.
std::string ReadBytes(const std::string& path, std::string& bytes) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) return "cannot be opened";
  const std::streamoff size = in.tellg();
  if (size < 0 || static_cast<std::size_t>(size) > kMaxVisualFile_bytes) return "is larger than 64 MiB";
  bytes.resize(static_cast<std::size_t>(size));
  in.seekg(0);
  return in.read(bytes.data(), size) ? "" : "cannot be read";
}

// Likewise.
std::string ParseVisualFile(const std::string& bytes, const std::string& sha256, VisualFile& file) {
  if (HashOf(bytes) != sha256) return "is damaged: it has another hash";
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(LoadNoImage, nullptr);
  // No file beside it is looked for.
  const auto never = [](const std::string&, void*) { return false; };
  loader.SetFsCallbacks(
      {never, [](const std::string& name, void*) { return name; },
       [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; },
       [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) { return false; }, nullptr});
  std::string error, warning;
  bool loaded = false;
  try {
    loaded =
        loader.LoadBinaryFromMemory(&file.model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                    static_cast<unsigned>(bytes.size()));
  } catch (const std::exception& thrown) {
    error = thrown.what();
  }
  if (!loaded) return "is no binary glTF file: " + error.substr(0, error.find('\n'));
  if (NamesOthers(file.model)) return "names another file";
  if (TrianglesOf(file.model) > kMaxVisualTriangles) return "has more than 1000000 triangles";
  return "";
}

}  // namespace

Visuals::Visuals(std::string folder, const std::string& page)
    : folder_(std::move(folder)), downloads_(page, kMaxVisualFile_bytes) {}
Visuals::~Visuals() = default;

void Visuals::Complain(const std::string& text, const std::string& instead) {
  if (said_.insert(text).second) problems_.push_back(text + "; " + instead);
}

VisualFile* Visuals::Open(const std::string& sha256) {
  const auto [found, is_new] = files_.try_emplace(sha256);
  if (!is_new) return found->second.get();
  const std::string name = sha256 + ".glb", path = folder_ + "/" + name;
  std::string bytes, problem = "is in no folder";
  if (!folder_.empty()) problem = ReadBytes(path, bytes);
  if (problem.empty() && (Read(path, sha256, bytes) || !downloads_.any())) return files_[sha256].get();
  if (downloads_.any()) {
    downloads_.Begin("/visuals/" + name);
  } else {
    Complain(path + " " + problem, kShapes);
  }
  return nullptr;
}

bool Visuals::Read(const std::string& name, const std::string& sha256, const std::string& bytes) {
  auto file = std::make_unique<VisualFile>();
  const std::string problem = ParseVisualFile(bytes, sha256, *file);
  if (problem.empty()) {
    files_[sha256] = std::move(file);
  } else {
    Complain(name + " " + problem, kShapes);
  }
  return problem.empty();
}

bool Visuals::Advance() {
  bool came = false;
  for (const Download& download : downloads_.Take()) {
    const std::string name = download.path.substr(download.path.rfind('/') + 1);
    if (download.problem.empty()) {
      came = Read(name, name.substr(0, name.rfind('.')), download.bytes) || came;
    } else {
      Complain(name + " " + download.problem, kShapes);
    }
  }
  return came;
}

// A picture that cannot be drawn leaves the colours.
std::shared_ptr<const Paint> Visuals::PaintOf(VisualFile& file, const std::string& sha256, int material) {
  const tinygltf::TextureInfo* const texture = TextureOf(file.model, material);
  const tinygltf::Texture* const found = texture == nullptr ? nullptr : At(file.model.textures, texture->index);
  if (found == nullptr || found->source < 0) return nullptr;
  const auto [known, is_new] = file.paints.try_emplace(found->source);
  if (!is_new) return known->second;
  Paint paint;
  std::string problem = "is one too many";
  if (file.paints.size() <= kMostPaints) problem = ReadPaint(file.model, found->source, paint);
  if (problem.empty()) {
    known->second = std::make_shared<const Paint>(std::move(paint));
  } else {
    Complain(sha256 + ".glb: picture " + std::to_string(found->source) + " " + problem,
             "its meshes have their base colour");
  }
  return known->second;
}

std::vector<Painted> Visuals::MeshesOf(const std::vector<tessera::VisualInfo>& visuals) {
  std::vector<Painted> meshes;
  if (folder_.empty() && !downloads_.any()) return meshes;
  for (const tessera::VisualInfo& visual : visuals) {
    VisualFile* const file = Open(visual.sha256);
    if (file == nullptr) return {};
    const tinygltf::Mesh* const mesh = At(file->model.meshes, static_cast<int>(visual.mesh));
    Placing placing;
    std::copy_n(visual.position, 3, placing.position.begin());
    std::copy_n(visual.orientation, 4, placing.orientation.begin());
    std::copy_n(visual.scale, 3, placing.scale.begin());
    const std::string name = std::string(visual.sha256) + ".glb: mesh " + std::to_string(visual.mesh);
    if (mesh == nullptr) {
      Complain(name + " is missing", kShapes);
      return {};
    }
    for (const tinygltf::Primitive& primitive : mesh->primitives) {
      auto painted = PrimitiveOf(file->model, primitive, placing);
      if (!painted) {
        Complain(name + " is damaged", kShapes);
        return {};
      }
      painted->paint = PaintOf(*file, visual.sha256, primitive.material);
      meshes.push_back(*std::move(painted));
    }
  }
  return meshes;
}

}  // namespace desktop

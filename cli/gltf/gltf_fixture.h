// Levels made here, byte by byte, as exporters write them and as nobody should, for tests of the importer.
//
//   Level level;
//   level.Node({{"mesh", level.Square()}});
//   const GltfImport imported = Imported(level);
//
// Thread rule: one thread.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/gltf/gltf_import.h"
#include "core/world/scene_load.h"

namespace tessera::cli {

using nlohmann::json;

inline constexpr int kFloat = 5126, kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125;

// A level with one buffer, of which accessors are added one by one.
class Level {
 public:
  Level() {
    document = {{"asset", {{"version", "2.0"}}},
                {"scene", 0},
                {"scenes", json::array({{{"nodes", json::array()}}})},
                {"nodes", json::array()},
                {"meshes", json::array()},
                {"accessors", json::array()},
                {"bufferViews", json::array()}};
  }
  // Numbers of what was added.
  int Accessor(const std::vector<unsigned char>& bytes, int component, const char* type, std::size_t count) {
    while (buffer_.size() % 4 != 0) buffer_.push_back(0);
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                     {"componentType", component},
                                     {"type", type},
                                     {"count", count}});
    return static_cast<int>(document["accessors"].size()) - 1;
  }
  // A buffer view of these bytes.
  int View(const std::string& bytes) {
    while (buffer_.size() % 4 != 0) buffer_.push_back(0);
    document["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    return static_cast<int>(document["bufferViews"].size()) - 1;
  }
  template <std::size_t kParts>
  int Floats(const std::vector<std::array<float, kParts>>& values, const char* type) {
    std::vector<unsigned char> bytes(values.size() * sizeof values[0]);
    std::memcpy(bytes.data(), values.data(), bytes.size());
    return Accessor(bytes, kFloat, type, values.size());
  }
  int Positions(const std::vector<std::array<float, 3>>& positions) { return Floats<3>(positions, "VEC3"); }
  template <class T>
  int Indices(const std::vector<T>& indices, int component) {
    std::vector<unsigned char> bytes(indices.size() * sizeof(T));
    std::memcpy(bytes.data(), indices.data(), bytes.size());
    return Accessor(bytes, component, "SCALAR", indices.size());
  }
  int Mesh(const json& primitive) {
    document["meshes"].push_back({{"name", "m"}, {"primitives", json::array({primitive})}});
    return static_cast<int>(document["meshes"].size()) - 1;
  }
  // Two triangles on the ground, seen from above, of 2 x 2 m.
  int Square() {
    const int positions = Positions({{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}});
    const int indices = Indices<std::uint16_t>({0, 1, 2, 0, 2, 3}, kUnsignedShort);
    return Mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}});
  }
  int Node(json node, bool root = true) {
    document["nodes"].push_back(std::move(node));
    const int number = static_cast<int>(document["nodes"].size()) - 1;
    if (root) document["scenes"][0]["nodes"].push_back(number);
    return number;
  }
  int Shape(json shape) {
    json& shapes = document["extensions"]["OMI_physics_shape"]["shapes"];
    shapes.push_back(std::move(shape));
    return static_cast<int>(shapes.size()) - 1;
  }

  std::vector<std::uint8_t> Glb() const {
    json whole = document;
    if (!buffer_.empty()) whole["buffers"] = json::array({{{"byteLength", buffer_.size()}}});
    std::string text = whole.dump();
    while (text.size() % 4 != 0) text += ' ';
    std::vector<unsigned char> binary = buffer_;
    while (binary.size() % 4 != 0) binary.push_back(0);
    std::vector<std::uint8_t> glb;
    const auto word = [&](std::size_t value) {
      for (int shift = 0; shift < 32; shift += 8) glb.push_back(static_cast<std::uint8_t>(value >> shift));
    };
    word(0x46546C67);
    word(2);
    word(12 + 8 + text.size() + (binary.empty() ? 0 : 8 + binary.size()));
    word(text.size());
    word(0x4E4F534A);
    glb.insert(glb.end(), text.begin(), text.end());
    if (binary.empty()) return glb;
    word(binary.size());
    word(0x004E4942);
    glb.insert(glb.end(), binary.begin(), binary.end());
    return glb;
  }

  json document;

 private:
  std::vector<unsigned char> buffer_;
};

inline absl::StatusOr<GltfImport> Import(const Level& level) { return ImportGltf(level.Glb(), ".", "level"); }
inline GltfImport Imported(const Level& level) {
  auto imported = Import(level);
  EXPECT_TRUE(imported.ok()) << imported.status();
  if (!imported.ok()) return {};
  const auto loaded = LoadScene(imported->scene, "level");
  EXPECT_TRUE(loaded.ok()) << "what is imported can be run: " << loaded.status();
  return *std::move(imported);
}
inline std::string FaultOf(const Level& level) { return std::string(Import(level).status().message()); }

inline json Physics(const char* type, json more = json::object()) {
  more["type"] = type;
  return {{"motion", more}};
}

// The document inside of a binary file.
inline json DocumentOf(const std::string& glb) {
  std::uint32_t size = 0;
  if (glb.size() < 20) return {};
  std::memcpy(&size, glb.data() + 12, sizeof size);
  return json::parse(glb.substr(20, size));
}

inline absl::StatusOr<GltfImport> ImportAgain(const std::string& glb) {
  return ImportGltf({reinterpret_cast<const std::uint8_t*>(glb.data()), glb.size()}, "/nowhere", "again");
}

}  // namespace tessera::cli

// Meshes out of glTF files: where they are, how they are coloured and painted, and files that cannot be drawn.
#include "visuals.h"

#include <gtest/gtest.h>
#include <sodium.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "testing_volume.h"

namespace desktop {
namespace {

// PNG files: red and green above blue and white; and 1024 x 2 pixels, black and red by turns, half as green.
constexpr char kFourPixels[] =
    "89504e470d0a1a0a0000000d4948445200000002000000020802000000fdd49a73000000124944415478da63f8cfc0c0"
    "00c20cff8100001fee05fbf1abba770000000049454e44ae426082";
constexpr char kWide[] =
    "89504e470d0a1a0a0000000d494844520000040000000002080200000049f839cc000000274944415478daedd0310100"
    "000c0220c31a76b116441e029034d7902449929c5001499224b9e3032d89405b2c5f6c2c0000000049454e44ae426082";

std::string Unhexed(const std::string& hex) {
  std::string bytes(hex.size() / 2, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<char>(std::stoi(hex.substr(2 * i, 2), nullptr, 16));
  return bytes;
}

// A binary glTF file of one tetrahedron in orange, as `tessera scene import` writes them. With a picture it is painted
// with that, at the corners (0, 0), (1, 0), (0, 1) and (1, 1) of it, and its vertices have colours of their own.
std::string Tetrahedron(const std::string& picture = "") {
  std::string json =
      R"({"asset":{"version":"2.0"},"materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0.25,0,1]}}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":4},)"
      R"({"bufferView":1,"componentType":5125,"type":"SCALAR","count":12},)"
      R"({"bufferView":2,"componentType":5126,"type":"VEC2","count":4},)"
      R"({"bufferView":3,"componentType":5121,"type":"VEC4","count":4}],)"
      R"("bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":48},)"
      R"({"buffer":0,"byteOffset":96,"byteLength":32},{"buffer":0,"byteOffset":128,"byteLength":16},)"
      R"({"buffer":0,"byteOffset":144,"byteLength":SIZE}],"images":[{"bufferView":4,"mimeType":"image/png"}],)"
      R"("textures":[{"source":0}],"buffers":[{"byteLength":ALL}]})";
  const auto put = [&](const std::string& what, const std::string& with) {
    json.replace(json.find(what), what.size(), with);
  };
  if (!picture.empty()) {
    put("[1,0.25,0,1]", R"([1,0.25,0,1],"baseColorTexture":{"index":0})");
    put(R"("POSITION":0)", R"("POSITION":0,"TEXCOORD_0":2,"COLOR_0":3)");
  }
  const std::size_t size = 144 + (picture.size() + 3) / 4 * 4;
  put("SIZE", std::to_string(picture.size()));
  put("ALL", std::to_string(size));
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string glb;
  const auto words = [&](std::initializer_list<std::size_t> values) {
    for (const std::size_t value : values) {
      for (int shift = 0; shift < 32; shift += 8) glb += static_cast<char>(value >> shift & 255);
    }
  };
  const auto add = [&](const auto& list) {
    glb.append(reinterpret_cast<const char*>(list.data()), list.size() * sizeof list[0]);
  };
  words({0x46546C67, 2, 28 + json.size() + size, json.size(), 0x4E4F534A});
  glb += json;
  words({size, 0x004E4942});
  add(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
  add(std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  add(std::vector<float>{0, 0, 1, 0, 0, 1, 1, 1});
  add(std::vector<unsigned char>{255, 255, 255, 9, 255, 255, 255, 9, 255, 255, 255, 9, 51, 255, 255, 9});
  add(picture);
  glb.resize(glb.size() + size - 144 - picture.size(), '\0');
  return glb;
}

std::string Sha256Of(const std::string& bytes) {
  std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
  crypto_hash_sha256(digest.data(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  std::string hex(2 * digest.size() + 1, '\0');
  sodium_bin2hex(hex.data(), hex.size(), digest.data(), digest.size());
  return hex.substr(0, 2 * digest.size());
}

void Put(const std::string& sha256, const std::string& bytes) {
  std::ofstream(testing::TempDir() + "/" + sha256 + ".glb", std::ios::binary) << bytes;
}

TEST(VisualsTest, AMeshIsWhereItsVisualPutsItAndKeepsItsOutside) {
  const std::string glb = Tetrahedron(), sha256 = Sha256Of(glb);
  Put(sha256, glb);
  Visuals visuals(testing::TempDir());
  for (const double side : {1.0, -1.0}) {
    tessera::VisualInfo info = TESSERA_VISUAL_INFO;
    info.sha256 = sha256.c_str();
    info.scale[0] = 6 * side;
    info.position[1] = 10;
    const std::vector<Painted> meshes = visuals.MeshesOf({info});
    ASSERT_EQ(meshes.size(), 1u);
    EXPECT_NEAR(VolumeOf(meshes[0].mesh), 1, 1e-4) << side;
    EXPECT_EQ(meshes[0].paint, nullptr);
    for (const Vertex& vertex : meshes[0].mesh) {
      EXPECT_GE(vertex.position.y, 10);
      EXPECT_NEAR(vertex.colour.x, 1, 1e-6);
      EXPECT_NEAR(vertex.colour.y, 0.25, 1e-6);
      EXPECT_EQ(vertex.colour.z, 0);
    }
  }
  EXPECT_TRUE(visuals.TakeProblems().empty());
}

TEST(VisualsTest, AFileThatCannotBeDrawnIsSaidOnceAndLeavesTheShape) {
  const std::string glb = Tetrahedron(), cut = glb.substr(0, glb.size() - 50);
  Put(Sha256Of(glb), glb);
  Put(Sha256Of(cut), cut);
  const std::string other(64, 'a'), none(64, 'b');
  Put(other, glb);
  tessera::VisualInfo info = TESSERA_VISUAL_INFO;
  const auto problem_of = [&](const std::string& sha256, std::uint32_t mesh) {
    Visuals visuals(testing::TempDir());
    info.sha256 = sha256.c_str();
    info.mesh = mesh;
    EXPECT_TRUE(visuals.MeshesOf({info}).empty());
    EXPECT_TRUE(visuals.MeshesOf({info}).empty());
    const std::vector<std::string> problems = visuals.TakeProblems();
    EXPECT_EQ(problems.size(), 1u);
    return problems.empty() ? "" : problems[0];
  };
  EXPECT_NE(problem_of(none, 0).find("cannot be opened"), std::string::npos);
  EXPECT_NE(problem_of(other, 0).find("it has another hash"), std::string::npos);
  EXPECT_NE(problem_of(Sha256Of(cut), 0).find("is no binary glTF file"), std::string::npos);
  EXPECT_NE(problem_of(Sha256Of(glb), 7).find("mesh 7 is missing"), std::string::npos);
  std::string broken = glb;
  broken[broken.find("\"count\":4") + 8] = '9';  // more vertices than there are
  Put(Sha256Of(broken), broken);
  EXPECT_NE(problem_of(Sha256Of(broken), 0).find("mesh 0 is damaged"), std::string::npos);
  Visuals without("");
  EXPECT_TRUE(without.MeshesOf({info}).empty());
  EXPECT_TRUE(without.TakeProblems().empty()) << "nobody asked for meshes";
}

std::vector<Painted> Drawn(Visuals& visuals, const std::string& glb) {
  const std::string sha256 = Sha256Of(glb);
  Put(sha256, glb);
  tessera::VisualInfo info = TESSERA_VISUAL_INFO;
  info.sha256 = sha256.c_str();
  return visuals.MeshesOf({info});
}

TEST(VisualsTest, AMeshIsPaintedWithItsPictureAndTheColoursOfItsVertices) {
  Visuals visuals(testing::TempDir());
  const std::string glb = Tetrahedron(Unhexed(kFourPixels));
  const std::vector<Painted> meshes = Drawn(visuals, glb);
  ASSERT_EQ(meshes.size(), 1u);
  ASSERT_NE(meshes[0].paint, nullptr);
  EXPECT_EQ(meshes[0].paint->width, 2);
  EXPECT_EQ(meshes[0].paint->height, 2);
  EXPECT_EQ(meshes[0].paint->rgb, (std::vector<unsigned char>{255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}));
  // The last triangle has the corners 1, 2 and 3.
  const Mesh& mesh = meshes[0].mesh;
  ASSERT_EQ(mesh.size(), 12u);
  EXPECT_EQ(mesh[9].place, (std::array<float, 2>{1, 0}));
  EXPECT_EQ(mesh[10].place, (std::array<float, 2>{0, 1}));
  EXPECT_NEAR(mesh[11].colour.x, 0.2, 1e-6) << "a fifth, of one";
  EXPECT_NEAR(mesh[11].colour.y, 0.25, 1e-6);
  EXPECT_EQ(Drawn(visuals, glb)[0].paint, meshes[0].paint) << "it is read once";
  EXPECT_TRUE(visuals.TakeProblems().empty());
}

TEST(VisualsTest, ALargePictureIsDrawnSmaller) {
  Visuals visuals(testing::TempDir());
  const std::vector<Painted> meshes = Drawn(visuals, Tetrahedron(Unhexed(kWide)));
  ASSERT_EQ(meshes.size(), 1u);
  ASSERT_NE(meshes[0].paint, nullptr);
  EXPECT_EQ(meshes[0].paint->width, kMostPaintSide);
  EXPECT_EQ(meshes[0].paint->height, 1);
  const std::vector<unsigned char>& rgb = meshes[0].paint->rgb;
  ASSERT_EQ(rgb.size(), 3u * kMostPaintSide);
  EXPECT_EQ((std::array{rgb[0], rgb[1], rgb[2]}), (std::array<unsigned char, 3>{100, 100, 0})) << "the mean of two";
}

TEST(VisualsTest, APictureThatCannotBeDrawnIsSaidOnceAndLeavesTheColours) {
  std::string huge = Unhexed(kFourPixels), cut = huge.substr(0, 45);
  huge[18] = '\x40';
  const auto problem_of = [&](const std::string& picture) {
    Visuals visuals(testing::TempDir());
    const std::string glb = Tetrahedron(picture);
    for (int round = 0; round < 2; ++round) {
      const std::vector<Painted> meshes = Drawn(visuals, glb);
      EXPECT_EQ(meshes.size(), 1u);
      for (const Painted& painted : meshes) EXPECT_EQ(painted.paint, nullptr);
    }
    const std::vector<std::string> problems = visuals.TakeProblems();
    EXPECT_EQ(problems.size(), 1u);
    return problems.empty() ? "" : problems[0];
  };
  const std::string rest = "; its meshes have their base colour";
  EXPECT_NE(problem_of("GIF89a").find("picture 0 is no PNG or JPEG file" + rest), std::string::npos);
  EXPECT_NE(problem_of(cut).find("picture 0 is damaged" + rest), std::string::npos);
  EXPECT_NE(problem_of(huge).find("picture 0 has more than 4096 pixels along one side" + rest), std::string::npos);
}

TEST(VisualsTest, AFileThatNamesAnotherPictureIsRefused) {
  std::string glb = Tetrahedron(Unhexed(kFourPixels));
  const std::string own = R"({"bufferView":4,"mimeType":"image/png"})", other = R"({"uri":"picture.png"})";
  glb.replace(glb.find(own), own.size(), other + std::string(own.size() - other.size(), ' '));
  Visuals visuals(testing::TempDir());
  EXPECT_TRUE(Drawn(visuals, glb).empty());
  const std::vector<std::string> problems = visuals.TakeProblems();
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_NE(problems[0].find("names another file"), std::string::npos) << problems[0];
}

}  // namespace
}  // namespace desktop

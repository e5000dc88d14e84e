// The meshes of imported levels as they are drawn: their colours, places and pictures, and what cannot be kept.
#include "cli/gltf/gltf_visuals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "cli/gltf/gltf_fixture.h"
#include "core/world/proto_math.h"
#include "core/world/sha256.h"

namespace tessera::cli {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

TEST(GltfVisualsTest, MeshesAreKeptToBeDrawnWithTheirColours) {
  Level level;
  const json rough = {{"baseColorFactor", {0.8, 0.2, 0.1, 1}}, {"baseColorTexture", {{"index", 0}}}};
  level.document["materials"] = json::array({{{"pbrMetallicRoughness", rough}}});
  level.document["textures"] = json::array({{{"name", "bricks"}}});
  const int square = level.Square();
  level.document["meshes"][0]["primitives"][0]["material"] = 0;
  level.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
      level.Positions({{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {0, 1, 0}});
  level.Node({{"name", "floor"}, {"mesh", square}, {"translation", {0, 2, 0}}, {"scale", {5, 1, 3}}});
  const GltfImport imported = Imported(level);
  EXPECT_EQ(imported.drawn_triangles, 2u);
  EXPECT_EQ(imported.visual_sha256, Sha256Hex(imported.visual_file));
  ASSERT_EQ(imported.scene.bodies(0).shape().visuals_size(), 1);
  const v1::Visual& visual = imported.scene.bodies(0).shape().visuals(0);
  EXPECT_EQ(visual.sha256(), imported.visual_sha256);
  EXPECT_EQ(visual.mesh(), 0u);
  EXPECT_FALSE(visual.has_pose()) << "the body is where its node is";
  EXPECT_EQ(FromProto(visual.scale()), (Vec3d{5, 1, 3}));
  EXPECT_THAT(imported.notes, Contains("left out: 1 textures of surfaces, which are drawn in their base colour"));
  const json document = DocumentOf(imported.visual_file);
  EXPECT_EQ(document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"], json({0.8, 0.2, 0.1, 1}));
  EXPECT_TRUE(document["meshes"][0]["primitives"][0]["attributes"].contains("NORMAL"));
  EXPECT_EQ(document["accessors"][0]["max"], json({1, 0, 1}));
  EXPECT_EQ(document.dump().find("uri"), std::string::npos) << "it names no other file";
  const auto again = ImportAgain(imported.visual_file);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->triangles, 2u) << "other programs read it";
}

TEST(GltfVisualsTest, MeshesBelowABodyAreDrawnWhereTheyAreInIt) {
  Level level;
  const int box = level.Shape({{"type", "box"}, {"box", {{"size", {1, 2, 3}}}}});
  const int square = level.Square();
  json crate = Physics("dynamic", {{"mass", 5}});
  crate["collider"] = {{"shape", box}};
  const int lid = level.Node({{"mesh", square}, {"translation", {0, 1, 0}}, {"scale", {-0.5, 1, 1.5}}}, false);
  const double half = std::sqrt(0.5);
  level.Node({{"name", "crate"},
              {"translation", {7, 8, 9}},
              {"rotation", {0, half, 0, half}},
              {"children", json::array({lid})},
              {"extensions", {{"OMI_physics_body", crate}}}});
  level.Node({{"mesh", square}, {"translation", {20, 0, 0}}});
  const GltfImport imported = Imported(level);
  ASSERT_EQ(imported.scene.bodies_size(), 2);
  EXPECT_EQ(DocumentOf(imported.visual_file)["meshes"].size(), 1u) << "a mesh of two bodies is kept once";
  for (const v1::Body& body : imported.scene.bodies()) {
    ASSERT_EQ(body.shape().visuals_size(), 1) << body.name();
    if (body.name() != "crate") continue;
    const v1::Visual& visual = body.shape().visuals(0);
    EXPECT_NEAR(Length(FromProto(visual.pose().position()) - Vec3d{0, 1, 0}), 0, 1e-9);
    const Vec3d scale = FromProto(visual.scale());
    EXPECT_NEAR(scale.x * scale.y * scale.z, -0.75, 1e-9) << "mirrored";
    // Its corner (1, 0, 1) is where the level has it: the mirrored x, half as far, and z half as far again.
    const Vec3d corner = Rotate(FromProto(visual.pose().orientation()), Vec3d{scale.x, 0, scale.z});
    EXPECT_NEAR(Length(corner - Vec3d{-0.5, 0, 1.5}), 0, 1e-9);
  }
}

TEST(GltfVisualsTest, MeshesThatCannotBeDrawnLeaveTheirShapes) {
  Level sheared;
  const double c = std::cos(0.5), s = std::sin(0.5);
  const int child = sheared.Node({{"mesh", sheared.Square()}, {"rotation", {0, s, 0, c}}}, false);
  sheared.Node({{"scale", {3, 1, 1}}, {"children", json::array({child})}});
  const GltfImport flat = Imported(sheared);
  EXPECT_EQ(flat.scene.bodies(0).shape().visuals_size(), 0);
  EXPECT_EQ(flat.visual_file, "") << "nothing refers to it";
  EXPECT_THAT(flat.notes, Contains("left out: 1 sheared, flat or absurdly scaled meshes to draw"));

  Level damaged;
  const int box = damaged.Shape({{"type", "box"}});
  const int positions = damaged.Positions({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}});
  const int indices = damaged.Indices<std::uint32_t>({0, 1, 3}, kUnsignedInt);
  json crate = Physics("dynamic");
  crate["collider"] = {{"shape", box}};
  damaged.Node({{"mesh", damaged.Mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})},
                {"extensions", {{"OMI_physics_body", crate}}}});
  const GltfImport kept = Imported(damaged);
  EXPECT_EQ(kept.dynamic_bodies, 1u);
  EXPECT_EQ(kept.visual_file, "");
  EXPECT_THAT(kept.notes, Contains(HasSubstr("not drawn: mesh 0 \"m\": primitive 0: index 2 is 3, of 3 vertices")));
}

TEST(GltfVisualsTest, MoreThanAMillionTrianglesAreNotKept) {
  Level level;
  const int positions = level.Positions({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}});
  std::vector<std::uint32_t> corners(std::size_t{3} * 1'000'001);
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<std::uint32_t>(i % 3);
  const int indices = level.Indices<std::uint32_t>(corners, kUnsignedInt);
  level.Node({{"mesh", level.Mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}})}});
  const auto imported = Import(level);
  ASSERT_TRUE(imported.ok()) << imported.status();
  EXPECT_EQ(imported->triangles, 1'000'001u) << "they collide all the same";
  EXPECT_EQ(imported->visual_file, "");
  EXPECT_EQ(imported->scene.bodies(0).shape().visuals_size(), 0);
  EXPECT_THAT(imported->notes, Contains(HasSubstr("these have 1000001 triangles or more")));
}

// --- Colours and pictures.

// A PNG file of two by two pixels: red and green above blue and white.
std::string FourPixels() {
  return absl::HexStringToBytes(
      "89504e470d0a1a0a0000000d4948445200000002000000020802000000fdd49a73000000124944415478da63f8cfc0c0"
      "00c20cff8100001fee05fbf1abba770000000049454e44ae426082");
}

// A square on the ground that is painted with this picture.
Level PaintedSquare(const std::string& picture) {
  Level level;
  const int square = level.Square();
  json& primitive = level.document["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = level.Floats<2>({{0, 0}, {0, 1}, {1, 1}, {1, 0}}, "VEC2");
  primitive["material"] = 0;
  level.document["images"] = json::array({{{"bufferView", level.View(picture)}, {"mimeType", "image/png"}}});
  level.document["textures"] = json::array({{{"source", 0}}});
  level.document["materials"] = json::array({{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}});
  level.Node({{"mesh", square}});
  return level;
}

// The bytes of a buffer view of a binary file.
std::string BytesOf(const std::string& glb, const json& view) {
  std::uint32_t text = 0;
  std::memcpy(&text, glb.data() + 12, sizeof text);
  return glb.substr(28 + text + view["byteOffset"].get<std::size_t>(), view["byteLength"].get<std::size_t>());
}

std::vector<float> FloatsOf(const std::string& glb, const json& accessor) {
  const json document = DocumentOf(glb);
  const std::string bytes =
      BytesOf(glb, document["bufferViews"][document["accessors"][accessor.get<int>()]["bufferView"].get<int>()]);
  std::vector<float> floats(bytes.size() / sizeof(float));
  std::memcpy(floats.data(), bytes.data(), floats.size() * sizeof(float));
  return floats;
}

TEST(GltfVisualsTest, ThePictureOfAMaterialIsKeptWithThePlacesInIt) {
  const GltfImport imported = Imported(PaintedSquare(FourPixels()));
  const json document = DocumentOf(imported.visual_file);
  ASSERT_EQ(document["images"].size(), 1u) << document;
  EXPECT_EQ(document["images"][0]["mimeType"], "image/png");
  EXPECT_EQ(BytesOf(imported.visual_file, document["bufferViews"][document["images"][0]["bufferView"].get<int>()]),
            FourPixels());
  EXPECT_EQ(document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
  EXPECT_EQ(document["textures"][0]["source"], 0);
  const json& primitive = document["meshes"][0]["primitives"][0];
  EXPECT_EQ(FloatsOf(imported.visual_file, primitive["attributes"]["TEXCOORD_0"]),
            (std::vector<float>{0, 0, 0, 1, 1, 1, 1, 0}));
  EXPECT_EQ(document.dump().find("uri"), std::string::npos) << "it names no other file";
  const auto again = ImportAgain(imported.visual_file);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->visual_sha256, imported.visual_sha256) << "what is kept is kept as it is";
}

TEST(GltfVisualsTest, PlacesAreMovedTurnedAndScaledAsTheMaterialSays) {
  Level level = PaintedSquare(FourPixels());
  json& picture = level.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  const double quarter = std::acos(0.0);
  picture["extensions"]["KHR_texture_transform"] = {{"offset", {10, 20}}, {"scale", {2, 3}}, {"rotation", quarter}};
  const GltfImport imported = Imported(level);
  const json document = DocumentOf(imported.visual_file);
  const std::vector<float> places =
      FloatsOf(imported.visual_file, document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"]);
  // (0, 1) becomes (0, 3), then (3, 0), then (13, 20); (1, 0) becomes (2, 0), then (0, -2), then (10, 18).
  const std::vector<float> wanted = {10, 20, 13, 20, 13, 18, 10, 18};
  ASSERT_EQ(places.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(places[i], wanted[i], 1e-5) << i;
}

TEST(GltfVisualsTest, ColoursOfVerticesAreKeptInEachOfTheirForms) {
  const std::vector<float> wanted = {1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
  const std::vector<unsigned char> small = {255, 0, 0, 9, 0, 255, 0, 9, 0, 0, 255, 9, 255, 255, 255, 9};
  for (const bool floats : {true, false}) {
    Level level;
    const int square = level.Square();
    level.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        floats ? level.Floats<3>({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 7, 1}}, "VEC3")
               : level.Accessor(small, kUnsignedByte, "VEC4", 4);
    level.Node({{"mesh", square}});
    const GltfImport imported = Imported(level);
    const json document = DocumentOf(imported.visual_file);
    EXPECT_EQ(FloatsOf(imported.visual_file, document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]), wanted);
  }
}

TEST(GltfVisualsTest, APictureThatCannotBeDrawnLeavesTheBaseColourAndIsSaid) {
  const std::string whole = FourPixels();
  std::string huge = whole, garbled = whole;
  huge[18] = '\x40';  // 16384 pixels wide
  garbled.replace(41, 8, 8, '\xff');
  for (const auto& [file, why] :
       {std::pair(std::string("GIF89a"), "picture 0 is no PNG or JPEG file; it is not drawn"),
        std::pair(whole.substr(0, 20), "picture 0 is damaged: its head has no size; it is not drawn"),
        std::pair(garbled, "picture 0 is damaged: it cannot be decoded; it is not drawn"),
        std::pair(huge, "picture 0 has 16386 x 2 pixels, more than 4096 along one side; it is not drawn"),
        std::pair(std::string("\xff\xd8\xff\xc0\0\x0b\x08\0\x10\x20\0", 11),
                  "picture 0 has 8192 x 16 pixels, more than 4096 along one side; it is not drawn")}) {
    const GltfImport imported = Imported(PaintedSquare(file));
    EXPECT_THAT(imported.notes, Contains(why));
    EXPECT_THAT(imported.notes, Contains("left out: 1 textures of surfaces, which are drawn in their base colour"));
    const json document = DocumentOf(imported.visual_file);
    EXPECT_FALSE(document.contains("images"));
    EXPECT_FALSE(document["meshes"][0]["primitives"][0]["attributes"].contains("TEXCOORD_0"));
  }
}

TEST(GltfVisualsTest, PicturesOfTooManyPixelsTogetherAreNotDecoded) {
  const auto kind = CheckPicture(FourPixels(), 4);
  ASSERT_TRUE(kind.ok()) << kind.status();
  EXPECT_EQ(kind->pixels, 4u);
  EXPECT_THAT(std::string(CheckPicture(FourPixels(), 3).status().message()), HasSubstr("pixels together"));
}

TEST(GltfVisualsTest, APictureThatReachesBeyondItsBufferIsNotRead) {
  Level level = PaintedSquare(FourPixels());
  level.document["bufferViews"].back()["byteLength"] = 1'000'000'000;
  const auto imported = Import(level);
  if (imported.ok()) {
    EXPECT_THAT(imported->notes, Contains(HasSubstr("picture 0 is no PNG or JPEG file")));
  } else {
    EXPECT_THAT(std::string(imported.status().message()), HasSubstr("buffer"));
  }
}

TEST(GltfVisualsTest, NoMorePicturesAreKeptThanAreDrawn) {
  Level level = PaintedSquare(FourPixels());
  const json primitive = level.document["meshes"][0]["primitives"][0], image = level.document["images"][0];
  for (int i = 1; i <= static_cast<int>(kMaxPictures); ++i) {
    level.document["images"].push_back(image);
    level.document["textures"].push_back({{"source", i}});
    level.document["materials"].push_back({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", i}}}}}});
    json more = primitive;
    more["material"] = i;
    level.document["meshes"][0]["primitives"].push_back(more);
  }
  const GltfImport imported = Imported(level);
  EXPECT_EQ(DocumentOf(imported.visual_file)["images"].size(), kMaxPictures);
  EXPECT_THAT(imported.notes, Contains("left out: 1 textures of surfaces, which are drawn in their base colour"));
}

}  // namespace
}  // namespace tessera::cli

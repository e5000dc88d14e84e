#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <string>

#include "core/world/scene_io.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string ParseError(const std::string& text) {
  const auto scene = ParseScene(text, "a/b.scene");
  EXPECT_EQ(scene.status().code(), absl::StatusCode::kInvalidArgument);
  const std::string message(scene.status().message());
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  return message;
}

TEST(ParseSceneTest, ReadsTextAndJsonAlike) {
  const auto text =
      ParseScene("# a comment\n name: \"x\" bodies { id: 7 mass: 0.5 shape { sphere { radius: 1 } } }", "t");
  const auto json = ParseScene(
      "\n\t {\"name\": \"x\", \"bodies\": [{\"id\": 7, \"mass\": 0.5, \"shape\": {\"sphere\": "
      "{\"radius\": 1}}}]}",
      "j");
  ASSERT_TRUE(text.ok()) << text.status();
  ASSERT_TRUE(json.ok()) << json.status();
  EXPECT_EQ(text->SerializeAsString(), json->SerializeAsString());
  EXPECT_EQ(text->bodies(0).id(), 7u);
}

TEST(ParseSceneTest, TextErrorsNameLineAndColumn) {
  EXPECT_THAT(ParseError("name: \"x\"\nbodies { id: 1\n  colour: \"red\" }"),
              StartsWith("a/b.scene:3:9: Message type \"tessera.v1.Body\" has no field named \"colour\""));
  EXPECT_THAT(ParseError("name: \"x\nbodies {}"), StartsWith("a/b.scene:1:9: "));
  EXPECT_THAT(ParseError("bodies { id: -1 }"), StartsWith("a/b.scene:1:14: "));
  EXPECT_THAT(ParseError("bodies { id: 1"), StartsWith("a/b.scene:1:15: "));
  EXPECT_THAT(ParseError("bodies { motion: MOTION_WILD }"), HasSubstr("MOTION_WILD"));
  EXPECT_THAT(ParseError("bodies { shape { teapot {} } }"), HasSubstr("no field named \"teapot\""));
  EXPECT_THAT(ParseError("bodies { shape { sphere {} box {} } }"), HasSubstr("a/b.scene:1:32: Field \"box\""));
}

TEST(ParseSceneTest, JsonErrorsNameLineAndColumnOrTheField) {
  EXPECT_THAT(ParseError("{\n  \"name\": \"x\",\n  \"tickRateHz\" 60\n}"), StartsWith("a/b.scene:3:16: Expected :"));
  EXPECT_THAT(ParseError("{\"bodies\": [{},\n  {\"id\": 1, \"colour\": 1}]}"),
              StartsWith("a/b.scene:2:13: (bodies[1]) colour: "));
  EXPECT_THAT(ParseError("{\"bodies\": [{\n\"mass\":\n\"heavy\"}]}"), StartsWith("a/b.scene:2:1: (bodies[0].mass): "));
  EXPECT_THAT(ParseError("{\n\"tickRateHz\": 0.5}"), StartsWith("a/b.scene:2:1: (tick_rate_hz): "));
  EXPECT_THAT(ParseError("{\"scale\": 3}"), StartsWith("a/b.scene:1:2: scale: "));
  EXPECT_THAT(ParseError("{\"bodies\": [{}, 3]}"), StartsWith("a/b.scene:1:17: (bodies[1]): "));
  EXPECT_THAT(ParseError("{"), StartsWith("a/b.scene:"));
  EXPECT_THAT(ParseError("{\"name\": \"x\"} trailing"), StartsWith("a/b.scene:"));
}

// A recursion that follows the input would end the process.
TEST(ParseSceneTest, RefusesNestingWithoutEnd) {
  std::string text, json;
  for (int i = 0; i < 100'000; ++i) {
    text += "compound { children { shape { ";
    json += "{\"compound\": {\"children\": [{\"shape\": ";
  }
  EXPECT_THAT(ParseError("bodies { shape { " + text), StartsWith("a/b.scene:"));
  EXPECT_THAT(ParseError("{\"bodies\": [{\"shape\": " + json), StartsWith("a/b.scene:"));
}

TEST(ParseSceneTest, ToleratesAnyBytes) {
  const std::string text = "name: \"x\" bounds { min { x: -1 } } bodies { id: 1 shape { hull { points { x: 1 } } } }";
  const std::string json = "{\"name\": \"x\", \"bodies\": [{\"id\": 7, \"mass\": 0.5}]}";
  for (const std::string& sound : {text, json}) {
    for (std::size_t at = 0; at < sound.size(); ++at) {
      for (int value = 0; value < 256; value += 5) {
        std::string broken = sound;
        broken[at] = static_cast<char>(value);
        const auto scene = ParseScene(broken, "f");
        if (scene.ok()) {
          const auto resolved = ResolveScene(*scene, "f");
          EXPECT_FALSE(resolved.ok());
        }
      }
      const auto cut = ParseScene(sound.substr(0, at), "f");
      EXPECT_TRUE(cut.ok() || cut.status().code() == absl::StatusCode::kInvalidArgument);
    }
  }
}

TEST(ParseSceneTest, SaysOfAFileThatIsNoTextWhatItIs) {
  const auto why = [](std::string_view content, std::string_view file) {
    return std::string(ParseScene(content, file).status().message());
  };
  EXPECT_EQ(why("", "a.json"), "a.json: is empty");
  EXPECT_EQ(why(" \r\n\t", "a.textproto"), "a.textproto: is empty");
  EXPECT_EQ(why("\xEF\xBB\xBF", "a.json"), "a.json: is empty");
  const std::string glb("glTF\2\0\0\0\xFF", 9);
  EXPECT_EQ(why(glb, "level.glb"), "level.glb: is a glTF level; tessera scene import makes a scene of it");
  EXPECT_EQ(why("{\"asset\": {}}", "a.GLTF"), "a.GLTF: is a glTF level; tessera scene import makes a scene of it");
  const std::string not_text = "a.json: is not text in UTF-8; a scene is JSON, or protobuf's text format";
  EXPECT_EQ(why("\xFF\xFE{", "a.json"), not_text);
  EXPECT_EQ(why(std::string("{\0}", 3), "a.json"), not_text);
}

TEST(ParseSceneTest, PassesOverTheMarkThatSomeEditorsWrite) {
  for (const char* text : {"\xEF\xBB\xBF{\"name\": \"x\"}", "\xEF\xBB\xBFname: \"x\""}) {
    const auto scene = ParseScene(text, "f");
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_EQ(scene->name(), "x");
  }
}

TEST(ParseSceneTest, NothingIsASceneThatResolveRefuses) {
  for (const char* text : {"# only a comment", "{}"}) {
    const auto scene = ParseScene(text, "f");
    ASSERT_TRUE(scene.ok()) << scene.status();
    EXPECT_FALSE(ResolveScene(*scene, "f").ok());
  }
}

}  // namespace
}  // namespace tessera

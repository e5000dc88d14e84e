// The Lua examples of docs/games.md, run in the world of a new game. A block that begins with "-- refused: TEXT" is a
// game that must be refused with this text; one that calls `test` is run as a script; any other one is a game.
#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/world/scene_load.h"
#include "game_sdk/lua/lua_module.h"
#include "game_sdk/testing/game_tests.h"
#include "game_sdk/tools/check.h"
#include "game_sdk/tools/new_game.h"

namespace tessera::game {
namespace {

using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Example {
  int line = 0;
  std::string text;
};

std::vector<Example> ReadExamples() {
  std::ifstream file(std::string(TESSERA_SOURCE_DIR) + "/docs/games.md");
  std::vector<Example> examples;
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (line.rfind("```", 0) == 0) {
      inside = line == "```lua";
      if (inside) examples.push_back({number, ""});
    } else if (inside) {
      examples.back().text += line + "\n";
    }
  }
  return examples;
}

class DocumentTest : public ::testing::Test {
 protected:
  DocumentTest() {
    for (const GameFile& file : NewGame("example")) files_[file.name] = file;
    auto loaded = LoadScene(SceneForm::kText, files_["scene.json"].bytes, "scene.json");
    EXPECT_TRUE(loaded.ok()) << loaded.status();
    scene_ = loaded->scene;
  }
  // A script in which nothing happens runs the game for two seconds.
  void ExpectToPass(const GameFile& game, const std::string& script) {
    const auto failed =
        RunGameTests({*LuaGameModule(), game, scene_}, {"example", script}, {}, [](const GameTestResult& result) {
          for (const GameTestFailure& failure : result.failures) {
            ADD_FAILURE() << failure.text << ": " << failure.conditions.front();
          }
        });
    EXPECT_TRUE(failed.ok()) << failed.status();
  }

  std::map<std::string, GameFile> files_;
  std::shared_ptr<const Scene> scene_;
};

TEST_F(DocumentTest, ExamplesDoWhatTheDocumentSays) {
  constexpr std::string_view kRefused = "-- refused: ";
  const std::vector<Example> examples = ReadExamples();
  EXPECT_GE(examples.size(), 5U);
  for (const Example& example : examples) {
    SCOPED_TRACE("docs/games.md:" + std::to_string(example.line));
    const GameFile game{"example.lua", example.text};
    if (example.text.starts_with(kRefused)) {
      const std::string text = example.text.substr(kRefused.size(), example.text.find('\n') - kRefused.size());
      EXPECT_THAT(CheckGame(game, *scene_), Contains(Field(&GameFault::text, text)));
      const auto refused = RunGameTests({*LuaGameModule(), game, scene_}, {"x", "test('x', function() end)"}, {},
                                        [](const GameTestResult&) {});
      EXPECT_THAT(std::string(refused.status().message()), HasSubstr(text));
    } else if (example.text.find("test(\"") != std::string::npos) {
      ExpectToPass(files_["game.lua"], example.text);
    } else {
      EXPECT_THAT(CheckGame(game, *scene_), IsEmpty());
      ExpectToPass(game, "test('runs', function(t) t:step(120) end)");
    }
  }
}

}  // namespace
}  // namespace tessera::game

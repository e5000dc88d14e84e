// docs/games.md and the annotations against the table.
#include "game_sdk/tools/reference.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "game_sdk/api/api.h"
#include "lua.hpp"

namespace tessera::game {
namespace {

using ::testing::HasSubstr;

std::string DocumentOfGames() {
  std::ifstream file(std::string(TESSERA_SOURCE_DIR) + "/docs/games.md");
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

TEST(ReferenceTest, TheDocumentIsWhatTheTableGives) {
  const std::string document = DocumentOfGames();
  const absl::StatusOr<std::string> anew = WithReference(document);
  ASSERT_TRUE(anew.ok()) << anew.status();
  EXPECT_TRUE(*anew == document)
      << "docs/games.md has another table of functions and callbacks than game_sdk/api/api.cpp. To renew it: "
         "build/dev/bin/tessera game reference docs/games.md";
}

TEST(ReferenceTest, NamesAllFunctionsAndCallbacks) {
  const std::string reference = GameReference(), annotations = GameAnnotations();
  for (const Function& function : Functions()) {
    EXPECT_THAT(reference, HasSubstr(std::string(function.name) + "("));
    EXPECT_THAT(annotations, HasSubstr(std::string(function.name) + "("));
  }
  for (const Callback& callback : Callbacks()) {
    EXPECT_THAT(reference, HasSubstr("| `" + std::string(callback.name) + "("));
    EXPECT_THAT(annotations, HasSubstr(std::string(callback.name)));
  }
  EXPECT_THAT(reference, HasSubstr("`body:impulse(impulse[, point])`"));
  EXPECT_THAT(annotations, HasSubstr("---@param point? Vector"));
  EXPECT_THAT(annotations,
              HasSubstr("---@field on_contact? fun(self: Body, other: Body, contact: nil|table<string, any>)"));
}

TEST(ReferenceTest, TheAnnotationsAreLua) {
  const std::string annotations = GameAnnotations();
  EXPECT_EQ(annotations.rfind("---@meta\n", 0), 0U);
  lua_State* const L = luaL_newstate();
  EXPECT_EQ(luaL_dostring(L, annotations.c_str()), LUA_OK) << lua_tostring(L, -1);
  lua_close(L);
}

TEST(ReferenceTest, ADocumentWithoutItsPlaceIsRefused) {
  EXPECT_THAT(std::string(WithReference("# Games\n").status().message()), HasSubstr("no place for the reference"));
}

}  // namespace
}  // namespace tessera::game

// LuaModuleTest: a game in Lua, loaded and run against a FakeHost. For tests of the Lua module.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "game_sdk/lua/lua_module.h"
#include "game_sdk/lua/testing/fake_host.h"

namespace tessera::game {

// The error of a callback in line 2 that did too much.
inline constexpr char kTooMuchWork[] = "game.lua:2: too much work";

class LuaModuleTest : public ::testing::Test {
 protected:
  ~LuaModuleTest() override { Unload(); }

  void Unload() {
    if (game_ != nullptr) module_->unload(game_);
    game_ = nullptr;
  }

  // Returns the error, empty if there is none.
  std::string Load(const std::string& source) {
    Unload();
    const tessera_game_source file{sizeof file, "game.lua", source.data(), source.size()};
    tessera_game_error error{};
    const int status = module_->load(&host_.abi, &file, &game_, &error);
    EXPECT_EQ(status != 0, game_ == nullptr);
    EXPECT_EQ(status != 0, error.text[0] != '\0');
    return error.text;
  }

  std::string Run(std::uint32_t callback, const char* kind, const std::vector<tessera_game_value>& arguments) {
    const tessera_game_callback event{sizeof event, callback, kind, arguments.data(),
                                      static_cast<std::uint32_t>(arguments.size())};
    tessera_game_error error{};
    host_.work = 0;
    const int status = module_->run(game_, &host_.call, &event, &error);
    EXPECT_EQ(status != 0, error.text[0] != '\0');
    EXPECT_EQ(std::string(error.text).find('\n'), std::string::npos);
    return error.text;
  }

  std::string Tick() { return Run(kOnTick, nullptr, {}); }
  // Body 2 touches body 3.
  std::string Contact() { return Run(kOnBodyContact, "crate", {Body(2), Body(3)}); }

  // Runs the statements as a contact of a crate.
  std::string OnContact(const std::string& statements) {
    EXPECT_EQ(Load("kinds.crate = { on_contact = function(self, other)\n" + statements + "\nend }"), "");
    return game_ == nullptr ? "" : Contact();
  }

  // Gives what the expression prints, or the error.
  std::string Value(const std::string& expression) {
    host_.lines.clear();
    const std::string error = OnContact("print(" + expression + ")");
    if (!error.empty()) return error;
    return host_.lines.empty() ? "" : host_.lines.back().substr(5, host_.lines.back().size() - 7);
  }

  const tessera_game_module* module_ = LuaGameModule();
  FakeHost host_;
  void* game_ = nullptr;
};

}  // namespace tessera::game

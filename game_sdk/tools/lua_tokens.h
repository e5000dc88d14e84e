// The tokens of a Lua source.
//
//   for (const LuaToken& token : LuaTokens(source)) ...
//
// Thread rule: functions of their arguments.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace tessera::game {

enum class LuaTokenKind : std::uint8_t { kName, kWord, kText, kNumber, kSign, kEnd };  // kWord: "local", "end" ...

struct LuaToken {
  LuaTokenKind kind = LuaTokenKind::kEnd;
  int line = 0;
  std::string_view text;  // in the source; of a text what is between its quotes, as it is written

  bool Is(std::string_view word) const {
    return (kind == LuaTokenKind::kWord || kind == LuaTokenKind::kSign) && text == word;
  }
};

// Requires a source that Lua compiles. Ends in a token of kind kEnd.
std::vector<LuaToken> LuaTokens(std::string_view source);

}  // namespace tessera::game

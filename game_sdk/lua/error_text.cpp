#include "game_sdk/lua/error_text.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

const char* NameOf(End end) {
  switch (end) {
    case End::kNone:
      return "";
    case End::kWork:
      return "too much work";
    case End::kMemory:
      return "too much memory";
    case End::kDepth:
      return "calls are nested too deeply, or have too many arguments";
    case End::kLongText:
      return "a text of more than 64 KiB";
  }
  return "";
}

int PushErrorText(lua_State* L) {
  PushText(L, 1, nullptr);
  return 1;
}

// Pushes what the error at `index` says, although its __tostring may fail.
void PushErrorTextSafely(lua_State* L, int index) {
  if (luaL_getmetafield(L, index, "__tostring") != LUA_TNIL) {
    lua_pop(L, 1);
    lua_pushcfunction(L, PushErrorText);
    lua_pushvalue(L, index);
    if (lua_pcall(L, 1, 1, 0) == LUA_OK) return;
    lua_pop(L, 1);
  }
  lua_pushfstring(L, "an error that is %s", ValueName(L, index));
}

bool BeginsWithFile(std::string_view text, std::string_view chunk) {
  return text.starts_with(chunk) && text.substr(chunk.size()).starts_with(':');
}

// Appends to the error, without control bytes, and cuts at a whole character.
void Append(std::string_view text, std::size_t& used, tessera_game_error& error) {
  constexpr std::size_t kLast = sizeof error.text - 1;
  for (const char letter : text) {
    if (used == kLast) break;
    const auto byte = static_cast<unsigned char>(letter);
    error.text[used++] = byte == '\n' || byte == '\t' || byte == '\r' ? ' '
                         : byte < 0x20 || byte == 0x7f                ? '?'
                                                                      : letter;
  }
  if (used == kLast) {
    while (used > kLast - 4 && (static_cast<unsigned char>(error.text[used - 1]) & 0xc0) == 0x80) --used;
    if (static_cast<unsigned char>(error.text[used - 1]) >= 0xc0) --used;
  }
  error.text[used] = '\0';
}

}  // namespace

int HandleError(lua_State* L) {
  Runtime& runtime = Runtime::Of(L);
  if (runtime.ended()) return 1;
  runtime.NoteWhere();
  lua_settop(L, 1);
  if (lua_type(L, 1) == LUA_TSTRING) return 1;
  char where[sizeof(tessera_game_error::text)];
  std::snprintf(where, sizeof where, "%s", runtime.where());
  PushErrorTextSafely(L, 1);
  // __tostring may have noted another place.
  if (!runtime.ended() && where[0] != '\0') {
    lua_pushfstring(L, "%s: %s", where, lua_tostring(L, -1));
  }
  return 1;
}

void WriteCallError(const Runtime& runtime, int fallback_line, tessera_game_error& error) {
  const std::string_view chunk = runtime.chunk();
  std::string_view text = NameOf(runtime.end());
  // Only of a text, which no conversion has to make: that would need memory.
  if (!runtime.ended() && lua_type(runtime.lua(), -1) == LUA_TSTRING) {
    std::size_t bytes = 0;
    const char* const raised = lua_tolstring(runtime.lua(), -1, &bytes);
    text = {raised, bytes};
  }
  if (text.empty()) text = "an error without a text";
  char line[16] = "";
  if (fallback_line != 0) std::snprintf(line, sizeof line, ":%d", fallback_line);
  std::size_t used = 0;
  if (!BeginsWithFile(text, chunk)) {
    if (runtime.where()[0] != '\0') {
      Append(runtime.where(), used, error);
    } else {
      Append(chunk, used, error);
      Append(line, used, error);
    }
    Append(": ", used, error);
  }
  Append(text, used, error);
}

void WriteError(const char* chunk, std::string_view text, tessera_game_error& error) {
  std::size_t used = 0;
  if (!BeginsWithFile(text, chunk)) {
    Append(chunk, used, error);
    Append(": ", used, error);
  }
  Append(text, used, error);
}

}  // namespace tessera::game

#include "game_sdk/lua/format.h"

#include <cstdio>
#include <cstring>

#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_state.h"
#include "game_sdk/lua/values.h"

namespace tessera::game {
namespace {

// One conversion, such as %-5.2f.
struct Conversion {
  char text[16];  // as printf takes it, but for a length modifier
  std::size_t bytes;
  char letter;
};

bool IsDigit(char letter) { return letter >= '0' && letter <= '9'; }

// Reads the conversion behind a % at `in`. Returns what is behind it.
const char* ReadConversion(lua_State* L, const char* in, Conversion& conversion) {
  const char* const begin = in;
  while (*in != '\0' && std::strchr("-+ #0", *in) != nullptr && in - begin < 5) ++in;
  for (int digits = 0; digits < 2 && IsDigit(*in); ++digits) ++in;
  if (*in == '.') {
    ++in;
    for (int digits = 0; digits < 2 && IsDigit(*in); ++digits) ++in;
  }
  conversion.letter = *in;
  conversion.bytes = static_cast<std::size_t>(in - begin) + 1;
  conversion.text[0] = '%';
  std::memcpy(conversion.text + 1, begin, conversion.bytes - 1);
  conversion.text[conversion.bytes] = '\0';
  if (*in == 'p') Raise(L, "string.format: there is no %%p; addresses differ from run to run");
  if (*in == '\0' || std::strchr("dicxXoeEfgGaAs", *in) == nullptr) {
    Raise(L, "string.format: `%s%c` is unknown", conversion.text, *in == '\0' ? ' ' : *in);
  }
  return in + 1;
}

void Complete(Conversion& conversion, const char* modifier_and_letter) {
  std::strcpy(conversion.text + conversion.bytes, modifier_and_letter);
}

lua_Integer ToInteger(lua_State* L, int argument) {
  int whole = 0;
  const lua_Integer value = lua_tointegerx(L, argument, &whole);
  if (lua_type(L, argument) != LUA_TNUMBER || whole == 0) {
    Raise(L, "string.format: value %d must be a whole number, got %s", argument - 1, ValueName(L, argument));
  }
  return value;
}

lua_Number ToReal(lua_State* L, int argument) {
  if (lua_type(L, argument) != LUA_TNUMBER) {
    Raise(L, "string.format: value %d must be a number, got %s", argument - 1, ValueName(L, argument));
  }
  return lua_tonumber(L, argument);
}

// Writes a number; the longest is 1e308 by %f with a precision of 99. Returns the count of bytes.
int WriteNumber(lua_State* L, Conversion& conversion, int argument, char (&out)[512]) {
  if (conversion.letter == 'c') {
    Complete(conversion, "c");
    return std::snprintf(out, sizeof out, conversion.text, static_cast<int>(ToInteger(L, argument) & 0xff));
  }
  if (std::strchr("dixXo", conversion.letter) != nullptr) {
    const char modified[] = {'l', 'l', conversion.letter, '\0'};
    Complete(conversion, modified);
    return std::snprintf(out, sizeof out, conversion.text, static_cast<long long>(ToInteger(L, argument)));
  }
  const char letter[] = {conversion.letter, '\0'};
  Complete(conversion, letter);
  return std::snprintf(out, sizeof out, conversion.text, ToReal(L, argument));
}

// Adds a text. Width and precision apply to the first 100 bytes of it, as Lua's do to short texts.
std::size_t AddText(lua_State* L, luaL_Buffer* buffer, Conversion& conversion, int argument) {
  std::size_t bytes = 0;
  const char* const text = PushText(L, argument, &bytes);
  lua_replace(L, argument);  // where it stays alive, since the buffer wants the top of the stack
  ChargeText(L, bytes);
  if (conversion.bytes == 1 || (bytes >= 100 && std::strchr(conversion.text, '.') == nullptr)) {
    luaL_addlstring(buffer, text, bytes);
    return bytes;
  }
  if (std::memchr(text, '\0', bytes) != nullptr) Raise(L, "string.format: value %d contains zeros", argument - 1);
  Complete(conversion, "s");
  char out[256];
  const auto written = static_cast<std::size_t>(std::snprintf(out, sizeof out, conversion.text, text));
  luaL_addlstring(buffer, out, written);
  return written;
}

}  // namespace

int Format(lua_State* L) {
  std::size_t bytes = 0;
  const char* in = luaL_checklstring(L, 1, &bytes);
  const char* const end = in + bytes;
  const int given = lua_gettop(L);
  ChargeText(L, bytes);
  luaL_Buffer buffer;
  luaL_buffinit(L, &buffer);
  int argument = 1;
  std::size_t total = 0;
  while (in < end) {
    const auto* const percent = static_cast<const char*>(std::memchr(in, '%', static_cast<std::size_t>(end - in)));
    const char* const plain_end = percent == nullptr ? end : percent;
    luaL_addlstring(&buffer, in, static_cast<std::size_t>(plain_end - in));
    total += static_cast<std::size_t>(plain_end - in);
    if (percent == nullptr) break;
    in = percent + 1;
    if (*in == '%') {
      luaL_addchar(&buffer, *in++);
      ++total;
      continue;
    }
    Conversion conversion;
    in = ReadConversion(L, in, conversion);
    if (++argument > given) Raise(L, "string.format: value %d is missing", argument - 1);
    if (conversion.letter == 's') {
      total += AddText(L, &buffer, conversion, argument);
    } else {
      char out[512];
      const auto written = static_cast<std::size_t>(WriteNumber(L, conversion, argument, out));
      luaL_addlstring(&buffer, out, written);
      total += written;
      Charge(L, 20 + written * written / 64);  // long numbers are written by long division
    }
    if (total > kMaxTextBytes) Raise(L, "string.format: the text has more than 64 KiB");
  }
  luaL_pushresult(&buffer);
  return 1;
}

}  // namespace tessera::game

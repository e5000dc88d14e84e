// Kept state: finds functions that write a variable which outlives the callback, such as
//
//   local n = 0
//   function on_tick() n = n + 1 end
//
// Such a variable would be lost when the region dies or hands a body over. Lua's functions do not say what they write,
// so it is read from the compiled file, in the format that lua_dump of Lua 5.4 writes; anything else is refused.
//
// Thread rule: values.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "lua.hpp"

namespace tessera::game {

struct Upvalue {
  std::string name;
  int written_line = 0;  // where the function or one within it writes the variable; 0 for never
};

// A function as it is written in the file; each run of its definition makes a closure.
struct Prototype {
  int line = 0, last_line = 0;  // both 0 for the file itself
  int parameters = 0;
  bool vararg = false;
  std::vector<Upvalue> upvalues;
};

// Reads the functions of the Lua function on top of the stack. Returns false and why if that is not possible. Throws
// only std::bad_alloc, and raises no Lua error.
bool ReadPrototypes(lua_State* L, std::vector<Prototype>& prototypes, std::string& error);

// Raises an error if the Lua function at `index` writes an upvalue. Functions that cannot be told apart by their lines
// and variables count as one.
void RequireNoKeptState(lua_State* L, int index, const std::vector<Prototype>& prototypes);

}  // namespace tessera::game

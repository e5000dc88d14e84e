// string.format for game code.
//
// Thread rule: as lua_State.
#pragma once

#include "lua.hpp"

namespace tessera::game {

// format(text, ...): %d %i %c %x %X %o %e %E %f %g %G %a %A %s %%, with flags, width and precision of up to two digits.
// There is neither %p, since addresses differ from run to run, nor %q.
int Format(lua_State* L);

}  // namespace tessera::game

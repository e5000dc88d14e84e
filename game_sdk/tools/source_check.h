// The part of CheckGame that looks through a source.
//
// Thread rule: a function of its arguments.
#pragma once

#include <vector>

#include "core/world/scene.h"
#include "game_sdk/tools/check.h"
#include "game_sdk/tools/lua_tree.h"

namespace tessera::game {

// In no order; the same fault may stand there twice.
std::vector<GameFault> CheckSource(const LuaNode& tree, const Scene& scene);

}  // namespace tessera::game

// ScriptRun: one run of a test that is written in Lua. The script has what game code has, and `test`:
//
//   test("a ball that falls scores", function(t)
//     t:step(60)
//     t:expect_equal(t:body("ball").score, 1)
//   end)
//
// docs/games.md lists what `t` does. Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/game_host.h"
#include "game_sdk/testing/script_world.h"

namespace tessera::game {

inline constexpr std::size_t kMaxTests = 1000;  // the most in one file

// The names of a script's tests, in its order. INVALID_ARGUMENT: one line with file and line.
absl::StatusOr<std::vector<std::string>> ListTests(const GameFile& script);

// Runs one of the tests that ListTests names. Returns why it failed in one line with file and line, or nothing.
std::string RunTest(const GameFile& script, std::size_t index, ScriptWorld& world);

}  // namespace tessera::game

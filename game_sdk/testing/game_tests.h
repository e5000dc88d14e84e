// GameTests: runs the tests of a game (script_run.h), each of them several times: in one region, in several, with the
// game's code loaded anew before callbacks, and while regions die. A test has to hold each time, and fresh states must
// change nothing at all.
//
//   auto failed = RunGameTests({*LuaGameModule(), game, scene}, script, {}, [](const GameTestResult& r) { print(r); });
//
// Thread rule: one thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/game/game_host.h"

namespace tessera::game {

struct GameUnderTest {
  const tessera_game_module& module;
  GameFile game;
  std::shared_ptr<const Scene> scene;
};

struct GameTestOptions {
  std::uint32_t regions = 4;
  std::uint64_t seed = 1;
};

struct GameTestFailure {
  std::string text;                     // one line, with file and line of the script
  std::vector<std::string> conditions;  // under which it failed so: "4 regions, deaths"
};

struct GameTestResult {
  std::string name;
  std::vector<GameTestFailure> failures;
  std::vector<std::string> output;  // lines that the script printed in the first run
  std::uint64_t ticks = 0;          // all runs together
  std::uint64_t handovers = 0, deaths = 0;
};

// Calls `done` after each test. Returns how many failed, or INVALID_ARGUMENT: the game or the script cannot be loaded,
// or there is no test in it.
absl::StatusOr<std::size_t> RunGameTests(const GameUnderTest& tested, const GameFile& script,
                                         const GameTestOptions& options,
                                         absl::FunctionRef<void(const GameTestResult&)> done);

}  // namespace tessera::game

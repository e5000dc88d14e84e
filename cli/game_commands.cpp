// tessera game new, check, test and reference
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "game_sdk/lua/limits.h"
#include "game_sdk/lua/lua_module.h"
#include "game_sdk/native/native_module.h"
#include "game_sdk/testing/game_tests.h"
#include "game_sdk/tools/check.h"
#include "game_sdk/tools/new_game.h"
#include "game_sdk/tools/reference.h"
#include "host/files.h"
#include "local_cluster/command_error.h"
#include "local_cluster/scene_file.h"

namespace tessera::cli {
namespace {

namespace fs = std::filesystem;
using local::CommandError;
using local::OrThrow;

struct GameOptions {
  std::string name, file, game, scene, movement;
  game::GameTestOptions test;
};

bool IsTable(const Globals& globals) { return globals.format == Format::kTable || globals.format == Format::kWide; }

game::GameFile ReadGameFile(const std::string& path) {
  // One byte more than Lua takes, so that the refusal is that of the game's loader.
  return {path, OrThrow(host::ReadFile(path, game::kMaxSourceBytes + 1))};
}

void WriteGameFile(const fs::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file) throw CommandError(fmt::format("{}: cannot be written", path.string()));
}

// `path`, or the file of this name in it if it is a folder.
std::string FileIn(const std::string& path, const char* name) {
  return fs::is_directory(path) ? (fs::path(path) / name).string() : path;
}

// The path that was given, or the file of this name beside `path`.
std::string Beside(const std::string& given, const std::string& path, const char* name) {
  return given.empty() ? (fs::path(path).parent_path() / name).string() : given;
}

// --- new

void New(const GameOptions& options) {
  const fs::path folder = options.name;
  const std::string name = folder.filename().string();
  const auto fits = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_' || c == '-'; };
  if (name.empty() || name.size() > 63 || !std::ranges::all_of(name, fits)) {
    throw CommandError(fmt::format("{}: a game's name has 1 to 63 letters, digits, _ and -", options.name));
  }
  if (fs::exists(folder)) throw CommandError(fmt::format("{}: is there already; choose another name", options.name));
  for (const game::GameFile& file : game::NewGame(name)) {
    std::error_code error;
    fs::create_directories((folder / file.name).parent_path(), error);
    WriteGameFile(folder / file.name, file.bytes);
  }
  std::cout << fmt::format("{}: made; try `tessera game test {}`\n", options.name, options.name);
}

// --- check

void Check(const Globals& globals, const GameOptions& options) {
  const std::string path = FileIn(options.file, "game.lua");
  game::GameFile file = ReadGameFile(path);
  file.name = fs::path(path).filename().string();
  const auto scene = local::LoadScene(Beside(options.scene, path, "scene.json")).scene;
  const std::vector<game::GameFault> faults = game::CheckGame(file, *scene);
  auto report = nlohmann::ordered_json::array();
  for (const game::GameFault& fault : faults) {
    report.push_back({{"file", path}, {"line", fault.line}, {"text", fault.text}});
    if (!IsTable(globals)) continue;
    std::cout << (fault.line == 0 ? fmt::format("{}: {}\n", path, fault.text)
                                  : fmt::format("{}:{}: {}\n", path, fault.line, fault.text));
  }
  if (globals.format == Format::kJson) std::cout << report.dump(2) << "\n";
  if (!faults.empty()) {
    throw CommandError(fmt::format("{}: {} fault{}", path, faults.size(), faults.size() == 1 ? "" : "s"));
  }
  if (IsTable(globals)) std::cout << fmt::format("{}: no faults found\n", path);
}

// --- test

void PrintResult(const game::GameTestResult& result, double seconds) {
  std::cout << fmt::format("{}  {}  {:.2f} s\n", result.failures.empty() ? "ok  " : "FAIL", result.name, seconds);
  for (const std::string& line : result.output) std::cout << "      " << line << "\n";
  for (const game::GameTestFailure& failure : result.failures) {
    std::cout << fmt::format("      {} ({})\n", failure.text, fmt::join(failure.conditions, "; "));
  }
  std::cout.flush();
}

nlohmann::ordered_json ToReport(const game::GameTestResult& result, double seconds) {
  auto failures = nlohmann::ordered_json::array();
  for (const game::GameTestFailure& failure : result.failures) {
    failures.push_back({{"text", failure.text}, {"conditions", failure.conditions}});
  }
  return {{"name", result.name},
          {"passed", result.failures.empty()},
          {"seconds", seconds},
          {"ticks", result.ticks},
          {"handovers", result.handovers},
          {"deaths", result.deaths},
          {"output", result.output},
          {"failures", failures}};
}

void Test(const Globals& globals, const GameOptions& options) {
  using Clock = std::chrono::steady_clock;
  const std::string path = FileIn(options.file, "game_test.lua");
  const game::GameFile script = ReadGameFile(path);
  game::GameFile file = ReadGameFile(Beside(options.game, path, "game.lua"));
  if (!options.movement.empty()) {
    const auto library = game::NativeModule::LoadMovementFile(options.movement);
    if (!library.ok()) throw CommandError(fmt::format("--movement {}", std::string(library.status().message())));
    file.movement = (*library)->movement();
  }
  const game::GameUnderTest tested{*game::LuaGameModule(), std::move(file),
                                   local::LoadScene(Beside(options.scene, path, "scene.json")).scene};
  auto report = nlohmann::ordered_json::array();
  std::uint64_t ticks = 0, handovers = 0, deaths = 0;
  Clock::time_point begun = Clock::now();
  const auto done = [&](const game::GameTestResult& result) {
    const double seconds = std::chrono::duration<double>(Clock::now() - begun).count();
    begun = Clock::now();
    ticks += result.ticks;
    handovers += result.handovers;
    deaths += result.deaths;
    report.push_back(ToReport(result, seconds));
    if (IsTable(globals)) PrintResult(result, seconds);
  };
  const std::size_t failed = OrThrow(game::RunGameTests(tested, script, options.test, done));
  if (globals.format == Format::kJson) std::cout << report.dump(2) << "\n";
  const std::size_t all = report.size();
  if (failed != 0) throw CommandError(fmt::format("{}: {} of {} tests failed", path, failed, all));
  if (!IsTable(globals)) return;
  std::cout << fmt::format("{} test{} passed: {} ticks, {} handovers, {} deaths\n", all, all == 1 ? "" : "s", ticks,
                           handovers, deaths);
}

// --- reference

void WriteReference(const GameOptions& options) {
  if (fs::path(options.file).extension() == ".lua") return WriteGameFile(options.file, game::GameAnnotations());
  const std::string document = OrThrow(host::ReadFile(options.file, std::size_t{1} << 24));
  auto anew = game::WithReference(document);
  if (!anew.ok()) throw CommandError(fmt::format("{}: {}", options.file, std::string(anew.status().message())));
  WriteGameFile(options.file, *anew);
}

}  // namespace

void AddGameCommands(CLI::App& game, Globals& globals) {
  auto options = std::make_shared<GameOptions>();

  CLI::App* fresh = game.add_subcommand("new", "Make a folder with a small game that runs");
  fresh->add_option("name", options->name, "Folder to make")->required();
  fresh->callback([options] { New(*options); });

  CLI::App* check = game.add_subcommand("check", "Find faults of a game without running it");
  check->add_option("game", options->file, "File of the game, or its folder")->default_str("game.lua");
  check->add_option("--scene", options->scene, "Scene file (default: scene.json beside the game)");
  check->callback([&globals, options] {
    if (options->file.empty()) options->file = "game.lua";
    Check(globals, *options);
  });

  CLI::App* test = game.add_subcommand("test", "Run a game's tests, through handovers and deaths of regions");
  test->add_option("file", options->file, "File of the tests, or their folder")->default_str("game_test.lua");
  test->add_option("--game", options->game, "File of the game (default: game.lua beside the tests)");
  test->add_option("--scene", options->scene, "Scene file (default: scene.json beside the tests)");
  test->add_option("--movement", options->movement,
                   "Shared library with a movement for the game's players, which is trusted (default: none)");
  test->add_option("--regions", options->test.regions, "Number of regions, besides one")
      ->capture_default_str()
      ->check(CLI::Range(1, 64));
  test->add_option("--seed", options->test.seed, "Seed of random numbers, deaths and fresh states")
      ->capture_default_str();
  test->callback([&globals, options] {
    if (options->file.empty()) options->file = "game_test.lua";
    Test(globals, *options);
  });

  CLI::App* reference = game.add_subcommand("reference", "Write the list of functions and callbacks anew");
  reference->add_option("file", options->file, "A document with a place for it, or a file for editors (*.lua)")
      ->required();
  reference->callback([options] { WriteReference(*options); });
}

}  // namespace tessera::cli

// The real program, standalone: its command line, its ends, its ports. Clients and links have tests of their own.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <regex>

#include "host/last_lines.h"
#include "host/log_rotation.h"
#include "net/endpoint.h"
#include "region_worker/standalone.h"
#include "region_worker/testing/worker_process.h"
#include "telemetry/metrics_server.h"

namespace tessera::worker {
namespace {

std::vector<std::string> Alone(std::uint16_t base, const std::string& scene = ScenePath("minimal")) {
  return {"--scene", scene, "--regions", "1", "--region", "1", "--base-port", std::to_string(base)};
}

std::size_t Lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(WorkerUsageTest, MistakesGiveOneLineAndStatus2) {
  const std::string scene = ScenePath("minimal");
  const struct {
    std::vector<std::string> arguments;
    std::string says;
  } cases[] = {
      {{"--scene", scene}, "--region is required"},
      {{"--region", "1"}, "--scene is required"},
      {{"--scene", "/nowhere/x.textproto", "--region", "1"}, "--scene /nowhere/x.textproto: no such file"},
      {{"--scene", scene, "--regions", "4", "--region", "5"}, "--region 5: this instance has regions 1 to 4"},
      {{"--scene", scene, "--regions", "4", "--region", "0"}, "--region 0"},
      {{"--scene", scene, "--regions", "0", "--region", "1"}, "--regions 0: must be 1 to 1000"},
      {{"--scene", scene, "--region", "1", "--ghost-depth", "65"}, "--ghost-depth 65: must be 0 to 64"},
      {{"--scene", scene, "--region", "1", "--whole-up-to", "100001"}, "--whole-up-to 100001: must be 0 to 100000"},
      {{"--scene", scene, "--regions", "1001", "--region", "1"}, "--regions 1001"},
      {{"--scene", scene, "--region", "1", "--base-port", "65535"}, "--base-port 65535"},
      {{"--scene", scene, "--region", "1", "--seconds", "-1"}, "--seconds -1"},
      {{"--scene", scene, "--region", "1", "--seconds", "nan"}, "--seconds nan"},
      {{"--scene", scene, "--region", "1", "--log-level", "loud"}, "--log-level: loud"},
      {{"--scene", scene, "--region", "1", "--agent-socket", "/tmp/x"}, "--agent-socket and --scene"},
      {{"--game", scene, "--region", "1", "--agent-socket", "/tmp/x"}, "--agent-socket and --game"},
      {{"--scene", scene, "--game", "/nowhere/x.lua", "--region", "1"}, "--game /nowhere/x.lua: no such file"},
      {{"--scene", scene, "--game", scene, "--game-module", scene, "--region", "1"}, "--game and --game-module"},
      {{"--scene", scene, "--game-module", scene, "--region", "1"}, "minimal.textproto: no such file, or not a .so"},
      {{"--scene", scene, "--game-module", "/nowhere/x.so", "--region", "1"}, "/nowhere/x.so: no such file"},
      {{"--game-module", scene, "--region", "1", "--agent-socket", "/tmp/x"}, "--agent-socket and --game-module"},
      {{"--scene", scene, "--movement", "/nowhere/x.so", "--region", "1"}, "--movement is for a game in Lua"},
      {{"--scene", scene, "--game", scene, "--movement", "/nowhere/x.so", "--region", "1"},
       "--movement /nowhere/x.so: no such file, or not a .so"},
      {{"--movement", scene, "--region", "1", "--agent-socket", "/tmp/x"}, "--agent-socket and --movement"},
      {{"--agent-socket", "/tmp/x", "--region", "1"}, "--instance is required"},
      {{"--agent-socket", "/tmp/x", "--region", "1", "--instance", "i"}, "--incarnation is required"},
      {{"--scene", scene, "--region", "1", "--what"}, "--what"},
  };
  for (const auto& test : cases) {
    WorkerProcess worker(test.arguments);
    EXPECT_EQ(worker.Wait(), kExitUsage) << test.says;
    EXPECT_NE(worker.said().find(test.says), std::string::npos) << worker.said();
    EXPECT_EQ(Lines(worker.said()), 1u) << worker.said();
  }
}

TEST(WorkerGameTest, BadGameGivesStatus1NamingFileAndLine) {
  const std::string game = WriteTestFile("bad.lua", "function on_tick()\n  local x = = 1\nend\n");
  std::vector<std::string> arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--game", game});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitFailure);
  EXPECT_NE(worker.said().find("bad.lua:2: "), std::string::npos) << worker.said();
}

TEST(WorkerGameTest, AGameRunsAndItsLinesAndCostAreShown) {
  const std::string game = WriteTestFile("good.lua", R"(
    function on_tick()
      if world.tick() == 5 then print("tick five") end
      if world.tick() > 5 then error("no more") end
    end)");
  const std::uint16_t base = FreeBasePort(1);
  std::vector<std::string> arguments = Alone(base);
  arguments.insert(arguments.end(), {"--game", game});
  WorkerProcess worker(arguments);
  ASSERT_TRUE(worker.WaitForLine("is off")) << worker.said();
  EXPECT_NE(worker.said().find("game tick=5 text=\"tick five\""), std::string::npos) << worker.said();
  EXPECT_NE(worker.said().find("game error tick=6 text="), std::string::npos) << worker.said();
  ASSERT_TRUE(worker.WaitForLine("RUNNING tick=")) << worker.said();
  // The costs of callbacks are brought up to date once a second.
  std::string metrics;
  const auto limit = std::chrono::steady_clock::now() + kPatience;
  do {
    metrics = ReadMetrics(static_cast<std::uint16_t>(base + 2));
  } while (metrics.find("\ntessera_game_callback_calls_total{callback=\"on_tick\"} 25\n") == std::string::npos &&
           std::chrono::steady_clock::now() < limit);
  for (const char* line :
       {"\ntessera_game_calls_total 25\n", "\ntessera_game_errors_total 20\n", "\ntessera_game_callbacks_off 1\n",
        "\ntessera_game_dropped_events_total 0\n", "\ntessera_game_callback_calls_total{callback=\"on_tick\"} 25\n",
        "\ntessera_game_callback_errors_total{callback=\"on_tick\"} 20\n",
        "\ntessera_game_effects_total{effect=\"spawn\",result=\"done\"} 0\n"}) {
    EXPECT_NE(metrics.find(line), std::string::npos) << line << metrics;
  }
}

std::vector<std::string> WithModule(const std::string& name, std::uint16_t base) {
  std::vector<std::string> arguments = Alone(base);
  arguments.insert(arguments.end(), {"--game-module", TESSERA_BINARY_DIR "/game_modules/" + name + ".so"});
  return arguments;
}

TEST(WorkerModuleTest, ALibraryOfAnotherInterfaceGivesStatus1NamingBothVersions) {
  WorkerProcess worker(WithModule("other_abi", FreeBasePort(1)));
  EXPECT_EQ(worker.Wait(), kExitFailure);
  EXPECT_NE(worker.said().find("other_abi"), std::string::npos) << worker.said();
  EXPECT_NE(worker.said().find("version 8"), std::string::npos) << worker.said();
}

std::vector<std::string> WithMovement(const std::string& library, std::uint16_t base) {
  const std::string game =
      WriteTestFile("drive.lua", "function on_tick() if world.tick() == 5 then print('five') end end");
  std::vector<std::string> arguments = Alone(base, TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto");
  arguments.insert(arguments.end(),
                   {"--game", game, "--movement", TESSERA_BINARY_DIR "/game_modules/" + library + ".so"});
  return arguments;
}

TEST(WorkerModuleTest, AGameInLuaRunsWithAMovementBesideIt) {
  WorkerProcess worker(WithMovement("car_alone", FreeBasePort(1)));
  EXPECT_TRUE(worker.WaitForLine("game tick=5 text=five")) << worker.said();
}

TEST(WorkerModuleTest, ABadMovementGivesStatus1AndIsNamed) {
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"bad_movement_alone", "game module bad_movement_alone: movement hover: state_bytes: 65 are more than 64"},
      {"bad_movement", "movement: is made for version 8 of the interface, and this is version 1"},
      {"fountain", "game module fountain: has no movement"}};
  for (const auto& [library, says] : bad) {
    WorkerProcess worker(WithMovement(library, FreeBasePort(1)));
    EXPECT_EQ(worker.Wait(), kExitFailure) << library;
    EXPECT_NE(worker.said().find(says), std::string::npos) << worker.said();
  }
}

// A scene without players or without the kind has nobody whom it could move.
TEST(WorkerModuleTest, AMovementThatTheSceneHasNoUseForIsRefused) {
  const std::string game = WriteTestFile("idle.lua", "function on_tick() end");
  std::vector<std::string> arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--game", game, "--movement", TESSERA_BINARY_DIR "/game_modules/car_alone.so"});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitFailure);
  EXPECT_NE(worker.said().find("idle.lua: movement car: "), std::string::npos) << worker.said();
}

TEST(WorkerModuleTest, ALibraryRunsAsAGame) {
  const std::string scene =
      WriteTestFile("fountain.textproto",
                    "name: 'fountain' bounds { min { x: -20 y: -5 z: -20 } max { x: 20 y: 40 z: 20 } }\n"
                    "properties { name: 'hits' number: 0 }\n"
                    "bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }\n"
                    "prefabs { name: 'ball' bodies { kind: 'ball' mass: 1 shape { sphere { radius: 0.25 } } } }\n");
  const std::uint16_t base = FreeBasePort(1);
  std::vector<std::string> arguments = Alone(base, scene);
  arguments.insert(arguments.end(), {"--game-module", TESSERA_BINARY_DIR "/game_modules/fountain.so"});
  WorkerProcess worker(arguments);
  ASSERT_TRUE(worker.WaitForLine("RUNNING tick=")) << worker.said();
  const std::string metrics = ReadMetrics(static_cast<std::uint16_t>(base + 2));
  EXPECT_EQ(metrics.find("\ntessera_game_calls_total 0\n"), std::string::npos) << metrics;
  EXPECT_NE(metrics.find("\ntessera_game_errors_total 0\n"), std::string::npos) << metrics;
}

std::string Describe(const std::string& name, int status) {
  WorkerProcess worker({"--describe-game-module", TESSERA_BINARY_DIR "/game_modules/" + name + ".so"});
  EXPECT_EQ(worker.Wait(), status) << worker.said();
  return worker.said();
}

TEST(WorkerModuleTest, DescribesALibraryForItsAgentOnOneLine) {
  const std::string said = Describe("fountain", kExitOk);
  EXPECT_EQ(said.find("game module fountain abi 1 hash "), 0U) << said;
  EXPECT_EQ(said.size(), std::string("game module fountain abi 1 hash  with game\n").size() + 64) << said;
  EXPECT_NE(said.find(" with game\n"), std::string::npos) << said;
  const std::string alone = Describe("car_alone", kExitOk);
  EXPECT_EQ(alone.find("game module car_alone abi 1 hash "), 0U) << alone;
  EXPECT_NE(alone.find(" with movement\n"), std::string::npos) << alone;
  EXPECT_NE(Describe("car", kExitOk).find(" with both\n"), std::string::npos);
}

TEST(WorkerModuleTest, DescribesWhyALibraryCannotRunHere) {
  EXPECT_EQ(Describe("other_abi", kExitFailure),
            "tessera-region: game module other_abi: is made for version 8 of the interface, and this is version 1\n");
  EXPECT_NE(Describe("absent", kExitFailure).find("game module absent: "), std::string::npos);
}

TEST(WorkerModuleTest, OneThatCrashesSaysWhere) {
  WorkerProcess worker(WithModule("crashes", FreeBasePort(1)));
  worker.Wait();
  EXPECT_NE(worker.said().find("died in game module crashes: Segmentation fault in on_tick"), std::string::npos)
      << worker.said();
}

TEST(WorkerSceneTest, BadSceneGivesStatus1NamingFileBodyAndField) {
  const std::string file = WriteTestFile("bad.textproto",
                                         "name: 'bad' bounds { min { x: -5 y: -5 z: -5 } max { x: 5 y: 5 z: 5 } }\n"
                                         "bodies { id: 40 name: 'crate' mass: -1 shape { sphere { radius: 1 } } }\n");
  WorkerProcess worker(Alone(FreeBasePort(1), file));
  EXPECT_EQ(worker.Wait(), kExitFailure);
  for (const char* part : {"bad.textproto", "crate", "mass"}) {
    EXPECT_NE(worker.said().find(part), std::string::npos) << worker.said();
  }
  EXPECT_EQ(Lines(worker.said()), 1u) << worker.said();
}

TEST(WorkerSceneTest, UnknownFieldIsNamedWithItsLine) {
  const std::string file = WriteTestFile("typo.textproto", "name: 'typo'\nbodys { id: 1 }\n");
  WorkerProcess worker(Alone(FreeBasePort(1), file));
  EXPECT_EQ(worker.Wait(), kExitFailure);
  EXPECT_NE(worker.said().find("typo.textproto:2"), std::string::npos) << worker.said();
}

TEST(WorkerPortTest, PortInUseGivesStatus98NamingPortAndAddress) {
  const std::uint16_t base = FreeBasePort(1);
  for (const int offset : {0, 1}) {
    const auto port = static_cast<std::uint16_t>(base + offset);
    const auto taken = net::Endpoint::Create({.bind_address = "127.0.0.1", .port = port});
    ASSERT_TRUE(taken.ok()) << taken.status();
    WorkerProcess worker(Alone(base));
    EXPECT_EQ(worker.Wait(), kExitPortInUse);
    EXPECT_NE(worker.said().find(std::to_string(port)), std::string::npos) << worker.said();
    EXPECT_NE(worker.said().find("127.0.0.1"), std::string::npos) << worker.said();
    EXPECT_EQ(Lines(worker.said()), 1u) << worker.said();
  }
  const auto taken = telemetry::MetricsServer::Start("127.0.0.1", static_cast<std::uint16_t>(base + 2),
                                                     std::make_shared<prometheus::Registry>());
  ASSERT_TRUE(taken.ok()) << taken.status();
  WorkerProcess worker(Alone(base));
  EXPECT_EQ(worker.Wait(), kExitPortInUse);
  EXPECT_NE(worker.said().find(std::to_string(base + 2)), std::string::npos) << worker.said();
}

TEST(WorkerPortTest, AddressOfAnotherHostGivesStatus1) {
  auto arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--bind-address", "203.0.113.7"});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitFailure);
  EXPECT_NE(worker.said().find("203.0.113.7"), std::string::npos) << worker.said();
}

TEST(WorkerEndTest, EndsByItselfAfterItsSeconds) {
  auto arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--seconds", "0.3"});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitOk) << worker.said();
  EXPECT_TRUE(worker.WaitForLine("its time is over"));
}

TEST(WorkerEndTest, SigtermAndSigintEndWithStatus0) {
  for (const int signal : {SIGTERM, SIGINT}) {
    WorkerProcess worker(Alone(FreeBasePort(1)));
    ASSERT_TRUE(worker.WaitForLine("RUNNING"));
    worker.Signal(signal);
    EXPECT_EQ(worker.Wait(), kExitOk) << worker.said();
  }
}

// docs/metrics.md is the one list: each row of its table for the worker, with each label value it names.
TEST(WorkerMetricsTest, ServesEveryNameOfTheDocument) {
  const std::uint16_t base = FreeBasePort(1);
  WorkerProcess worker(Alone(base));
  ASSERT_TRUE(worker.WaitForLine("RUNNING tick="));
  const std::string page = ReadMetrics(static_cast<std::uint16_t>(base + 2));

  std::ifstream document(std::string(TESSERA_SOURCE_DIR) + "/docs/metrics.md");
  const std::regex row(
      "^\\| `(tessera_(?:region|process|host)_[a-z_]+)(?:\\{[a-z]+\\})?` \\| (gauge|counter|histogram) .*");
  int names = 0;
  for (std::string line; std::getline(document, line);) {
    std::smatch match;
    if (!std::regex_match(line, match, row) || line.find("{neighbour}") != std::string::npos) continue;  // it has none
    ++names;
    EXPECT_NE(page.find("# TYPE " + match[1].str() + " " + match[2].str() + "\n"), std::string::npos) << line;
  }
  EXPECT_GE(names, 24);
  for (const char* series :
       {"tessera_region_bodies{state=\"owned\"}", "tessera_region_bodies{state=\"ghost\"}",
        "tessera_region_bodies{state=\"asleep\"}", "tessera_region_handovers_total{direction=\"in\"}",
        "tessera_region_handovers_total{direction=\"out\"}", "tessera_region_frame_bytes_total{direction=\"in\"}",
        "tessera_region_frame_bytes_total{direction=\"out\"}", "tessera_region_inputs_total{result=\"applied\"}",
        "tessera_region_inputs_total{result=\"refused\"}", "tessera_region_inputs_total{result=\"late\"}",
        "tessera_region_inputs_total{result=\"not_owner\"}",
        "tessera_region_frames_dropped_total{reason=\"malformed\"}", "tessera_region_step_seconds_bucket{le=\"5e-05\"}",
        "tessera_region_step_seconds_bucket{le=\"0.1\"}"}) {
    EXPECT_NE(page.find(series), std::string::npos) << series;
  }
}

TEST(WorkerLogTest, LogFileTakesAllThatIsSaid) {
  const std::string log = WriteTestFile("worker.log", "");
  auto arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--seconds", "0.1", "--log-file", log});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitOk);
  EXPECT_EQ(worker.said(), "");
  std::ifstream file(log);
  const std::string said{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  EXPECT_NE(said.find("listening instance=standalone region=1"), std::string::npos) << said;
}

// The file is full but for one line, which the worker writes; all else goes into a new one.
TEST(WorkerLogTest, ALargeLogFileIsRotated) {
  const std::string log = WriteTestFile("large.log", std::string(host::kMaxLogBytes - 50, 'x') + "\n");
  auto arguments = Alone(FreeBasePort(1));
  arguments.insert(arguments.end(), {"--seconds", "0.1", "--log-file", log});
  WorkerProcess worker(arguments);
  EXPECT_EQ(worker.Wait(), kExitOk);
  const std::uintmax_t before = std::filesystem::file_size(host::EarlierLog(log, 1));
  EXPECT_GE(before, host::kMaxLogBytes);
  EXPECT_LT(before, host::kMaxLogBytes + 1000);
  EXPECT_LT(std::filesystem::file_size(log), host::kMaxLogBytes / 2);
  EXPECT_FALSE(std::filesystem::exists(host::EarlierLog(log, 2)));
  EXPECT_NE(host::LastLinesText(log, 20).find("listening instance=standalone"), std::string::npos);
}

}  // namespace
}  // namespace tessera::worker

// Mistakes of users, through the real command line: one clear line on stderr, the right exit status, nothing left
// behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "host/temporary_folder.h"
#include "local_cluster/local_cluster.h"
#include "tests/support/run_program.h"

namespace tessera::end_to_end {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;
using testing::StartsWith;

class BadInputTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new host::TemporaryFolder();
    cluster_ = new local::LocalCluster({.state_dir = folder_->path(), .capacity = 6});
  }
  static void TearDownTestSuite() {
    delete cluster_;
    delete folder_;
  }

  // Runs `tessera --control <the cluster> arguments...`.
  static support::RunResult Tessera(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--control", cluster_->control_address()});
    return support::RunProgram("tessera", arguments);
  }
  static void ExpectOneLine(const support::RunResult& result, int exit_code, const std::string& part) {
    EXPECT_EQ(result.exit_code, exit_code) << result.err;
    EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  static std::string SceneFile(const std::string& name, const std::string& text) {
    const std::string path = folder_->path() + "/" + name + ".textproto";
    std::ofstream(path) << text;
    return path;
  }
  static std::string GameFile(const std::string& name, const std::string& text) {
    const std::string path = folder_->path() + "/" + name + ".lua";
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  // No instance but the ended ones, no place taken.
  static void ExpectNothingLeftBehind() {
    const support::RunResult hosts = Tessera({"host", "list"});
    EXPECT_THAT(hosts.out, MatchesRegex("NAME.*\nlocal-1 +READY +0 .*\n"));
  }

  static host::TemporaryFolder* folder_;
  static local::LocalCluster* cluster_;
};
host::TemporaryFolder* BadInputTest::folder_ = nullptr;
local::LocalCluster* BadInputTest::cluster_ = nullptr;

constexpr const char* kBounds = "name: \"bad\" bounds { min { x: -9 y: -9 z: -9 } max { x: 9 y: 9 z: 9 } }\n";

struct BadScene {
  const char *name, *text, *part;
};
class BadSceneTest : public BadInputTest, public testing::WithParamInterface<BadScene> {};

TEST_P(BadSceneTest, IsRefusedByFileBodyAndField) {
  const std::string file = SceneFile(GetParam().name, kBounds + std::string(GetParam().text));
  for (const std::vector<std::string>& command : {std::vector<std::string>{"scene", "validate", file},
                                                  std::vector<std::string>{"instance", "create", "--scene", file}}) {
    const support::RunResult result = Tessera(command);
    ExpectOneLine(result, 1, GetParam().part);
    EXPECT_THAT(result.err, StartsWith("tessera: " + file));
  }
  ExpectNothingLeftBehind();
}

std::string NameOf(const testing::TestParamInfo<BadScene>& scene) {
  std::string name = scene.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadSceneTest,
    testing::Values(
        BadScene{"unknown-shape", "bodies { id: 1 mass: 1 shape { blob { } } }", "blob"},
        BadScene{"no-shape", "bodies { id: 1 mass: 1 }", "bodies[0] (id 1): shape"},
        BadScene{"negative-mass", "bodies { id: 1 mass: -1 shape { sphere { radius: 1 } } }", "bodies[0] (id 1): mass"},
        BadScene{"zero-mass", "bodies { id: 1 mass: 0 shape { sphere { radius: 1 } } }", "bodies[0] (id 1): mass"},
        BadScene{"nan", "bodies { id: 1 mass: 1 shape { sphere { radius: nan } } }",
                 "bodies[0] (id 1): shape.sphere.radius"},
        BadScene{"mesh-index",
                 "bodies { id: 1 motion: MOTION_STATIC shape { mesh { vertices { } vertices { x: 1 } vertices { z: 1 } "
                 "indices: [0, 1, 3] } } }",
                 "bodies[0] (id 1): shape.mesh.indices[2]"},
        BadScene{"duplicate-id",
                 "bodies { id: 1 mass: 1 shape { sphere { radius: 1 } } } bodies { id: 1 mass: 1 shape { sphere { "
                 "radius: 1 } } }",
                 "bodies[1]"},
        BadScene{
            "joint-to-nowhere",
            "bodies { id: 1 mass: 1 shape { sphere { radius: 1 } } } joints { id: 1 body_a: 1 body_b: 7 point { } }",
            "joints[0] (id 1): body_b"},
        BadScene{"empty", "", "bodies"},
        BadScene{"outside", "bodies { id: 1 mass: 1 shape { sphere { radius: 1 } } pose { position { x: 50 } } }",
                 "bodies[0] (id 1): pose.position"}),
    NameOf);

struct BadGame {
  const char *name, *text, *part;
};
class BadGameTest : public BadInputTest, public testing::WithParamInterface<BadGame> {};

TEST_P(BadGameTest, IsRefusedByFileAndLineAndMakesNothing) {
  const std::string file = GameFile(GetParam().name, GetParam().text);
  const std::string before = Tessera({"-o", "name", "instance", "list"}).out;
  for (const bool dry_run : {true, false}) {
    std::vector<std::string> command{"instance", "create", "--scene", "minimal", "--game", file};
    if (dry_run) command.push_back("--dry-run");
    const support::RunResult result = Tessera(command);
    ExpectOneLine(result, 1, GetParam().part);
    EXPECT_THAT(result.err, HasSubstr(std::string(GetParam().name) + ".lua"));
  }
  EXPECT_EQ(Tessera({"-o", "name", "instance", "list"}).out, before);
  ExpectNothingLeftBehind();
}

INSTANTIATE_TEST_SUITE_P(
    All, BadGameTest,
    testing::Values(BadGame{"syntax", "local n = 1\nfunction on_tick(\n", "syntax.lua:3: "},
                    BadGame{"endless", "local n = 1\nwhile true do end\n", "endless.lua:2: too much work"},
                    BadGame{"bomb", "local t = {}\nfor i = 1, 1e9 do t[i] = ('x'):rep(60000) .. i end\n",
                            "bomb.lua:2: too much memory"},
                    BadGame{"binary", "\x1bLuaT", "binary chunk"},
                    BadGame{"foreign", "local n = 1\nkinds.goat = { on_tick = function(self) end }\n",
                            "foreign.lua:2: the scene has no bodies of the kind `goat`"},
                    BadGame{"kept", "local n = 0\nfunction on_tick() n = n + 1 end\n", "kept.lua:2: `n`"}),
    [](const auto& game) { return std::string(game.param.name); });

TEST_F(BadInputTest, AGameFileThatIsMissingOrTooLargeIsNamed) {
  const auto create = [](const std::string& file) {
    return Tessera({"instance", "create", "--scene", "minimal", "--game", file});
  };
  ExpectOneLine(create("/nowhere/x.lua"), 1, "game /nowhere/x.lua: ");
  const std::string large = GameFile("large", std::string(2 << 20, ' '));
  ExpectOneLine(create(large), 1, large + ": holds more than 1048576 bytes");
  ExpectNothingLeftBehind();
}

TEST_F(BadInputTest, ASceneFileThatIsNotThereIsNamed) {
  ExpectOneLine(Tessera({"scene", "validate", "/nowhere/x.textproto"}), 1, "/nowhere/x.textproto: ");
}

TEST_F(BadInputTest, NoOrTooManyRegionsAreRefusedWithTheRange) {
  for (const char* regions : {"0", "10000"}) {
    const support::RunResult result = Tessera({"instance", "create", "--scene", "minimal", "--regions", regions});
    ExpectOneLine(result, 1, "spec.regions");
    EXPECT_THAT(result.err, HasSubstr("INVALID_ARGUMENT"));
    EXPECT_THAT(result.err, HasSubstr("1000"));
  }
  ExpectNothingLeftBehind();
}

TEST_F(BadInputTest, MoreRegionsThanCapacityLeaveNothingHalfCreated) {
  const support::RunResult result = Tessera({"instance", "create", "--scene", "minimal", "--regions", "7"});
  ExpectOneLine(result, 1, "RESOURCE_EXHAUSTED");
  EXPECT_THAT(result.err, HasSubstr("7"));
  EXPECT_THAT(result.err, HasSubstr("6"));
  ExpectNothingLeftBehind();
}

TEST_F(BadInputTest, AnUnknownInstanceIsNamedByEveryCommand) {
  for (const char* command : {"describe", "watch", "delete"}) {
    const support::RunResult result = Tessera({"instance", command, "inst-404"});
    ExpectOneLine(result, 1, "inst-404");
    EXPECT_THAT(result.err, HasSubstr("NOT_FOUND"));
  }
  ExpectOneLine(Tessera({"client", "inst-404", "--seconds", "1"}), 1, "inst-404");
  ExpectOneLine(Tessera({"instance", "restore", "inst-404"}), 1, "inst-404");
  ExpectOneLine(Tessera({"instance", "restore", "inst-404", "--tick", "7"}), 1, "inst-404");
}

TEST_F(BadInputTest, ACheckpointThatNeverWasIsNamedAndTheWorldRunsOn) {
  const support::RunResult made =
      Tessera({"-o", "name", "instance", "create", "--scene", "minimal", "--regions", "1", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string id = made.out.substr(made.out.find('/') + 1, made.out.find('\n') - made.out.find('/') - 1);
  ExpectOneLine(Tessera({"instance", "restore", id}), 1, "id: " + id + " has no checkpoint");
  ASSERT_EQ(Tessera({"instance", "checkpoint", id}).exit_code, 0);
  ExpectOneLine(Tessera({"instance", "restore", id, "--tick", "1000000"}), 1,
                "tick: " + id + " has no checkpoint of tick 1000000");
  EXPECT_THAT(Tessera({"instance", "describe", id}).out, HasSubstr("RUNNING"));
  EXPECT_EQ(Tessera({"instance", "delete", id, "--wait"}).exit_code, 0);
  ExpectNothingLeftBehind();
}

TEST_F(BadInputTest, APropertyThatCannotBeIsRefusedByItsField) {
  const std::string file = SceneFile("properties", std::string(kBounds) + R"(
      properties { name: "health" number: 100 } properties { name: "armed" flag: false }
      bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
      bodies { id: 2 mass: 1 shape { sphere { radius: 1 } } pose { position { y: 1 } } })");
  const support::RunResult made =
      Tessera({"-o", "name", "instance", "create", "--scene", file, "--regions", "1", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string id = made.out.substr(made.out.find('/') + 1, made.out.find('\n') - made.out.find('/') - 1);
  const auto set = [&](const std::string& body, const std::string& key, const std::string& value) {
    return Tessera({"instance", "set-property", id, body, key, value});
  };
  ExpectOneLine(set("2", "mana", "1"), 1, "KEY: the scene declares no property \"mana\"; it declares: health, armed");
  ExpectOneLine(set("2", "health", "full"), 1, "VALUE: property \"health\" is a whole number, not \"full\"");
  ExpectOneLine(set("2", "armed", "1"), 1, "VALUE: property \"armed\" is true or false");
  ExpectOneLine(set("1", "health", "5"), 1, "body: " + id + " has no dynamic body 1");
  ExpectOneLine(set("99", "health", "5"), 1, "body: " + id + " has no dynamic body 99");
  const support::RunResult done = set("2", "health", "5");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.out, "instance/" + id + " body 2: health = 5\n");
  EXPECT_EQ(Tessera({"instance", "delete", id, "--wait"}).exit_code, 0);
  ExpectNothingLeftBehind();
}

TEST_F(BadInputTest, AnAddressWhereNobodyListensIsNamed) {
  const support::RunResult result =
      support::RunProgram("tessera", {"--control", "unix:/nowhere/control.sock", "host", "list"});
  ExpectOneLine(result, 1, "unix:/nowhere/control.sock");
}

TEST_F(BadInputTest, AnAddressOfTheWrongFormIsNamed) {
  ExpectOneLine(support::RunProgram("tessera", {"--control", "somewhere", "host", "list"}), 1, "somewhere");
}

TEST_F(BadInputTest, WrongUsageExitsWith2) {
  EXPECT_EQ(support::RunProgram("tessera", {}).exit_code, 2);
  EXPECT_EQ(support::RunProgram("tessera", {"dance"}).exit_code, 2);
  EXPECT_EQ(support::RunProgram("tessera", {"instance", "create"}).exit_code, 2);
  EXPECT_EQ(support::RunProgram("tessera", {"-o", "yaml-ish", "host", "list"}).exit_code, 2);
  EXPECT_EQ(support::RunProgram("tessera", {"--help"}).exit_code, 0);
}

TEST_F(BadInputTest, APortInUseIsNamed) {
  const host::TemporaryFolder other;
  const support::RunResult result = support::RunProgram(
      "tessera-control", {"--metrics-listen", cluster_->http_address(), "--state-dir", other.path()});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr(cluster_->http_address()));
  EXPECT_THAT(result.err, HasSubstr("in use"));
  const std::string socket = cluster_->control_address().substr(sizeof "unix:" - 1);
  const support::RunResult same_socket = support::RunProgram(
      "tessera-control", {"--socket", socket, "--metrics-listen", "127.0.0.1:0", "--state-dir", other.path()});
  EXPECT_EQ(same_socket.exit_code, 1);
  EXPECT_THAT(same_socket.err, HasSubstr(socket + ": another control plane listens there"));
}

TEST_F(BadInputTest, AWrongJoinTokenIsRefused) {
  const host::TemporaryFolder state;
  std::ofstream(state.path() + "/token") << "not-a-token\n";
  const support::RunResult result = support::RunProgram(
      "tessera-agent", {"--control", cluster_->control_address(), "--state-dir", state.path() + "/s",
                        "--metrics-listen", "127.0.0.1:0", "--join-token-file", state.path() + "/token"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("join_token: unknown, or used already"));
}

TEST_F(BadInputTest, AUsedJoinTokenIsRefused) {
  const host::TemporaryFolder state;
  std::ifstream in(folder_->path() + "/local-1/join-token");
  std::string used;
  ASSERT_TRUE(std::getline(in, used));
  std::ofstream(state.path() + "/token") << used << "\n";
  const support::RunResult result = support::RunProgram(
      "tessera-agent", {"--control", cluster_->control_address(), "--state-dir", state.path() + "/s",
                        "--metrics-listen", "127.0.0.1:0", "--join-token-file", state.path() + "/token"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("join_token: unknown, or used already"));
  EXPECT_THAT(result.err, testing::Not(HasSubstr(used))) << "a token is never shown";
}

TEST_F(BadInputTest, AHostNameThatIsTakenOrMalformedIsNamed) {
  ExpectOneLine(Tessera({"host", "add", "local-1"}), 1, "ALREADY_EXISTS");
  ExpectOneLine(Tessera({"host", "add", "Not A Name"}), 1, "name");
  ExpectOneLine(Tessera({"host", "remove", "nobody"}), 1, "nobody");
}

}  // namespace
}  // namespace tessera::end_to_end

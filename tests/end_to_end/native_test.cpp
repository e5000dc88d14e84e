// Native games on a cluster of real processes: a world counts in one, one stops a world by its crashes, and those that
// cannot run make nothing.
#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "client_sdk/client.h"
#include "core/world/partition_io.h"
#include "core/world/sha256.h"
#include "game_sdk/examples/car/car_movement.h"
#include "host/files.h"
#include "host/temporary_folder.h"
#include "local_cluster/game_file.h"
#include "local_cluster/local_cluster.h"
#include "tests/end_to_end/world_fixture.h"
#include "tests/support/sanitizer_options.h"

namespace tessera::end_to_end {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kNativeTestSanitized = true;  // a worker then keeps to files, and may do all else that its runtime does
#else
constexpr bool kNativeTestSanitized = false;
#endif

constexpr BodyId kBall{2};
constexpr Vec3d kBallAt{-6, 1, -6};

constexpr std::size_t kMaxLogBytes = std::size_t{16} << 20;
constexpr char kCarScene[] = TESSERA_SOURCE_DIR "/game_sdk/examples/car/scene.textproto";
constexpr char kDriveGame[] = "function on_tick() if world.tick() == 5 then print('five') end end";

// A ball that a game throws up again whenever it comes down, in one of four regions.
constexpr char kScene[] = R"(
  name: "bounce"
  bounds { min { x: -12 y: -2 z: -12 } max { x: 12 y: 20 z: 12 } }
  properties { name: "hits" number: 0 }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  bodies {
    id: 2 name: "ball" kind: "ball" mass: 1
    pose { position { x: -6 y: 1 z: -6 } }
    shape { sphere { radius: 0.5 } }
  }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: 6 y: 0.5 z: 6 }
    max_force: 1
    max_speed: 6
  }
)";

// A folder of an operator's, with some of the build's modules.
class GameFolder {
 public:
  GameFolder() {
    fs::create_directory(path());
    std::ofstream(scene(), std::ios::binary) << kScene;
    for (const char* name : {"bounce", "burglar", "car_alone", "crashes_late", "no_entry", "other_abi"}) {
      const std::string file = std::string(name) + ".so";
      fs::copy_file(fs::path(TESSERA_BINARY_DIR) / "game_modules" / file, fs::path(path()) / file);
    }
  }
  std::string path() const { return folder_.path() + "/games"; }
  std::string state() const { return folder_.path(); }
  std::string scene() const { return folder_.path() + "/bounce.textproto"; }
  std::string HashOf(const std::string& name) const {
    return Sha256Hex(host::ReadFile(path() + "/" + name + ".so", std::size_t{64} << 20).value());
  }

 private:
  host::TemporaryFolder folder_;
};

class NativeWorldTest : public WorldTest {
 protected:
  // As the player sees it.
  std::int64_t Hits() {
    const auto value = run_->bots()[0]->client().PropertyOf(kBall, "hits");
    return value ? std::get<std::int64_t>(*value) : -1;
  }
  GameFolder games_;
};

TEST_F(NativeWorldTest, AWorldCountsInItAndTheCountOutlivesTheRegionThatDidIt) {
  Start({.scene = games_.scene(),
         .game = "native:bounce@" + games_.HashOf("bounce"),
         .regions = 4,
         .bots = 1,
         .hosts = 2,
         .capacity = 4,
         .game_modules = games_.path()});
  const std::string shown = "native:bounce@" + games_.HashOf("bounce").substr(0, 8);
  EXPECT_THAT(Tessera({"instance", "list"}).out, HasSubstr(shown));
  EXPECT_THAT(Tessera({"instance", "describe", run_->instance_id()}).out, HasSubstr("Game:     " + shown));
  ASSERT_TRUE(PlayUntil("all regions protected", [this] {
    const v1::Instance instance = run_->Latest();
    return IsSettled() && instance.unprotected_regions().empty() &&
           std::ranges::all_of(instance.region_status(),
                               [](const auto& status) { return status.report().acknowledged_tick() > 60; });
  }));
  ASSERT_TRUE(PlayUntil("hits", [this] { return Hits() >= 3; }));

  const std::uint32_t owner = FromProto(run_->Latest().map())->OwnerOf(kBallAt).value();
  const std::int64_t before = Hits();
  ASSERT_EQ(kill(static_cast<pid_t>(ReportOf(owner).identity().pid()), SIGKILL), 0);
  std::int64_t least = before;
  ASSERT_TRUE(PlayUntil("hits by whoever has the ball now", [&] {
    least = std::min(least, Hits());
    return run_->Latest().failovers() > 0 && Hits() >= before + 3;
  }));
  EXPECT_GE(least, before - 1) << "the count did not begin anew";
  ASSERT_TRUE(PlayUntil("a new worker in its place", [&] { return IsSettled() && run_->Latest().regions() == 4; }));

  // Its checkpoint names the game and holds no copy of it.
  const auto made = Tessera({"instance", "checkpoint", run_->instance_id()});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string file = games_.state() + "/world.tessera";
  ASSERT_EQ(Tessera({"instance", "export", run_->instance_id(), file}).exit_code, 0);
  EXPECT_LT(fs::file_size(file), fs::file_size(games_.path() + "/bounce.so"));
  const auto imported = Tessera({"instance", "import", file, "-o", "name"});
  EXPECT_EQ(imported.exit_code, 0) << imported.err;
  const auto changed = Tessera({"instance", "set-game", run_->instance_id(), "native:bounce"});
  EXPECT_NE(changed.exit_code, 0);
  EXPECT_THAT(changed.err, HasSubstr("native:bounce"));
}

// A player of the car's world, who predicts by the function that the hosts' library has.
class Driver {
 public:
  Driver(const std::string& control, const std::string& instance) {
    auto joined = client::Client::Join(
        {.control_address = control, .instance_id = instance, .player_name = "driver", .predict = true});
    if (!joined.ok()) throw std::runtime_error(std::string(joined.status().message()));
    client_ = *std::move(joined);
    if (const auto set = client_->SetMovement(&car_movement); !set.ok()) {
      throw std::runtime_error(std::string(set.message()));
    }
  }
  // A frame with so much gas; less than 0: backwards, where the field is free.
  void Frame(float gas) {
    const auto now = std::chrono::steady_clock::now();
    for (const client::ClientEvent& event : client_->Poll(now)) {
      if (event.kind == client::ClientEvent::Kind::kMovementMissing) lacks_ = event.detail;
    }
    client::Steering steering;
    steering.move = {0, gas};
    client_->Steer(steering);
    for (const client::ShownBody& body : client_->Interpolated(now)) {
      if (body.id == client_->own_body()) predicted_ = body.predicted;
    }
  }
  // The car as the server has it; null: not yet.
  const client::SeenBody* Car() const {
    const auto car = client_->World().find(client_->own_body());
    return car == client_->World().end() ? nullptr : &car->second;
  }
  double At() const { return Car() == nullptr ? 0 : Car()->state.position.z; }
  bool predicted() const { return predicted_; }
  const std::string& lacks() const { return lacks_; }

 private:
  std::unique_ptr<client::Client> client_;
  bool predicted_ = false;
  std::string lacks_;
};

// Without it nothing would move the car: the scene's force for players is 1 N.
TEST_F(NativeWorldTest, ACarOfAGameInLuaIsDrivenOnAfterItsRegionHasDied) {
  const std::string game = games_.state() + "/drive.lua";
  std::ofstream(game) << kDriveGame;
  Start({.scene = kCarScene,
         .game = game,
         .regions = 2,
         .bodies = 20,
         .bots = 0,
         .hosts = 2,
         .capacity = 4,
         .game_modules = games_.path(),
         .adjust = [](v1::InstanceSpec& spec) { local::SetMovement("native:car_alone", spec); }});
  Driver driver(run_->cluster().control_address(), run_->instance_id());
  const auto protected_and_seen = [&] {
    driver.Frame(0);
    const v1::Instance instance = run_->Latest();
    return driver.Car() != nullptr && IsSettled() && instance.unprotected_regions().empty() &&
           std::ranges::all_of(instance.region_status(),
                               [](const auto& status) { return status.report().acknowledged_tick() > 60; });
  };
  ASSERT_TRUE(PlayUntil("a car in a protected world", protected_and_seen));
  ASSERT_TRUE(PlayUntil("driving", [&] {
    driver.Frame(-0.3F);
    return driver.At() > 10;
  }));
  EXPECT_TRUE(driver.predicted());
  const std::uint32_t owner = driver.Car()->region.value();
  ASSERT_EQ(kill(static_cast<pid_t>(ReportOf(owner).identity().pid()), SIGKILL), 0);
  const double before = driver.At();
  ASSERT_TRUE(PlayUntil("driving on", [&] {
    driver.Frame(-0.3F);
    return run_->Latest().failovers() > 0 && driver.Car() != nullptr && driver.At() > before + 10;
  }));
  EXPECT_TRUE(driver.predicted());
  EXPECT_EQ(driver.lacks(), "");
  ASSERT_TRUE(PlayUntil("a new worker in its place", [&] {
    driver.Frame(0);
    return IsSettled() && run_->Latest().regions() == 2;
  }));
  EXPECT_THAT(Tessera({"game", "logs", run_->instance_id()}).out, HasSubstr("five"));
}

class NativeClusterTest : public testing::Test {
 protected:
  void Start(const std::string& game_modules, std::uint32_t hosts = 2) {
    cluster_ = std::make_unique<local::LocalCluster>(local::LocalClusterOptions{
        .state_dir = games_.state(), .hosts = hosts, .capacity = 8, .game_modules = game_modules});
  }
  support::RunResult Tessera(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"--control", cluster_->control_address()});
    return support::RunProgram("tessera", arguments, std::chrono::seconds(150));
  }
  // One line, which says why.
  std::string Refusal(const std::string& game) {
    const support::RunResult made = Tessera({"instance", "create", "--scene", games_.scene(), "--game", game});
    EXPECT_NE(made.exit_code, 0) << made.out;
    EXPECT_EQ(std::count(made.err.begin(), made.err.end(), '\n'), 1) << made.err;
    return made.err;
  }

  GameFolder games_;
  std::unique_ptr<local::LocalCluster> cluster_;
};

TEST_F(NativeClusterTest, AGameThatCrashesThreeWorkersInARowStopsItsWorldWithTheReason) {
  for (const char* sanitizer : {"ASAN_OPTIONS", "TSAN_OPTIONS"}) {
    support::AddSanitizerOption(sanitizer, "handle_segv=0");  // its report would drive the reason out of the last lines
  }
  Start(games_.path());
  const auto made = Tessera(
      {"instance", "create", "--scene", games_.scene(), "--game", "native:crashes_late", "--regions", "4", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const auto watched = Tessera({"instance", "watch", "inst-1"});  // until it has ended
  EXPECT_THAT(watched.out, HasSubstr("FAILED"));
  // All regions crash at about one tick: a third death may be that of a region whose standby is dead as well.
  EXPECT_THAT(watched.out, AnyOf(HasSubstr("its game native:crashes_late@" +
                                           games_.HashOf("crashes_late").substr(0, 8) + " crashed 3 workers in a row"),
                                 HasSubstr("lost together with its standby")));
  EXPECT_THAT(watched.out, HasSubstr("Segmentation fault in on_tick"));
  EXPECT_THAT(Tessera({"instance", "describe", "inst-1"}).out,
              HasSubstr("worker died in game module crashes_late: Segmentation fault in on_tick"));
}

// Four workers of a host whose game does what an attacker would who had taken them over.
TEST_F(NativeClusterTest, AWorkerThatWasTakenOverReachesNothingElseOfItsHost) {
  Start(games_.path(), 1);
  const auto made = Tessera(
      {"instance", "create", "--scene", games_.scene(), "--game", "native:burglar", "--regions", "4", "--wait"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  std::string said;
  const auto patience_ends = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (said.find("burglar tried") == std::string::npos && std::chrono::steady_clock::now() < patience_ends) {
    said = Tessera({"game", "logs", "inst-1"}).out;
  }
  if (kNativeTestSanitized) {
    EXPECT_THAT(said, testing::Not(testing::ContainsRegex(
                          "burglar got (the host|the list|states|a scene|the password|a file|memory of|environ|the "
                          "agent|one connection|a list of desc)")))
        << said;
  } else {
    EXPECT_THAT(said, HasSubstr("got through 0")) << said;
    EXPECT_THAT(said, testing::Not(HasSubstr("burglar got"))) << said;
  }
  EXPECT_FALSE(fs::exists("/tmp/tessera-burglar"));
  EXPECT_THAT(said, testing::Not(HasSubstr("burglar lost"))) << "it spoke to its agent as a worker does";
  // Some of its lies named a sibling that runs, with its process; the kernel told the agent which one it was.
  EXPECT_THAT(host::ReadFile(cluster_->log_dir() + "/local-1.log", kMaxLogBytes).value(),
              testing::ContainsRegex("process [0-9]+ is not worker inst-1/[1-4]#"));
  // Nobody noticed: the world runs on, and its state is still written and fetched.
  ASSERT_EQ(Tessera({"instance", "checkpoint", "inst-1"}).exit_code, 0);
  const auto restored = Tessera({"instance", "restore", "inst-1", "--wait"});
  EXPECT_EQ(restored.exit_code, 0) << restored.err;
}

// The movement is the hosts', beside a file that travels to them; a checkpoint names it.
TEST_F(NativeClusterTest, AGameInLuaRunsWithAMovementOfTheHosts) {
  Start(games_.path());
  const std::string game = games_.state() + "/drive.lua";
  std::ofstream(game) << kDriveGame;
  const auto create = [&](const std::string& movement, const std::string& scene = kCarScene) {
    return Tessera(
        {"instance", "create", "--scene", scene, "--game", game, "--movement", movement, "--regions", "2", "--wait"});
  };
  const auto made = create("native:car_alone");
  ASSERT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(Tessera({"instance", "describe", "inst-1"}).out,
              HasSubstr(" with native:car_alone@" + games_.HashOf("car_alone").substr(0, 8)));
  ASSERT_EQ(Tessera({"instance", "checkpoint", "inst-1"}).exit_code, 0);
  const std::string file = games_.state() + "/drive.tessera";
  ASSERT_EQ(Tessera({"instance", "export", "inst-1", file}).exit_code, 0);
  const auto imported = Tessera({"instance", "import", file, "-o", "name"});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  EXPECT_THAT(Tessera({"instance", "describe", "inst-2"}).out, HasSubstr(" with native:car_alone@"));
  EXPECT_THAT(create("native:bounce").err, HasSubstr("local-1 (it has no movement)"));
  EXPECT_THAT(create("car_alone.so").err, HasSubstr("--movement car_alone.so: must be native:NAME"));
  EXPECT_THAT(create("native:car_alone", games_.scene()).err,
              HasSubstr("movement car: kind: the scene has no kind \"car\""));
  EXPECT_THAT(Refusal("native:car_alone"), HasSubstr("local-1 (it has a movement alone, and is no game)"));
  EXPECT_THAT(Tessera({"host", "describe", "local-1"}).out, testing::ContainsRegex("car_alone +movement +1 "));
}

TEST_F(NativeClusterTest, WhatNoHostCanRunIsRefusedWithTheReasonOfEach) {
  Start(games_.path());
  EXPECT_THAT(Refusal("native:absent"), HasSubstr("native:absent: local-1 (has no such game module), local-2 (has"));
  EXPECT_THAT(Refusal("native:other_abi"), HasSubstr("local-1 (is made for version 8 of the interface"));
  EXPECT_THAT(Refusal("native:no_entry"), HasSubstr("local-1 (has no function tessera_game_module_1)"));
  EXPECT_THAT(Refusal("native:bounce@" + std::string(64, 'a')),
              HasSubstr("local-1 (has build " + games_.HashOf("bounce").substr(0, 8)));
  EXPECT_THAT(Refusal("native:../bounce"), HasSubstr("its name must be 1 to 63 letters"));
  EXPECT_THAT(Refusal("native:bounce@feed"), HasSubstr("64 hexadecimal digits"));
  const std::string host = Tessera({"host", "describe", "local-1"}).out;
  EXPECT_THAT(host, HasSubstr(games_.HashOf("bounce")));
  EXPECT_THAT(host, HasSubstr("is made for version 8 of the interface, and this is version 1"));
}

TEST_F(NativeClusterTest, AHostWithoutAFolderHasNone) {
  Start("", 1);
  EXPECT_THAT(Refusal("native:bounce"), HasSubstr("local-1 (has no such game module)"));
}

}  // namespace
}  // namespace tessera::end_to_end

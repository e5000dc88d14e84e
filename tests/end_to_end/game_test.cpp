// Games on a cluster of real processes: what they do is seen by players and outlives deaths; a game that does not load
// makes nothing.
#include <gmock/gmock.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "core/world/partition_io.h"
#include "host/temporary_folder.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_watch.h"
#include "telemetry/http_get.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using testing::HasSubstr;

constexpr BodyId kBall{2};
constexpr Vec3d kBallAt{-6, 1, -6};

// A ball that a game throws up again whenever it comes down, in one of four regions.
constexpr char kScene[] = R"(
  name: "bounce"
  bounds { min { x: -12 y: -2 z: -12 } max { x: 12 y: 20 z: 12 } }
  properties { name: "hits" number: 0 }
  instance_properties { name: "round" number: 1 }
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
constexpr char kGame[] = R"(
local PUSH = 3

kinds.ball = {
  on_contact = function(self, other)
    self.hits = self.hits + 1
    self:impulse(vec(0, PUSH, 0))
    print("hit", self.hits)
  end,
}
)";

class GameTest : public WorldTest {
 protected:
  void SetUp() override {
    scene_ = Write("bounce.textproto", kScene);
    game_ = Write("bounce.lua", kGame);
  }
  std::string Write(const std::string& name, const std::string& text) {
    const std::string path = folder_.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << text;
    return path;
  }
  // As the player sees it.
  std::int64_t Hits() {
    const auto value = run_->bots()[0]->client().PropertyOf(kBall, "hits");
    return value ? std::get<std::int64_t>(*value) : -1;
  }
  std::uint32_t OwnerOfBall() { return FromProto(run_->Latest().map())->OwnerOf(kBallAt).value(); }
  testing::AssertionResult PlayUntilRegionsAreProtected() {
    return PlayUntil("all regions protected", [this] {
      const v1::Instance instance = run_->Latest();
      return IsSettled() && instance.unprotected_regions().empty() &&
             std::ranges::all_of(instance.region_status(),
                                 [](const auto& status) { return status.report().acknowledged_tick() > 60; });
    });
  }
  testing::AssertionResult PlayUntilHits(std::int64_t count) {
    return PlayUntil("the ball was hit", [this, count] { return Hits() >= count; });
  }
  // The workers' series of that name, added up.
  double Metric(const std::string& name) {
    double sum = 0;
    const v1::Instance instance = run_->Latest();
    for (const v1::RegionStatus& status : instance.region_status()) {
      const v1::RegionAddress& at = status.report().address();
      const auto page = telemetry::HttpGet(at.host() + ":" + std::to_string(at.metrics_port()), "/metrics");
      if (!page.ok()) continue;
      const auto place = page->body.find("\n" + name + " ");
      if (place != std::string::npos) sum += std::stod(page->body.substr(place + name.size() + 2));
    }
    return sum;
  }

  host::TemporaryFolder folder_;
  std::string scene_, game_;
};

TEST_F(GameTest, WhatAGameDoesIsSeenByPlayersAndOutlivesTheRegionThatDidIt) {
  Start({.scene = scene_, .game = game_, .regions = 4, .bots = 1, .hosts = 2, .capacity = 4});
  EXPECT_EQ(run_->Latest().game_name(), "bounce.lua");
  EXPECT_THAT(Tessera({"instance", "list"}).out, HasSubstr("bounce.lua (" + run_->Latest().game_hash().substr(0, 12)));
  EXPECT_THAT(Tessera({"instance", "describe", run_->instance_id()}).out, HasSubstr("Game:     bounce.lua ("));
  ASSERT_TRUE(PlayUntilRegionsAreProtected());
  ASSERT_TRUE(PlayUntilHits(3));
  EXPECT_GE(Metric("tessera_game_calls_total"), 3);
  EXPECT_EQ(Metric("tessera_game_errors_total"), 0);

  const auto round = [this] { return std::get<std::int64_t>(*run_->bots()[0]->client().WorldPropertyOf("round")); };
  EXPECT_EQ(round(), 1);
  const support::RunResult set = Tessera({"instance", "set-property", run_->instance_id(), "world", "round", "7"});
  ASSERT_EQ(set.exit_code, 0) << set.err;
  EXPECT_THAT(set.out, HasSubstr("world: round = 7"));
  ASSERT_TRUE(PlayUntil("the client knows", [&] { return round() == 7; }));
  ASSERT_TRUE(PlayUntil("operators see it", [this] {
    return Tessera({"instance", "describe", run_->instance_id()}).out.find("World:    round = 7") != std::string::npos;
  }));

  const std::uint32_t owner = OwnerOfBall();
  const auto victim = static_cast<pid_t>(ReportOf(owner).identity().pid());
  const std::int64_t before = Hits();
  ASSERT_EQ(kill(victim, SIGKILL), 0);
  std::int64_t least = before;
  ASSERT_TRUE(PlayUntil("hits by whoever has the ball now", [&] {
    least = std::min(least, Hits());
    return run_->Latest().failovers() > 0 && Hits() >= before + 3;
  }));
  // A hit that the standby had not heard of yet is made again.
  EXPECT_GE(least, before - 1) << "the count did not begin anew";
  ASSERT_TRUE(PlayUntil("a new worker in its place", [&] { return IsSettled() && run_->Latest().regions() == 4; }));
  EXPECT_EQ(run_->Latest().lost_bodies(), 0u);
  EXPECT_EQ(round(), 7) << "whichever region has the world's record now";

  const std::string log = Tessera({"game", "logs", run_->instance_id()}).out;
  EXPECT_THAT(log, HasSubstr("region " + std::to_string(owner) + " tick"));
  EXPECT_THAT(log, HasSubstr("body 2: hit 1\n"));
  // The next one may have been the victim's, and its line had not left it yet.
  EXPECT_THAT(log, HasSubstr("body 2: hit " + std::to_string(before + 2) + "\n"));
}

TEST_F(GameTest, AGameIsStoredWithItsInstanceAndExportedWithItsCheckpoint) {
  Start({.scene = scene_, .game = game_, .regions = 2, .bots = 1, .hosts = 1, .capacity = 8});
  ASSERT_TRUE(PlayUntilRegionsAreProtected());
  ASSERT_TRUE(PlayUntilHits(2));
  const std::string hash = run_->Latest().game_hash();
  run_->cluster().KillControl();
  run_->cluster().RestartControl();
  run_->WatchAnew();
  ASSERT_TRUE(PlayUntil("the instance is there again", [this] { return IsSettled(); }));
  EXPECT_EQ(run_->Latest().game_hash(), hash);
  ASSERT_EQ(Tessera({"instance", "checkpoint", run_->instance_id()}).exit_code, 0)
      << "it reads the game from the store";
  const auto restarted = Tessera({"instance", "restart-workers", run_->instance_id(), "--wait"});
  EXPECT_EQ(restarted.exit_code, 0) << restarted.err;
  ASSERT_TRUE(PlayUntilHits(Hits() + 2)) << "the new workers run it too";
  const std::string file = folder_.path() + "/world.tessera";
  ASSERT_EQ(Tessera({"instance", "export", run_->instance_id(), file}).exit_code, 0);
  std::set<std::int64_t> before;
  for (const auto& [region, pid] : Pids()) before.insert(pid);
  const support::RunResult restored = Tessera({"instance", "restore", run_->instance_id()});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  // Its player does not come back, so all are linked and wait: by then they have loaded the game.
  local::InstanceWatch again(run_->connection(), run_->instance_id());
  EXPECT_TRUE(again.WaitUntil(
      [&](const v1::Instance& now) {
        return now.region_status_size() == 2 && std::ranges::all_of(now.region_status(), [&](const auto& status) {
                 return status.report().phase() >= v1::WORKER_PHASE_LINKED &&
                        !before.contains(status.report().identity().pid());
               });
      },
      kPatience))
      << again.Latest().ShortDebugString();
  EXPECT_EQ(Tessera({"instance", "delete", run_->instance_id(), "--wait"}).exit_code, 0);

  // Then it can come from the exported file alone.
  const auto games = std::filesystem::path(run_->cluster().log_dir()).parent_path() / "local-1" / "games";
  ASSERT_TRUE(std::filesystem::remove(games / (hash + ".game"))) << games;
  const support::RunResult made = Tessera({"-o", "name", "instance", "import", file});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::string id = made.out.substr(made.out.find('/') + 1, made.out.find('\n') - made.out.find('/') - 1);
  local::InstanceWatch watch(run_->connection(), id);
  const auto runs = [&](const v1::Instance& now) {
    return now.state() == v1::INSTANCE_STATE_RUNNING && now.game_hash() == hash && now.game_name() == "bounce.lua";
  };
  EXPECT_TRUE(watch.WaitUntil(runs, kPatience)) << watch.Latest().ShortDebugString();
  EXPECT_TRUE(std::filesystem::exists(games / (hash + ".game")));
}

TEST_F(GameTest, AGameThatFailsIsReportedAndTheWorldRunsOn) {
  const std::string failing = Write("failing.lua", "function on_tick()\n  local x = nil + world.tick()\nend\n");
  Start({.scene = scene_, .game = failing, .regions = 2, .bots = 1, .hosts = 1, .capacity = 2});
  const auto has_event = [this](const std::string& text) {
    const v1::Instance instance = run_->Latest();
    return std::ranges::any_of(instance.events(),
                               [&](const auto& event) { return event.text().find(text) != std::string::npos; });
  };
  ASSERT_TRUE(PlayUntil("both events", [&] {
    return has_event("failing.lua:2: ") && has_event("on_tick failed 20 times in a row and is off");
  }));
  EXPECT_THAT(Tessera({"game", "logs", run_->instance_id()}).out, HasSubstr("error: failing.lua:2: "));
  EXPECT_EQ(Metric("tessera_game_callbacks_off"), 2);
  EXPECT_EQ(Metric("tessera_game_errors_total"), 40);
  const std::uint64_t tick = run_->bots()[0]->client().tick().value();
  ASSERT_TRUE(PlayUntil("the world runs on", [&] { return run_->bots()[0]->client().tick().value() > tick + 60; }));
}

TEST_F(GameTest, AnotherGameTakesItsPlaceWhilePlayersPlayAndNobodyNotices) {
  Start({.scene = scene_, .game = game_, .regions = 4, .bots = 8, .hosts = 2, .capacity = 4});
  ASSERT_TRUE(PlayUntilRegionsAreProtected());
  ASSERT_TRUE(PlayUntilHits(2));
  const std::string id = run_->instance_id();
  const std::string first = run_->Latest().game_hash();
  const support::RunResult broken =
      Tessera({"instance", "set-game", id, Write("broken.lua", "local x = 1\nx = = 2\n")});
  EXPECT_NE(broken.exit_code, 0);
  EXPECT_THAT(broken.err, HasSubstr("broken.lua:2: "));
  const support::RunResult foreign =
      Tessera({"instance", "set-game", id, Write("foreign.lua", "\nkinds.goat = { on_tick = function(self) end }\n")});
  EXPECT_NE(foreign.exit_code, 0);
  EXPECT_THAT(foreign.err, HasSubstr("foreign.lua:2: ")) << "the scene has no such kind";
  EXPECT_EQ(run_->Latest().next_game_hash(), "");

  const std::string second = Write("second.lua", R"(
kinds.ball = {
  on_migrate = function(self, from) self.hits = 1000; print("from game", from) end,
  on_contact = function(self) self.hits = self.hits + 1; self:impulse(vec(0, 3, 0)); world.count("hits") end,
}
)");
  const support::RunResult set = Tessera({"instance", "set-game", id, second, "--wait"});
  ASSERT_EQ(set.exit_code, 0) << set.err;
  EXPECT_THAT(set.out, HasSubstr("game from tick "));
  ASSERT_TRUE(PlayUntilHits(1003)) << "the second game counts from what it made of the first one's count";
  EXPECT_NE(run_->Latest().game_hash(), first);
  EXPECT_THAT(Tessera({"instance", "describe", id}).out, HasSubstr("Game:     second.lua ("));
  EXPECT_THAT(Tessera({"game", "logs", id}).out, HasSubstr("body 2: from game 0\n"));
  for (local::Bot* bot : run_->bots()) {
    EXPECT_EQ(bot->client().state(), client::ClientState::kPlaying);
    EXPECT_EQ(bot->client().Stats().reconnects, 0u) << "nobody was dropped";
  }
  ASSERT_TRUE(
      PlayUntil("the game's counter", [this] { return Metric("tessera_game_counter_total{name=\"hits\"}") >= 3; }));
}

TEST_F(GameTest, APausedWorldKeepsItsPlayersShowsThemThatItStandsAndStepsByTicks) {
  Start({.scene = scene_, .game = game_, .regions = 4, .bots = 2, .hosts = 2, .capacity = 4});
  ASSERT_TRUE(PlayUntilRegionsAreProtected());
  const std::string id = run_->instance_id();
  const support::RunResult paused = Tessera({"instance", "pause", id, "--wait"});
  ASSERT_EQ(paused.exit_code, 0) << paused.err;
  EXPECT_THAT(paused.out, HasSubstr("paused after tick "));
  ASSERT_TRUE(PlayUntil("players know", [this] {
    return std::ranges::all_of(run_->bots(), [](local::Bot* bot) { return bot->client().clock().paused; });
  }));
  EXPECT_THAT(Tessera({"instance", "list"}).out, HasSubstr("PAUSED"));
  EXPECT_THAT(Tessera({"instance", "set-property", id, "2", "hits", "5"}).err, HasSubstr("is paused"));
  const std::uint64_t tick = run_->bots()[0]->client().tick().value();
  std::uint64_t reports = 0;
  const std::uint64_t revision = ReportOf(1).tick();
  ASSERT_TRUE(PlayUntil("time passes", [&] { return ++reports > 60; }));
  EXPECT_EQ(run_->bots()[0]->client().tick().value(), tick);
  EXPECT_EQ(ReportOf(1).tick(), revision);
  const support::RunResult joined = Tessera({"client", id, "--seconds", "1"});
  EXPECT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_THAT(joined.out, HasSubstr("world paused")) << "who joins is told";

  std::uint64_t stands = tick;
  for (const std::uint64_t ticks : {1, 25, 2}) {
    const support::RunResult step = Tessera({"instance", "step", id, "--ticks", std::to_string(ticks), "--wait"});
    ASSERT_EQ(step.exit_code, 0) << step.err;
    stands += ticks;
    EXPECT_THAT(step.out, HasSubstr("paused after tick " + std::to_string(stands)));
    ASSERT_TRUE(PlayUntil("all regions stand there, and players see it", [&] {
      bool all = true;
      for (std::uint32_t region = 1; region <= 4; ++region) all = all && ReportOf(region).tick() == stands;
      const client::Client& client = run_->bots()[0]->client();
      return all && client.clock().paused && client.tick().value() == stands;
    }));
  }
  EXPECT_THAT(Tessera({"instance", "step", id, "--ticks", "36001"}).err, HasSubstr("--ticks"));

  ASSERT_EQ(Tessera({"instance", "resume", id, "--wait"}).exit_code, 0);
  EXPECT_THAT(Tessera({"instance", "step", id}).err, HasSubstr("is not paused"));
  ASSERT_TRUE(PlayUntil("it goes on", [&] {
    return !run_->bots()[0]->client().clock().paused && run_->bots()[0]->client().tick().value() > tick + 60;
  }));
  ASSERT_EQ(Tessera({"instance", "pace", id, "--ticks-per-second", "10", "--wait"}).exit_code, 0);
  ASSERT_TRUE(PlayUntil("slow motion", [this] { return run_->bots()[0]->client().clock().ticks_per_second == 10; }));
  EXPECT_NE(Tessera({"instance", "pace", id, "--ticks-per-second", "0"}).exit_code, 0);
  EXPECT_NE(Tessera({"instance", "pace", id, "--ticks-per-second", "nan"}).exit_code, 0);
  EXPECT_NE(Tessera({"instance", "pause", "inst-99"}).exit_code, 0);
  for (local::Bot* bot : run_->bots()) EXPECT_EQ(bot->client().Stats().reconnects, 0u);
}

}  // namespace
}  // namespace tessera::end_to_end

// Worlds that come back from the disk.
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>

#include "host/temporary_folder.h"
#include "local_cluster/checkpoint_file.h"
#include "local_cluster/connection.h"
#include "local_cluster/instance_watch.h"
#include "tests/end_to_end/world_fixture.h"

namespace tessera::end_to_end {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// Several workers die at once if none of them can do anything between the first and the last death.
constexpr int kAtOnce[] = {SIGSTOP, SIGKILL};

class CheckpointTest : public WorldTest {
 protected:
  v1::Checkpoint MakeCheckpoint() {
    v1::CheckpointInstanceRequest request;
    request.set_id(run_->instance_id());
    return run_->connection()
        .Call("checkpoint", run_->connection().instances(), &v1::InstanceService::Stub::CheckpointInstance, request,
              std::chrono::milliseconds(kPatience))
        .checkpoint();
  }
  std::uint64_t Checkpoint() { return MakeCheckpoint().tick(); }
  std::filesystem::path FileOf(std::uint64_t tick, const std::string& name) {
    return std::filesystem::path(run_->cluster().log_dir()).parent_path() / "control" / "checkpoints" /
           run_->instance_id() / std::to_string(tick) / name;
  }
  static void FlipAByte(const std::filesystem::path& path) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(20);
    const char byte = static_cast<char>(file.get() ^ 0x40);
    file.seekp(20);
    file.put(byte);
    ASSERT_TRUE(file.flush()) << path;
  }
  bool AllAreOthersThan(const std::map<std::uint32_t, std::int64_t>& pids) {
    const auto now = Pids();
    return now.size() == pids.size() &&
           std::ranges::none_of(now, [&](const auto& at) { return pids.at(at.first) == at.second; });
  }
  testing::AssertionResult PlayUntilAllAreOthersThan(const std::map<std::uint32_t, std::int64_t>& pids) {
    return PlayUntil("all workers are new ones", [&] { return IsSettled() && AllAreOthersThan(pids); });
  }
  // A player, with all that its client has told it.
  struct Player {
    client::Client& client() { return bot->client(); }
    bool Play() {
      const bool going = bot->Frame(client::Clock::now());
      events.insert(events.end(), bot->events().begin(), bot->events().end());
      return going;
    }
    std::ptrdiff_t Count(client::ClientEvent::Kind kind) const {
      return std::ranges::count(events, kind, &client::ClientEvent::kind);
    }

    std::unique_ptr<local::Bot> bot;
    std::vector<client::ClientEvent> events{};
  };
  absl::StatusOr<Player> Join() {
    auto bot = local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "ann", 3);
    if (!bot.ok()) return bot.status();
    return Player{.bot = *std::move(bot)};
  }
};

// Its players learn that the world they were in has ended, and come back to their bodies of then.
TEST_F(CheckpointTest, ARestoredWorldGoesOnFromItsCheckpointAndItsPlayersComeBackToIt) {
  Start({.scene = "", .regions = 4, .bots = 0, .hosts = 2, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  const auto join = [&](const std::vector<std::uint8_t>& returning) {
    return local::Bot::Join(run_->cluster().control_address(), run_->instance_id(), "ann", 3, returning);
  };
  const auto ann = join({});
  ASSERT_TRUE(ann.ok()) << ann.status();
  const BodyId body = (*ann)->client().own_body();
  ASSERT_TRUE(PlayUntil(
      "she walks", [&] { return (*ann)->Frame(client::Clock::now()) && (*ann)->client().last_applied_input() > 60; }));
  const std::uint64_t tick = Checkpoint();
  ASSERT_TRUE(PlayUntil("a second later", [&] { return ReportOf(1).tick() > tick + 60; }));
  const auto pids = Pids();
  const support::RunResult restored = Tessera({"instance", "restore", run_->instance_id()});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_THAT(restored.out, HasSubstr("from tick " + std::to_string(tick)));
  ASSERT_TRUE(PlayUntilAllAreOthersThan(pids));
  EXPECT_GE(run_->Latest().lost_ticks(), 60u);

  const auto back = join((*ann)->client().return_token());
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_EQ((*back)->client().own_body(), body);
  ASSERT_TRUE(PlayUntil("she sees herself and all others", [&] {
    return (*back)->Frame(client::Clock::now()) && (*back)->client().World().contains(body) &&
           (*back)->client().World().size() > kBodies;
  }));
}

// The workers that end say that the world does not, so a client asks for a newer grant and does not end.
TEST_F(CheckpointTest, APlayerOfARestoredWorldComesBackByItselfWithTheSameClient) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 1, .capacity = 4});
  ASSERT_TRUE(PlayUntilProtected());
  auto ann = Join();
  ASSERT_TRUE(ann.ok()) << ann.status();
  client::Client& client = ann->client();
  const BodyId body = client.own_body();
  ASSERT_TRUE(PlayUntil("she walks", [&] { return ann->Play() && client.last_applied_input() > 60; }));
  const std::uint64_t tick = Checkpoint();
  // Further back than the restored world has come when she is in it again.
  ASSERT_TRUE(PlayUntil("ten seconds later", [&] { return ann->Play() && client.tick().value() > tick + 600; }));
  const auto pids = Pids();
  const support::RunResult restored = Tessera({"instance", "restore", run_->instance_id()});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  using Kind = client::ClientEvent::Kind;
  ASSERT_TRUE(PlayUntil("the world of then", [&] { return !ann->Play() || ann->Count(Kind::kRestored) > 0; }));
  EXPECT_EQ(client.state(), client::ClientState::kPlaying) << client.reason();
  const auto lost = std::ranges::find(ann->events, Kind::kRegionLost, &client::ClientEvent::kind);
  ASSERT_NE(lost, ann->events.end());
  EXPECT_THAT(lost->detail, HasSubstr("goes on elsewhere"));
  EXPECT_GE(ann->Count(Kind::kGrantNeeded), 1);
  ASSERT_TRUE(PlayUntil("she sees herself and all others, and walks", [&] {
    return ann->Play() && client.World().contains(body) && client.World().size() > kBodies &&
           client.last_applied_input() > 0;
  }));
  EXPECT_EQ(&ann->client(), &client);
  EXPECT_EQ(client.own_body(), body);
  EXPECT_TRUE(std::ranges::none_of(Pids(), [&](const auto& at) { return pids.at(at.first) == at.second; }));
}

TEST_F(CheckpointTest, OneThatIsAskedForAmidAChangeComesAfterIt) {
  // None is made by itself: one that was under way would be the answer.
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 1, .capacity = 8, .adjust = [](v1::InstanceSpec& spec) {
           spec.mutable_checkpoint_interval()->set_seconds(0);
         }});
  ASSERT_TRUE(PlayUntilProtected());
  const support::RunResult scaled = Tessera({"instance", "scale", run_->instance_id(), "--regions", "3"});
  ASSERT_EQ(scaled.exit_code, 0) << scaled.err;
  // The change begins after the answer: a checkpoint in between is one of two regions.
  ASSERT_TRUE(PlayUntil("the third has a place", [&] { return run_->Latest().regions() == 3; }));
  EXPECT_EQ(MakeCheckpoint().regions(), 3u) << run_->Latest().ShortDebugString();
}

TEST_F(CheckpointTest, AnUpgradedWorldBeginsAnewInTheNextTickAndItsPlayersComeBack) {
  Start({.scene = "", .regions = 4, .bots = 0, .hosts = 2, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  auto ann = Join();
  ASSERT_TRUE(ann.ok()) << ann.status();
  client::Client& client = ann->client();
  const BodyId body = client.own_body();
  ASSERT_TRUE(PlayUntil("she walks", [&] { return ann->Play() && client.last_applied_input() > 60; }));
  const auto pids = Pids();
  const Tick before = client.tick();
  const support::RunResult upgraded = Tessera({"instance", "upgrade", run_->instance_id()});
  ASSERT_EQ(upgraded.exit_code, 0) << upgraded.err;
  EXPECT_THAT(upgraded.out, HasSubstr("upgraded: it begins anew after tick "));
  ASSERT_TRUE(PlayUntil("other workers", [&] { return ann->Play() && IsSettled() && AllAreOthersThan(pids); }));
  EXPECT_EQ(run_->Latest().lost_ticks(), 0u);
  EXPECT_EQ(run_->Latest().failovers(), 0u);
  ASSERT_TRUE(PlayUntil("she walks on among all others", [&] {
    return ann->Play() && client.tick() > before + 60 && client.World().contains(body) &&
           client.World().size() > kBodies;
  }));
  EXPECT_EQ(client.own_body(), body);

  // One that stands stays so.
  ASSERT_EQ(Tessera({"instance", "pause", run_->instance_id()}).exit_code, 0);
  ASSERT_TRUE(
      PlayUntil("it stands", [&] { return ann->Play() && run_->Latest().state() == v1::INSTANCE_STATE_PAUSED; }));
  const auto standing_pids = Pids();
  const support::RunResult standing = Tessera({"instance", "upgrade", run_->instance_id(), "--wait"});
  ASSERT_EQ(standing.exit_code, 0) << standing.err;
  ASSERT_TRUE(PlayUntil("other workers, which stand", [&] {
    return ann->Play() && AllAreOthersThan(standing_pids) && run_->Latest().state() == v1::INSTANCE_STATE_PAUSED;
  }));
}

TEST_F(CheckpointTest, AWorldThatCannotBeUpgradedGoesOnAsItWas) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 1, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  // Where its checkpoints would lie is a file.
  const std::filesystem::path folder = FileOf(0, "").parent_path().parent_path();
  ASSERT_TRUE(std::filesystem::create_directories(folder.parent_path()) ||
              std::filesystem::is_directory(folder.parent_path()));
  ASSERT_TRUE((std::ofstream(folder) << "in the way").flush()) << folder;
  const auto pids = Pids();
  const support::RunResult refused = Tessera({"instance", "upgrade", run_->instance_id()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("the checkpoint of " + run_->instance_id() + " could not be made: "));
  const std::uint64_t tick = ReportOf(1).tick();
  ASSERT_TRUE(PlayUntil("it goes on", [&] { return IsSettled() && ReportOf(1).tick() > tick + 60; }));
  EXPECT_EQ(Pids(), pids);
  const v1::Instance world = run_->Latest();
  EXPECT_TRUE(std::ranges::any_of(world.events(), [](const v1::InstanceEvent& event) {
    return event.text().starts_with("not upgraded: id: the checkpoint of ");
  }));
}

TEST_F(CheckpointTest, ADamagedCheckpointIsRefusedByNameAndTheOneBeforeItIsUsed) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 1, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  const std::uint64_t older = Checkpoint(), newer = Checkpoint();
  ASSERT_LT(older, newer);
  FlipAByte(FileOf(newer, "region-2"));
  const support::RunResult refused =
      Tessera({"instance", "restore", run_->instance_id(), "--tick", std::to_string(newer)});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("checkpoint " + std::to_string(newer)));
  EXPECT_THAT(refused.err, HasSubstr("region-2"));
  const auto pids = Pids();
  const support::RunResult restored = Tessera({"instance", "restore", run_->instance_id()});
  EXPECT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_THAT(restored.err, HasSubstr("region-2"));
  EXPECT_THAT(restored.out, HasSubstr("from tick " + std::to_string(older)));
  ASSERT_TRUE(PlayUntilAllAreOthersThan(pids));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

// All workers at once: nobody has a copy any more.
TEST_F(CheckpointTest, AWorldWhoseWorkersAllDieComesBackFromItsCheckpointAndSaysWhatThatCost) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 2, .capacity = 4});
  ASSERT_TRUE(PlayUntilProtected());
  const std::uint64_t tick = Checkpoint();
  ASSERT_TRUE(PlayUntil("a second later", [&] { return ReportOf(1).tick() > tick + 60; }));
  const std::uint64_t reached = ReportOf(1).tick();
  const auto pids = Pids();
  for (const int signal : kAtOnce) {
    for (const auto& [region, pid] : pids) kill(static_cast<pid_t>(pid), signal);
  }
  ASSERT_TRUE(PlayUntilAllAreOthersThan(pids));
  const v1::Instance instance = run_->Latest();
  // The world makes checkpoints of its own besides.
  const std::string text = instance.events().rbegin()->text();
  std::smatch from;
  ASSERT_TRUE(std::regex_search(text, from, std::regex("restored from the checkpoint of tick ([0-9]+)"))) << text;
  EXPECT_GE(std::stoull(from[1]), tick);
  EXPECT_GE(instance.lost_ticks() + std::stoull(from[1]), reached);
  EXPECT_EQ(instance.failovers(), 0u);
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

// A rollback was undone so: the newest checkpoint was of the time that it had taken back.
TEST_F(CheckpointTest, ARollbackIsNotUndoneByTheNextCrash) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 2, .capacity = 4});
  ASSERT_TRUE(PlayUntilProtected());
  const std::uint64_t first = Checkpoint();
  ASSERT_TRUE(PlayUntil("two seconds later", [&] { return ReportOf(1).tick() > first + 120; }));
  const std::uint64_t second = Checkpoint();
  const auto before = Pids();
  const support::RunResult restored =
      Tessera({"instance", "restore", run_->instance_id(), "--tick", std::to_string(first)});
  ASSERT_EQ(restored.exit_code, 0) << restored.err;
  ASSERT_TRUE(PlayUntilAllAreOthersThan(before));
  const support::RunResult listed = Tessera({"instance", "checkpoints", run_->instance_id()});
  EXPECT_THAT(listed.out, testing::ContainsRegex(std::to_string(second) + " [^\n]*taken back"));
  EXPECT_THAT(listed.out, testing::Not(testing::ContainsRegex(std::to_string(first) + " [^\n]*taken back")));
  const auto pids = Pids();
  for (const int signal : kAtOnce) {
    for (const auto& [region, pid] : pids) kill(static_cast<pid_t>(pid), signal);
  }
  ASSERT_TRUE(PlayUntilAllAreOthersThan(pids));
  const std::string text = run_->Latest().events().rbegin()->text();
  EXPECT_THAT(text, HasSubstr("restored from the checkpoint of tick"));
  EXPECT_THAT(text, testing::Not(HasSubstr("tick " + std::to_string(second) + ",")));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

// The others run, and have none of what those two had.
TEST_F(CheckpointTest, ARegionThatIsKilledTogetherWithItsStandbyComesBackFromTheCheckpointAsALossOfTime) {
  Start({.scene = "", .regions = 4, .bots = 0, .hosts = 2, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  const std::uint64_t tick = Checkpoint();
  ASSERT_TRUE(PlayUntil("a second later", [&] { return ReportOf(1).tick() > tick + 60; }));
  const auto pids = Pids();
  const v1::Instance before = run_->Latest();
  const auto region = std::ranges::find(before.map().regions(), 1u, &v1::MapRegion::id);
  for (const int signal : kAtOnce) {
    for (const std::uint32_t victim : {1u, region->standby()}) kill(static_cast<pid_t>(pids.at(victim)), signal);
  }
  ASSERT_TRUE(PlayUntilAllAreOthersThan(pids));
  const v1::Instance instance = run_->Latest();
  EXPECT_GE(instance.lost_ticks(), 60u);
  EXPECT_EQ(instance.lost_bodies(), 0u);
  EXPECT_EQ(instance.failovers(), 0u) << "that would be reported as a success";
  EXPECT_THAT(instance.events().rbegin()->text(), HasSubstr("restored from the checkpoint of tick"));
  ASSERT_TRUE(PlayOn(2));
  ExpectAllIsThere();
}

TEST_F(CheckpointTest, AnExportedWorldStartsAnewWithAllItsBodies) {
  Start({.scene = "", .regions = 2, .bots = 0, .hosts = 1, .capacity = 8});
  ASSERT_TRUE(PlayUntilProtected());
  Checkpoint();
  const host::TemporaryFolder folder;
  const std::string file = folder.path() + "/world.tessera";
  ASSERT_EQ(Tessera({"instance", "export", run_->instance_id(), file}).exit_code, 0);

  const v1::Instance made = local::ImportCheckpoint(run_->connection(), file, {.request_id = "once"});
  EXPECT_NE(made.id(), run_->instance_id());
  EXPECT_EQ(local::ImportCheckpoint(run_->connection(), file, {.request_id = "once"}).id(), made.id());
  local::InstanceWatch watch(run_->connection(), made.id());
  const auto whole = [](const v1::Instance& now) {
    std::uint64_t owned = 0;
    for (const v1::RegionStatus& status : now.region_status()) owned += status.report().owned();
    return now.state() == v1::INSTANCE_STATE_RUNNING && owned >= kBodies;
  };
  EXPECT_TRUE(watch.WaitUntil(whole, kPatience)) << watch.Latest().ShortDebugString();

  FlipAByte(file);
  const support::RunResult damaged = Tessera({"instance", "import", file});
  EXPECT_EQ(damaged.exit_code, 1);
  EXPECT_THAT(damaged.err, HasSubstr("file"));
  EXPECT_EQ(std::count(damaged.err.begin(), damaged.err.end(), '\n'), 1) << damaged.err;
}

}  // namespace
}  // namespace tessera::end_to_end

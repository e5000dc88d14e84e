// Another game takes the place of the one that runs, with deaths on the way.
#include <gmock/gmock.h>

#include "core/game/game_file.h"
#include "spdlog/spdlog.h"
#include "tests/simulation/deployment.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kFirst[] = R"(
  kinds.ball = { on_tick = function(self) self.ticks = self.ticks + 1 end }
)";
constexpr char kSecond[] = R"(
  function on_migrate(from) world.migrated, world.from = world.migrated + 1, from end
  kinds.ball = {
    on_migrate = function(self, from) self.migrated = self.migrated + 1; self.from = from end,
    on_tick = function(self) self.ticks = self.ticks + 1; self.later = self.later + 1 end,
  }
)";

std::shared_ptr<const Scene> BallSwarm(int balls) {
  auto scene = std::make_shared<Scene>(*Swarm(20, balls).Build());
  scene->kinds = {"", "ball"};
  scene->properties = {{"ticks", std::int64_t{0}},
                       {"later", std::int64_t{0}},
                       {"migrated", std::int64_t{0}},
                       {"from", std::int64_t{-1}}};
  scene->instance_properties = {{"migrated", std::int64_t{0}}, {"from", std::int64_t{-1}}};
  for (BodyDef& body : scene->bodies) body.kind = body.motion == Motion::kDynamic ? 1 : 0;
  return scene;
}

struct Ball {
  std::int64_t ticks = 0, later = 0, migrated = 0, from = 0;
};

std::int64_t WholeOf(const region::Region& region, BodyId id, const char* name) {
  const Scene& scene = region.catalog().scene();
  const auto& declared = id == kInstanceBody ? scene.instance_properties : scene.properties;
  PropertySet changed;
  const region::KeptRecord* record = region.records().Find(id);
  if (record != nullptr && !record->bytes->empty()) changed = *PropertySet::Decode(*record->bytes, declared);
  return std::get<std::int64_t>(*ValueOf(declared, {}, changed, name));
}

// The one that owns the world's record.
SimulatedWorker& OwnerOfWorld(const Deployment& deployment) {
  const std::vector<SimulatedWorker*> workers = deployment.Workers();
  const auto owner = std::ranges::find_if(workers, [](const SimulatedWorker* worker) {
    return worker->region() != nullptr && worker->region()->OwnsWorld();
  });
  EXPECT_NE(owner, workers.end());
  return **owner;
}
std::int64_t OfWorld(const Deployment& deployment, const char* name) {
  return WholeOf(*OwnerOfWorld(deployment).region(), kInstanceBody, name);
}

std::map<BodyId, Ball> Balls(const Deployment& deployment) {
  std::map<BodyId, Ball> balls;
  for (const SimulatedWorker* worker : deployment.Workers()) {
    const region::Region* region = worker->region();
    if (region == nullptr) continue;
    for (const region::OwnedBody& body : region->owned()) {
      const BodyId id = body.def->id;
      balls[id] = {WholeOf(*region, id, "ticks"), WholeOf(*region, id, "later"), WholeOf(*region, id, "migrated"),
                   WholeOf(*region, id, "from")};
    }
  }
  return balls;
}

class SetGameTest : public testing::Test {
 protected:
  SetGameTest() { spdlog::set_level(spdlog::level::off); }

  static bool Runs(const Deployment& deployment, const std::string& game) {
    return deployment.instance().game_hash() == game::GameHash(game);
  }
  static bool AwaitGame(Deployment& deployment, const std::string& game) {
    return deployment.RunUntil(Milliseconds(20'000), [&] { return Runs(deployment, game); });
  }
  static void ExpectAllRun(const Deployment& deployment, std::uint32_t number) {
    for (const SimulatedWorker* worker : deployment.Workers()) {
      EXPECT_EQ(worker->core().run()->game()->number(), number) << worker->identity().region.value();
    }
  }
};

TEST_F(SetGameTest, AnotherGameTakesOverAtOneTickAndNoTickIsLost) {
  Deployment deployment(BallSwarm(40), {.game = kFirst});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  ASSERT_TRUE(AwaitGame(deployment, kSecond)) << deployment.Standing();
  ExpectAllRun(deployment, 1);
  const std::uint64_t since = deployment.instance().game_since_tick();
  EXPECT_EQ(deployment.instance().game_number(), 1u);
  deployment.RunFor(Milliseconds(1000));
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  const auto tick = static_cast<std::int64_t>(deployment.tick().value());
  const std::map<BodyId, Ball> balls = Balls(deployment);
  ASSERT_EQ(balls.size(), 40u);
  for (const auto& [id, ball] : balls) {
    EXPECT_EQ(ball.ticks, tick) << "a game ran in each tick of " << id.value();
    EXPECT_EQ(ball.later, tick + 1 - static_cast<std::int64_t>(since)) << "the second one from the same tick on";
    EXPECT_EQ(ball.migrated, 1);
    EXPECT_EQ(ball.from, 0);
  }
  EXPECT_EQ(OfWorld(deployment, "migrated"), 1) << "the world's own record, too";
  EXPECT_EQ(OfWorld(deployment, "from"), 0);
}

TEST_F(SetGameTest, AMigrationOfTheWorldThatFailsLeavesItAsItWasAndIsNotRepeated) {
  Deployment deployment(BallSwarm(10), {.game = kFirst});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  ASSERT_TRUE(AwaitGame(deployment, kSecond)) << deployment.Standing();
  const std::string failing = "function on_migrate(from)\n  world.migrated = 7\n  error('no')\nend\n";
  ASSERT_TRUE(deployment.SetGame(failing).ok());
  ASSERT_TRUE(AwaitGame(deployment, failing)) << deployment.Standing();
  deployment.RunFor(Milliseconds(1000));
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  EXPECT_EQ(OfWorld(deployment, "migrated"), 1);
  std::uint64_t errors = 0;
  for (const SimulatedWorker* worker : deployment.Workers())
    errors += worker->core().run()->game()->statistics().errors;
  EXPECT_EQ(errors, 1u);
  // The next game takes the record over from this one.
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  ASSERT_TRUE(AwaitGame(deployment, kSecond)) << deployment.Standing();
  deployment.RunFor(Milliseconds(500));
  EXPECT_EQ(OfWorld(deployment, "migrated"), 2);
  EXPECT_EQ(OfWorld(deployment, "from"), 2);
}

// Some region dies, or the one that owns the world's record.
TEST_F(SetGameTest, ADeathInAnyPhaseLeavesAllRegionsWithOneGame) {
  for (int phase = 0; phase < 20; ++phase) {
    Deployment deployment(BallSwarm(40), {.seed = static_cast<std::uint64_t>(phase + 1), .game = kFirst});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    ASSERT_TRUE(deployment.SetGame(kSecond).ok());
    deployment.RunFor(Milliseconds(70) * (phase / 2));
    deployment.Kill(phase % 2 == 0 ? RegionId(2) : OwnerOfWorld(deployment).identity().region);
    ASSERT_TRUE(AwaitGame(deployment, kSecond)) << phase << deployment.Standing();
    deployment.RunFor(Milliseconds(500));
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), IsEmpty()) << phase;
    ExpectAllRun(deployment, 1);
    const std::map<BodyId, Ball> balls = Balls(deployment);
    EXPECT_EQ(balls.size(), 40u);
    for (const auto& [id, ball] : balls) EXPECT_EQ(ball.migrated, 1) << phase << " body " << id.value();
    EXPECT_EQ(OfWorld(deployment, "migrated"), 1) << phase;
  }
}

TEST_F(SetGameTest, TheControlPlaneMayDieWhereverItStores) {
  for (int writes = 1; writes <= 5; ++writes) {
    Deployment deployment(BallSwarm(20), {.game = kFirst});
    ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
    deployment.control().DieAfterStores(writes);
    (void)deployment.SetGame(kSecond);
    deployment.RunFor(Milliseconds(2000));
    if (deployment.control().alive()) deployment.control().Kill();
    deployment.control().Start();
    ASSERT_TRUE(AwaitGame(deployment, kSecond)) << writes << deployment.Standing();
    deployment.Settle();
    EXPECT_THAT(deployment.problems(), IsEmpty()) << writes;
    ExpectAllRun(deployment, 1);
    for (const auto& [id, ball] : Balls(deployment)) {
      EXPECT_EQ(ball.migrated, 1);
      EXPECT_EQ(ball.ticks, static_cast<std::int64_t>(deployment.tick().value()));
    }
  }
}

TEST_F(SetGameTest, AGameThatDoesNotLoadInOneRegionRunsInNone) {
  Deployment deployment(BallSwarm(20), {.game = kFirst});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetGame(kSecond, {RegionId(3)}).ok());
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] { return !deployment.instance().game_refused().empty(); }));
  EXPECT_THAT(deployment.instance().game_refused(), HasSubstr("region 3: game "));
  EXPECT_THAT(deployment.instance().game_refused(), HasSubstr("has hash "));
  EXPECT_TRUE(Runs(deployment, kFirst));
  deployment.RunFor(Milliseconds(1000));
  ExpectAllRun(deployment, 0);
  EXPECT_EQ(deployment.instance().next_game_hash(), "");

  const std::string broken = "kinds.ball = = 2\n";
  ASSERT_TRUE(deployment.SetGame(broken).ok()) << "as if another Lua host had checked it";
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] {
    return deployment.instance().game_refused().find("next.lua:1: ") != std::string::npos;
  }));
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  ASSERT_TRUE(AwaitGame(deployment, kSecond)) << "where it loads everywhere it runs";
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  ExpectAllRun(deployment, 1);
  EXPECT_EQ(deployment.instance().game_refused(), "");
}

TEST_F(SetGameTest, RegionsThatJoinLaterRunTheNewestGameAndSoDoThoseAfterAThird) {
  Deployment deployment(BallSwarm(20), {.game = kFirst});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  ASSERT_TRUE(AwaitGame(deployment, kSecond));
  ASSERT_TRUE(deployment.Scale(5));
  ASSERT_TRUE(deployment.AwaitCalm(Milliseconds(60'000))) << deployment.Standing();
  ExpectAllRun(deployment, 1);
  ASSERT_TRUE(deployment.SetGame(kFirst).ok());
  ASSERT_TRUE(AwaitGame(deployment, kFirst));
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  ExpectAllRun(deployment, 2);
}

TEST_F(SetGameTest, OneAfterTheOtherAndOnlyWhereOneRuns) {
  Deployment deployment(BallSwarm(10), {.game = kFirst});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  ASSERT_TRUE(deployment.SetGame(kSecond).ok());
  EXPECT_TRUE(deployment.SetGame(kSecond).ok()) << "the same again is no other";
  const absl::Status busy = deployment.SetGame("kinds.ball = {}");
  EXPECT_EQ(busy.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(busy.message()), HasSubstr("is about to run game next.lua"));
  Deployment without(Swarm(20, 10).Build(), {});
  ASSERT_TRUE(without.AwaitCalm()) << without.Standing();
  const absl::Status none = without.SetGame(kSecond);
  EXPECT_EQ(none.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(none.message()), HasSubstr("runs no game"));
}

}  // namespace
}  // namespace tessera::simulation

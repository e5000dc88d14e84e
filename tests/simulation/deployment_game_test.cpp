// Games in a whole deployment: every region runs the ordered one, or none runs.
#include <gmock/gmock.h>

#include "spdlog/spdlog.h"
#include "tests/simulation/deployment.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

class DeploymentGameTest : public testing::Test {
 protected:
  DeploymentGameTest() { spdlog::set_level(spdlog::level::off); }
};

// Each ball counts its own ticks, and so does a region's loss of state show.
constexpr char kCounting[] = R"(
  kinds.ball = { on_tick = function(self) self.ticks = self.ticks + 1 end }
)";

std::shared_ptr<const Scene> CountingSwarm(int balls) {
  auto scene = std::make_shared<Scene>(*Swarm(20, balls).Build());
  scene->kinds = {"", "ball"};
  scene->properties = {{"ticks", std::int64_t{0}}};
  for (BodyDef& body : scene->bodies) body.kind = body.motion == Motion::kDynamic ? 1 : 0;
  return scene;
}

// Sum of a whole-number property over all bodies, as their owners have it.
std::int64_t SumOf(Deployment& deployment) {
  std::int64_t sum = 0;
  for (SimulatedWorker* worker : deployment.Workers()) {
    if (worker->region() == nullptr) continue;
    const region::Region& region = *worker->region();
    for (const region::OwnedBody& body : region.owned()) {
      const region::KeptRecord* record = region.records().Find(body.def->id);
      if (record == nullptr || record->bytes->empty()) continue;
      const auto changed = PropertySet::Decode(*record->bytes, region.catalog().scene().properties);
      if (!changed.ok()) continue;
      const auto value = ValueOf(region.catalog().scene().properties, {}, *changed, "ticks");
      if (value) sum += std::get<std::int64_t>(*value);
    }
  }
  return sum;
}

TEST_F(DeploymentGameTest, AGameRunsInEveryRegionAndOutlivesTheDeathOfOne) {
  Deployment deployment(CountingSwarm(40), {.game = kCounting});
  ASSERT_TRUE(deployment.AwaitCalm()) << deployment.Standing();
  deployment.RunFor(Milliseconds(1000));
  for (SimulatedWorker* worker : deployment.Workers()) {
    ASSERT_NE(worker->core().run()->game(), nullptr);
    EXPECT_EQ(worker->core().run()->game()->statistics().calls > 0, !worker->region()->owned().empty());
    EXPECT_EQ(worker->core().run()->game()->statistics().errors, 0u);
  }
  const std::int64_t before = SumOf(deployment);
  EXPECT_GT(before, 40 * 30);
  deployment.Kill(RegionId(2));
  deployment.Settle();
  EXPECT_THAT(deployment.problems(), IsEmpty());
  EXPECT_EQ(deployment.bodies(), 40u);
  EXPECT_GT(SumOf(deployment), before) << "the counts of the dead region's balls went on in its standby";
  SimulatedWorker* const newcomer = deployment.Find(RegionId(2));
  ASSERT_NE(newcomer, nullptr);
  EXPECT_NE(newcomer->core().run()->game(), nullptr) << "a worker that joins runs the game too";
}

TEST_F(DeploymentGameTest, AGameThatDoesNotLoadInOneRegionFailsTheWorldWithTheReason) {
  Deployment deployment(CountingSwarm(10), {.game = kCounting, .damaged_games = {RegionId(3)}});
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] {
    return deployment.instance().state() == v1::INSTANCE_STATE_FAILED;
  })) << deployment.Standing();
  EXPECT_THAT(deployment.instance().reason(), HasSubstr("region 3 on host"));
  EXPECT_THAT(deployment.instance().reason(), HasSubstr("game game: has hash "));
  EXPECT_EQ(deployment.totals().steps, 0u) << "no region runs a world that others do not";
  EXPECT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] { return deployment.Workers().empty(); }));
}

// As from a worker whose Lua host is another than the control plane's.
TEST_F(DeploymentGameTest, AGameThatWorkersCannotLoadFailsTheWorldWithFileAndLine) {
  Deployment deployment(CountingSwarm(10), {.game = "local n = 1\nkinds.ball = = 2\n"});
  ASSERT_TRUE(deployment.RunUntil(Milliseconds(20'000), [&] {
    return deployment.instance().state() == v1::INSTANCE_STATE_FAILED;
  })) << deployment.Standing();
  EXPECT_THAT(deployment.instance().reason(), HasSubstr("game.lua:2: "));
  EXPECT_EQ(deployment.totals().steps, 0u);
}

}  // namespace
}  // namespace tessera::simulation

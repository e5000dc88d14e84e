// A link between two regions that stays cut while the control plane hears both: the product's control plane, agents
// and workers in virtual time. One of the two goes elsewhere, whatever was on its way over the link, and the world is
// whole again though the link is not.
#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "core/world/partition_change.h"
#include "tests/simulation/deployed_world.h"

namespace tessera::simulation {
namespace {

using ::testing::HasSubstr;

constexpr Micros kUntilMoved = Milliseconds(10'000);  // kCutAfter and the default of --move-cut-after
constexpr Micros kTransportGivesUp = Milliseconds(7000);

class CutLinkTest : public QuietTest {};

struct CutWorld : DeployedWorld {
  explicit CutWorld(const DeploymentOptions& options) : DeployedWorld(options, MomentOf(options.seed)) { Remember(); }
  CutWorld(const SceneBuilder& scene, std::size_t count, const DeploymentOptions& options)
      : DeployedWorld(scene, count, options, MomentOf(options.seed)) {
    Remember();
  }
  void Remember() {
    for (const SimulatedWorker* worker : deployment.Workers()) first.insert(worker->node());
  }
  void Cut(std::uint32_t one, std::uint32_t other, bool cut = true) {
    deployment.network().Cut(deployment.Find(RegionId(one))->node(), deployment.Find(RegionId(other))->node(), cut);
    cut_at = deployment.timeline().now();
  }
  // Two regions on different hosts.
  std::pair<std::uint32_t, std::uint32_t> Apart() {
    for (std::uint32_t other = 2; other <= deployment.regions(); ++other) {
      if (PlaceOf(1) != PlaceOf(other)) return {1, other};
    }
    ADD_FAILURE() << "all on one host";
    return {1, 2};
  }
  Micros SinceCut() const { return deployment.timeline().now() - cut_at; }
  std::uint32_t PlaceOf(std::uint32_t region) { return deployment.Find(RegionId(region))->place(); }
  // Workers that ran when the link was cut, and run still.
  std::size_t Remaining() {
    const std::vector<SimulatedWorker*> workers = deployment.Workers();
    return static_cast<std::size_t>(std::ranges::count_if(
        workers, [this](const SimulatedWorker* worker) { return first.contains(worker->node()); }));
  }
  std::size_t EventsWith(const std::string& text) {
    const v1::Instance instance = deployment.instance();
    return static_cast<std::size_t>(
        std::count_if(instance.events().begin(), instance.events().end(),
                      [&](const v1::InstanceEvent& event) { return event.text().find(text) != std::string::npos; }));
  }
  bool IsDegraded() { return deployment.instance().state() == v1::INSTANCE_STATE_DEGRADED; }
  // All regions step at the full rate, and each has links to all of its neighbours.
  void ExpectStepsInOnePiece() {
    std::vector<std::pair<SimulatedWorker*, Tick>> before;
    for (SimulatedWorker* worker : deployment.Workers()) before.emplace_back(worker, worker->region()->tick());
    deployment.RunFor(Milliseconds(1000));
    for (const auto& [worker, tick] : before) {
      EXPECT_GE(worker->region()->tick() - tick, 55);
      for (const RegionId neighbor : worker->region()->map().Neighbors(worker->identity().region)) {
        EXPECT_TRUE(worker->region()->IsLinkUp(neighbor)) << worker->identity().region << " to " << neighbor;
      }
    }
  }

  std::set<Node> first;
  Micros cut_at = 0;
};

// Each is the other's only standby, so while the link is cut nobody has a copy of either.
TEST_F(CutLinkTest, OfTwoRegionsOneGoesToAThirdHostAndNothingIsLostOrDoubled) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    CutWorld run({.seed = seed, .hosts = 3, .regions = 2});
    run.Cut(1, 2);
    run.deployment.RunFor(Milliseconds(7000));
    EXPECT_TRUE(run.IsDegraded());
    EXPECT_THAT(run.deployment.instance().reason(), HasSubstr("regions 1 and 2 have no link"));
    run.deployment.RunFor(kUntilMoved - Milliseconds(8000));
    EXPECT_EQ(run.Remaining(), 2U) << "it may pass";
    EXPECT_EQ(run.deployment.instance().map().version(), 1U);
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(15'000), [&] { return run.deployment.Calm(); }))
        << run.deployment.Standing();
    EXPECT_EQ(run.Remaining(), 1U);
    EXPECT_EQ(run.EventsWith("moving region "), 1U);
    EXPECT_EQ(run.EventsWith(" to be carried on by "), 1U) << "balls fly over the border all the time";
    EXPECT_EQ(run.deployment.host(3).workers().size(), 1U);
    run.ExpectStepsInOnePiece();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

// As ENet, which gives a peer up after five to ten seconds: workers notice the silence themselves.
TEST_F(CutLinkTest, ALinkThatTheTransportGivesUpLateIsNamedAndRoutedAroundAsSoon) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SCOPED_TRACE(seed);
    CutWorld run({.seed = seed, .hosts = 3, .regions = 2});
    run.deployment.network().set_break_after(kTransportGivesUp);
    run.Cut(1, 2);
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(10'000), [&] { return run.IsDegraded(); }));
    const Micros named = run.SinceCut();
    EXPECT_GE(named, Milliseconds(5500));
    EXPECT_LE(named, Milliseconds(7000));
    EXPECT_THAT(run.deployment.instance().reason(), HasSubstr("regions 1 and 2 have no link"));
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(18'400) - named, [&] {
      return run.Remaining() == 1 && run.deployment.Calm();
    })) << run.deployment.Standing();
    EXPECT_EQ(run.EventsWith("moving region "), 1U);
    run.ExpectStepsInOnePiece();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

// The transport keeps the connection, and brings what it could not bring meanwhile.
TEST_F(CutLinkTest, ASilenceThatEndsBeforeTheTransportNoticesIsNoFault) {
  CutWorld run({.hosts = 3, .regions = 4});
  run.deployment.network().set_break_after(kTransportGivesUp);
  const auto [one, other] = run.Apart();
  for (int i = 0; i < 3; ++i) {
    run.Cut(one, other);
    run.deployment.RunFor(Milliseconds(4000));
    run.Cut(one, other, false);
    EXPECT_FALSE(run.deployment.RunUntil(Milliseconds(2000), [&] { return run.IsDegraded(); }));
  }
  EXPECT_EQ(run.Remaining(), 4U);
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectStepsInOnePiece();
  run.ExpectWhole();
}

// The planned move alone is enough then.
TEST_F(CutLinkTest, WhereNoBodyWaitsForTheLinkTheWorldDoesNotStopForIt) {
  SceneBuilder scene(kDeployedHalf_m);
  for (int i = 0; i < 8; ++i) {
    scene.Add(Ball(0.4), {i % 2 == 0 ? -12.0 : 12.0, 0, -14.0 + 4 * i}, {0, 0, 0.2F}).may_sleep = false;
  }
  CutWorld run(scene, 8, {.hosts = 3, .regions = 2});
  run.Cut(1, 2);
  EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(25'000), [&] {
    return run.Remaining() == 1 && run.deployment.Calm();
  })) << run.deployment.Standing();
  EXPECT_EQ(run.EventsWith("moving region "), 1U);
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectStepsInOnePiece();
  run.ExpectWhole();
}

TEST_F(CutLinkTest, OfFourRegionsOneOfTheTwoGoesAndNothingIsLostOrDoubled) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    CutWorld run({.seed = seed, .hosts = 3, .regions = 4});
    const auto [one, other] = run.Apart();
    run.Cut(one, other);
    run.deployment.RunFor(kUntilMoved - Milliseconds(1000));
    EXPECT_EQ(run.Remaining(), 4U);
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(20'000), [&] { return run.deployment.Calm(); }))
        << run.deployment.Standing();
    EXPECT_EQ(run.Remaining(), 3U);
    EXPECT_EQ(run.EventsWith("moving region "), 1U);
    run.ExpectStepsInOnePiece();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
}

// A region that has just joined is cut from the one whose cells it took, while that hands its bodies over.
TEST_F(CutLinkTest, AChangeThatIsCutInItsMiddleComesToAnEndAndNothingIsLostOrDoubled) {
  int carried_on = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    CutWorld run({.seed = seed, .hosts = 3, .regions = 4});
    ASSERT_TRUE(run.deployment.Scale(5));
    const auto transition = [&] {
      const SimulatedWorker* first_worker = run.deployment.Find(RegionId(1));
      return InTransition(first_worker->region()->map());
    };
    ASSERT_TRUE(run.deployment.RunUntil(Milliseconds(5000), transition));
    const PartitionMap map = run.deployment.Find(RegionId(1))->region()->map();
    const auto taken = std::ranges::find_if(map.cells(), [](const Cell& cell) { return cell.from != RegionId(); });
    ASSERT_NE(taken, map.cells().end());
    run.Cut(taken->owner.value(), taken->from.value());
    EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(60'000), [&] { return run.deployment.Calm(); }))
        << run.deployment.Standing();
    carried_on += run.EventsWith(" to be carried on by ") > 0 ? 1 : 0;
    run.ExpectStepsInOnePiece();
    run.ExpectWhole();
    if (HasFailure()) FAIL() << run.deployment.Standing();
  }
  EXPECT_GT(carried_on, 0);
}

TEST_F(CutLinkTest, ACutThatHealsEarlierMovesNobody) {
  CutWorld run({.hosts = 3, .regions = 4});
  const auto [one, other] = run.Apart();
  run.Cut(one, other);
  run.deployment.RunFor(kUntilMoved - Milliseconds(1000));
  EXPECT_TRUE(run.IsDegraded());
  run.Cut(one, other, false);
  run.deployment.RunFor(Milliseconds(20'000));
  EXPECT_FALSE(run.IsDegraded()) << run.deployment.instance().reason();
  EXPECT_EQ(run.Remaining(), 4U);
  EXPECT_EQ(run.EventsWith("moving region "), 0U);
  EXPECT_EQ(run.deployment.totals().takeovers, 0U);
  run.ExpectStepsInOnePiece();
  run.ExpectWhole();
}

TEST_F(CutLinkTest, OfTwoCutsAtOneHostTheRegionOfThatHostGoes) {
  CutWorld run({.hosts = 3, .regions = 3});
  std::vector<std::uint32_t> alone, together;  // by whether another one is on the same host
  for (std::uint32_t region = 1; region <= 3; ++region) {
    (run.deployment.host(run.PlaceOf(region)).workers().size() == 1 ? alone : together).push_back(region);
  }
  ASSERT_EQ(together.size(), 2U);
  const std::uint32_t lonely = alone.front(), one = together[0], other = together[1];
  const Node stays = run.deployment.Find(RegionId(one))->node(), too = run.deployment.Find(RegionId(other))->node();
  run.Cut(lonely, one);
  run.Cut(lonely, other);
  run.deployment.RunFor(kUntilMoved - Milliseconds(1000));
  EXPECT_EQ(run.Remaining(), 3U);
  EXPECT_TRUE(run.deployment.RunUntil(Milliseconds(20'000), [&] { return run.deployment.Calm(); }))
      << run.deployment.Standing();
  EXPECT_EQ(run.Remaining(), 2U);
  EXPECT_TRUE(run.deployment.network().Joined(stays));
  EXPECT_TRUE(run.deployment.network().Joined(too));
  EXPECT_EQ(run.EventsWith("moving region "), 1U);
  run.ExpectStepsInOnePiece();
  run.ExpectWhole();
}

TEST_F(CutLinkTest, WithoutRoomItStaysDegradedSaysWhatToDoAndIsWellOnceTheLinkIs) {
  CutWorld run({.hosts = 2, .regions = 2, .capacity = 1});
  run.Cut(1, 2);
  run.deployment.RunFor(Milliseconds(30'000));
  EXPECT_TRUE(run.IsDegraded());
  EXPECT_EQ(run.Remaining(), 2U);
  EXPECT_EQ(run.deployment.instance().map().version(), 1U);
  EXPECT_EQ(run.EventsWith("no other host has room for either: add a host, or let UDP through between "), 1U);
  run.Cut(1, 2, false);
  EXPECT_TRUE(run.deployment.AwaitCalm()) << run.deployment.Standing();
  run.deployment.RunFor(Milliseconds(1000));
  EXPECT_FALSE(run.IsDegraded()) << run.deployment.instance().reason();
  run.ExpectStepsInOnePiece();
  run.ExpectWhole();
}

}  // namespace
}  // namespace tessera::simulation

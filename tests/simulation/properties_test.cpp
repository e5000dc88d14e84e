// Properties that change while bodies change hands and owners die: what was ordered comes about, once, and every client
// sees it.
#include <gmock/gmock.h>

#include "client_sdk/world_view.h"
#include "core/region/testing/kept_bodies.h"
#include "region_worker/body_feed.h"
#include "region_worker/core/property_orders.h"
#include "tests/simulation/instance.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

constexpr double kHalf = 20;  // half the ground's side, m
constexpr std::uint64_t kSnapshotTicks = 2;
const std::vector<PropertyDef> kDefs = {{"health", std::int64_t{100}}, {"team", std::string("none")}};

// A client with a connection to each region; datagrams and acknowledgements get lost.
class PropertyViewer {
 public:
  PropertyViewer(const Scene& scene, std::uint64_t seed, double loss)
      : scene_(scene), settings_(replication::SnapshotSettingsFor(scene)), chance_(seed), loss_(loss) {}

  void Take(RegionId from, const replication::SnapshotHistory& history) {
    const auto [at, fresh] = links_.try_emplace(from, scene_.bounds, settings_);
    if (fresh) view_.RegionBegins(Now(), from);
    GameLink& link = at->second;
    for (const Bytes& datagram : link.sender.Write(history, 0, 0).datagrams) {
      if (chance_.Between(0, 1) < loss_) continue;
      const auto told = link.receiver.Read(datagram);
      ASSERT_TRUE(told.ok()) << told.status();
      view_.Take(Now(), from, *told, events_);
    }
    if (const Bytes ack = link.receiver.WriteAck(); !ack.empty() && chance_.Between(0, 1) >= loss_) {
      ASSERT_TRUE(link.sender.Acknowledge(ack).ok());
    }
  }
  void Gone(RegionId region) {
    links_.erase(region);
    view_.RegionGone(Now(), region);
  }
  PropertyValue ValueOf(BodyId body, const char* name) const {
    PropertySet changed;
    const auto& seen = view_.bodies().at(body);
    if (seen.properties != nullptr) changed = *PropertySet::Decode(*seen.properties, kDefs);
    return *tessera::ValueOf(kDefs, {}, changed, name);
  }
  int Changes(BodyId body) const {
    return static_cast<int>(std::ranges::count_if(events_, [&](const client::ClientEvent& event) {
      return event.kind == client::ClientEvent::Kind::kPropertyChanged && event.body == body;
    }));
  }

 private:
  struct GameLink {
    GameLink(const Aabb& bounds, const replication::SnapshotSettings& settings)
        : sender(settings), receiver(bounds, settings) {}
    replication::SnapshotSender sender;
    replication::SnapshotReceiver receiver;
  };
  // Nothing expires.
  static client::TimePoint Now() { return client::TimePoint(std::chrono::hours(1)); }

  const Scene& scene_;
  replication::SnapshotSettings settings_;
  Chance chance_;
  double loss_;
  client::WorldView view_{60, kSnapshotTicks, {kDefs.begin(), kDefs.end()}};
  std::map<RegionId, GameLink> links_;
  std::vector<client::ClientEvent> events_;
};

// An instance whose regions obey orders, and two clients.
class Changing {
 public:
  Changing(const SceneBuilder& builder, std::uint64_t seed) : instance(builder, 4, SimulationOptions{.seed = seed}) {
    viewers.emplace_back(*instance.scene, seed + 1, 0.2);
    viewers.emplace_back(*instance.scene, seed + 2, 0.2);
    simulation().on_step = [this, before = simulation().on_step](SimulatedRegion& worker,
                                                                 const region::StepResult& result) {
      before(worker, result);
      Stepped(worker, result);
    };
    simulation().on_killed = [this, before = simulation().on_killed](RegionId region) {
      before(region);
      shells_.erase(region);
      for (PropertyViewer& viewer : viewers) viewer.Gone(region);
    };
    for (const auto& [id, worker] : simulation().workers()) {
      worker->before_step = [this, id = id, worker = worker.get()] { shells_[id].orders.Apply(worker->region()); };
    }
  }
  Simulation& simulation() { return *instance.simulation; }
  // To all regions, until one answers.
  void Order(BodyId body, const char* name, PropertyValue value) {
    orders.push_back({++numbers_, body, name, std::move(value)});
    for (auto& [id, shell] : shells_) shell.orders.Set(orders);
  }
  template <class Condition>
  void RunUntil(Condition condition) {
    for (int i = 0; i < 50'000 && !condition(); ++i) simulation().RunFor(100);
    ASSERT_TRUE(condition());
  }
  PropertyValue ValueAtOwner(BodyId body, const char* name) {
    const RegionId owner = simulation().OwnerOf(body);
    for (const region::KeptRecord& entry : simulation().worker(owner.value()).region().records().all()) {
      if (entry.body == body) return *ValueOf(kDefs, {}, *PropertySet::Decode(*entry.bytes, kDefs), name);
    }
    return *ValueOf(kDefs, {}, {}, name);
  }

  Instance instance;
  std::vector<PropertyViewer> viewers;
  std::vector<worker::PropertyOrder> orders;  // without an answer
  std::vector<worker::PropertyAnswer> refusals;

 private:
  struct SimulatedShell {
    worker::PropertyOrders orders;
    worker::BodyFeed feed;
    std::unique_ptr<replication::SnapshotHistory> history;
  };
  void Stepped(SimulatedRegion& worker, const region::StepResult& result) {
    SimulatedShell& shell = shells_[worker.id()];
    if (shell.history == nullptr) {
      const auto settings = replication::SnapshotSettingsFor(*instance.scene);
      shell.history = std::make_unique<replication::SnapshotHistory>(instance.scene->bounds, settings);
    }
    shell.feed.Note(result.tick, result.departures);
    if (result.tick.value() % kSnapshotTicks == 0) {
      shell.feed.Push(worker.region(), *shell.history);
      for (PropertyViewer& viewer : viewers) viewer.Take(worker.id(), *shell.history);
    }
    for (const worker::PropertyAnswer& answer : shell.orders.Answers(worker.region(), true)) {
      std::erase_if(orders, [&](const worker::PropertyOrder& order) { return order.number == answer.number; });
      if (!answer.refused.empty()) refusals.push_back(answer);
    }
    for (auto& [id, other] : shells_) other.orders.Set(orders);
  }

  std::map<RegionId, SimulatedShell> shells_;
  std::uint64_t numbers_ = 0;
};

SceneBuilder WithProperties(SceneBuilder builder) {
  builder.scene().properties = kDefs;
  return builder;
}

// A ball flies from region 1 into 2, which dies; 3 is its standby.
TEST(PropertiesTest, AChangeOutlivesAHandoverAndADeath) {
  SceneBuilder builder(kHalf);
  const BodyId ball = builder.Add(Ball(0.5), {-4, 1, -10}, {6, 0, 0}).id;
  Changing world(WithProperties(builder), 1);
  world.RunUntil([&] { return world.simulation().tick() >= Tick(10); });
  world.Order(ball, "health", std::int64_t{80});
  world.RunUntil([&] { return world.orders.empty(); });
  EXPECT_EQ(world.ValueAtOwner(ball, "health"), PropertyValue(std::int64_t{80}));

  // While it is being handed over nobody can make the change; then the new owner does.
  world.RunUntil(
      [&] { return region::KeptBodies(world.simulation().worker(1).region()) == std::vector<BodyId>{ball}; });
  world.Order(ball, "health", std::int64_t{50});
  world.RunUntil([&] { return world.orders.empty(); });
  EXPECT_EQ(world.simulation().OwnerOf(ball), RegionId(2));

  // Made by an owner that dies before its standby has heard of it: made again by the standby.
  world.instance.control->HoldLog(RegionId(2), true);
  world.Order(ball, "team", std::string("red"));
  world.RunUntil([&] { return world.ValueAtOwner(ball, "team") == PropertyValue(std::string("red")); });
  EXPECT_EQ(world.orders.size(), 1U);
  world.simulation().Kill(RegionId(2));
  world.RunUntil([&] { return world.simulation().OwnerOf(ball) == RegionId(3) && world.orders.empty(); });
  world.simulation().RunFor(Milliseconds(500));

  EXPECT_EQ(world.ValueAtOwner(ball, "health"), PropertyValue(std::int64_t{50}));
  EXPECT_EQ(world.ValueAtOwner(ball, "team"), PropertyValue(std::string("red")));
  for (const PropertyViewer& viewer : world.viewers) {
    EXPECT_EQ(viewer.ValueOf(ball, "health"), PropertyValue(std::int64_t{50}));
    EXPECT_EQ(viewer.ValueOf(ball, "team"), PropertyValue(std::string("red")));
    EXPECT_GE(viewer.Changes(ball), 1);
    EXPECT_LE(viewer.Changes(ball), 5) << "each change once; what the dead owner alone knew, twice and once back";
  }
  EXPECT_THAT(world.refusals, IsEmpty());
  EXPECT_THAT(world.simulation().problems(), IsEmpty());
}

TEST(PropertiesTest, AChangeThatCannotBeMadeIsRefusedForGood) {
  SceneBuilder builder(kHalf);
  const BodyId ball = builder.Add(Ball(0.5), {-4, 1, -10}).id;
  Changing world(WithProperties(builder), 1);
  world.Order(ball, "mana", std::int64_t{1});
  world.RunUntil([&] { return world.orders.empty() || world.simulation().tick() > Tick(30); });
  // The giver of orders knows the scene; a worker that gets a senseless order leaves it undone.
  ASSERT_EQ(world.refusals.size(), 1U);
  EXPECT_EQ(world.refusals[0].refused, "no property \"mana\"");
}

// Many bodies that cross borders all the time, changed all the time, while two regions die: at the end each has what it
// was told last, at its owner and at each client.
TEST(PropertiesTest, NoChangeIsLostInASwarmWhoseRegionsDie) {
  constexpr int kBalls = 60;
  for (const std::uint64_t seed : {1, 2, 3}) {
    Changing world(WithProperties(Swarm(kHalf, kBalls)), seed);
    Chance chance(seed);
    std::map<BodyId, std::int64_t> wanted;
    const auto ids = world.simulation().States();
    for (int i = 0; i < 600; ++i) {
      auto body = ids.begin();
      std::advance(body, static_cast<std::ptrdiff_t>(chance.Between(0, kBalls - 1)));
      world.Order(body->first, "health", std::int64_t{i});
      wanted[body->first] = i;
      world.simulation().RunFor(Milliseconds(20));
      if (i == 240) world.simulation().Kill(RegionId(2));
      if (i == 440) world.simulation().Kill(RegionId(4));
    }
    world.RunUntil([&] { return world.orders.empty(); });
    world.simulation().RunFor(Milliseconds(500));
    EXPECT_THAT(world.simulation().problems(), IsEmpty());
    EXPECT_EQ(world.simulation().States().size(), std::size_t{kBalls});
    for (const auto& [body, health] : wanted) {
      EXPECT_EQ(world.ValueAtOwner(body, "health"), PropertyValue(health)) << body.value();
      for (const PropertyViewer& viewer : world.viewers) {
        EXPECT_EQ(viewer.ValueOf(body, "health"), PropertyValue(health)) << body.value();
      }
    }
    EXPECT_GT(world.simulation().totals().handovers, 50U);
  }
}

}  // namespace
}  // namespace tessera::simulation

// Clients of the real program: who enters, what they see, what they may do.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>
#include <set>

#include "absl/strings/str_cat.h"
#include "core/replication/input.h"
#include "core/world/viewer_number.h"
#include "net/testing/test_identity.h"
#include "region_worker/core/player_places.h"
#include "region_worker/input_files.h"
#include "region_worker/standalone.h"
#include "region_worker/testing/test_client.h"
#include "region_worker/testing/worker_cluster.h"
#include "region_worker/testing/worker_process.h"

namespace tessera::worker {
namespace {

// A tray of balls that roll over the border between two regions at x = 0, and a player in each half.
constexpr char kTray[] = R"(
  name: "tray"
  bounds { min { x: -10 y: -2 z: -10 } max { x: 10 y: 10 z: 10 } }
  bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
  scatters {
    first_id: 100 count: 40
    area { min { x: -8 y: 0.5 z: -8 } max { x: 8 y: 2 z: 8 } }
    spacing: 2 jitter: 0.3 seed: 3
    templates { mass: 1 linear_velocity { x: 1 } shape { sphere { radius: 0.4 } } }
  }
  player {
    body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
    spawn_points { x: -5 y: 3 z: 0 }
    spawn_points { x: 5 y: 3 z: 0 }
    max_force: 2000
    max_speed: 6
  }
)";
constexpr std::size_t kBalls = 40;

class Cluster : public WorkerCluster {
 public:
  explicit Cluster(std::uint32_t regions, const std::vector<std::string>& more = {}, const std::string& scene = kTray)
      : WorkerCluster(regions, scene, more) {}
};

// A game shows them without the operators' port, so they are the metrics of the same moment.
TEST(WorkerClientTest, ClientsGetTheFiguresThatMetricsShow) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  ASSERT_TRUE(client->Until([&] { return client->figures && client->figures->step.count > 60; }));
  const std::uint16_t port = cluster.metrics_port(1);
  std::string page;
  const auto shown = [&](const std::string& series) { return MetricIn(page, series); };
  const auto mean = [&](const std::string& family) { return shown(family + "_sum") / shown(family + "_count"); };
  const auto mean_of = [](const replication::WorkFigures& work) {
    return static_cast<double>(work.total_ns) * 1e-9 / static_cast<double>(work.count);
  };
  // Until a message and a page that were taken at nearly the same tick agree; the next message is a second later.
  const auto agree = [&] {
    const replication::RegionFigures& figures = *client->figures;
    page = ReadMetrics(port);
    const auto near = [](double a, double b) { return std::abs(a - b) <= 0.05 * b; };
    return near(static_cast<double>(figures.tick.value()), shown("tessera_region_tick")) &&
           near(static_cast<double>(figures.step.count), shown("tessera_region_step_seconds_count")) &&
           near(mean_of(figures.step), mean("tessera_region_step_seconds")) &&
           near(mean_of(figures.physics), mean("tessera_region_physics_seconds")) &&
           near(mean_of(figures.prediction), mean("tessera_region_prediction_seconds")) &&
           near(mean_of(figures.snapshot_full), mean("tessera_region_snapshot_full_seconds")) &&
           near(mean_of(figures.snapshot_delta), mean("tessera_region_snapshot_delta_seconds")) &&
           near(static_cast<double>(figures.memory.process_physical_bytes), shown("process_resident_memory_bytes"));
  };
  EXPECT_TRUE(client->Until(agree));
  EXPECT_EQ(client->figures->owned, kBalls + 1);
  EXPECT_EQ(client->figures->clients, 1u);
  EXPECT_EQ(static_cast<double>(client->figures->memory.host_physical_total_bytes),
            Metric(port, "tessera_host_physical_memory_total_bytes"));
}

TEST(WorkerClientTest, TwoRegionsShowAllBodiesOnceTheWorldRuns) {
  Cluster cluster(2, {"--players", "1"});
  const auto one = cluster.Join(1, 1);
  const auto two = cluster.Join(2, 1);
  EXPECT_EQ(one->welcome->region(), 1u);
  EXPECT_EQ(two->welcome->region(), 2u);
  EXPECT_EQ(one->welcome->tick_rate_hz(), 60u);
  EXPECT_EQ(one->welcome->snapshot_rate_hz(), 30u);
  EXPECT_EQ(one->welcome->map().cells_size(), 2);
  std::set<BodyId> seen;
  EXPECT_TRUE(Until({one.get(), two.get()}, [&] {
    for (const TestClient* client : {one.get(), two.get()}) {
      for (const auto& [body, state] : client->bodies) seen.insert(body);
    }
    return seen.size() >= kBalls + 1;
  }));
  EXPECT_EQ(seen.size(), kBalls + 1);
  for (const BodyId body : seen) {
    EXPECT_TRUE(body == PlayerBodyId(PlayerNumber(1)) || (body.value() >= 100 && body.value() < 100 + kBalls)) << body;
  }
  // Balls roll over the border: in the end each region has sent bodies that the other had.
  EXPECT_TRUE(Until({one.get(), two.get()}, [&] {
    return Metric(cluster.metrics_port(1), "tessera_region_handovers_total{direction=\"out\"}") > 0;
  }));
}

// A street of posts along x, 10 m apart, over both regions; who plays starts in region 1, 7 m from the border at x = 0.
// Seen is what is in cells of 5 m within 20 m.
std::string Street() {
  std::string street = R"(
    name: "street"
    bounds { min { x: -100 y: -2 z: -100 } max { x: 100 y: 10 z: 100 } }
    bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
    view { radius: 20 }
    player {
      body { name: "player" mass: 80 shape { sphere { radius: 0.5 } } never_sleeps: true }
      spawn_points { x: -7 y: 0.5 z: 2.5 }
      max_force: 2000
      max_speed: 6
    }
  )";
  for (int post = 0; post < 20; ++post) {
    street += absl::StrCat("bodies { id: ", 100 + post, " mass: 1 shape { box { half_extents { x: .5 y: .5 z: .5 } } }",
                           " pose { position { x: ", -97.5 + 10 * post, " y: 0.5 z: -2.5 } } }\n");
  }
  return street;
}

// Posts that a client sees, by where they stand.
std::set<double> PostsOf(const TestClient& client) {
  std::set<double> posts;
  for (const auto& [body, state] : client.bodies) {
    if (!IsPlayerBody(body)) posts.insert(std::round(state.position.x * 2) / 2);
  }
  return posts;
}

TEST(WorkerClientTest, RegionsThatDoNotHaveTheBodyShowWhatIsAroundItWhateverAClientSays) {
  Cluster cluster(2, {"--players", "1"}, Street());
  const auto one = cluster.Join(1, 1);
  const auto two = cluster.Join(2, 1);
  const BodyId own = PlayerBodyId(PlayerNumber(1));
  const auto until = [&](const std::function<bool()>& done) { return Until({one.get(), two.get()}, done); };
  const std::set<double> near = {2.5, 12.5};
  ASSERT_TRUE(until([&] {
    return one->bodies.contains(own) && PostsOf(*one).contains(-17.5) && PostsOf(*two) == near;
  })) << testing::PrintToString(PostsOf(*one))
      << testing::PrintToString(PostsOf(*two));

  // Lies: as an input of its body here, and as what only regions may say.
  PlayerPlaces lies(60);
  lies.Report(PlayerNumber(1), Epoch(1000), Tick(100), {80, 1, 0}, 0);
  const std::vector<std::uint8_t> said = lies.Write(Tick(100));
  two->SendDatagram(said);
  two->SendInput({.number = 1, .body = own, .target = Tick(), .force_n = {2000, 0, 0}, .torque_nm = {}});
  const Tick then = two->tick;
  ASSERT_TRUE(until([&] { return PostsOf(*two) != near || two->tick > then + 180; }));
  EXPECT_EQ(PostsOf(*two), near);

  // The body walks into region 2, and what both show goes with it.
  std::uint32_t number = 1;
  Tick last;
  const auto walk = [&] {
    if (std::exchange(last, std::max(one->tick, two->tick)) == last) return;
    const PlayerInput east{.number = ++number, .body = own, .target = Tick(), .force_n = {2000, 0, 0}, .torque_nm = {}};
    one->SendInput(east);
    two->SendInput(east);
  };
  EXPECT_TRUE(until([&] {
    walk();
    return two->bodies.contains(own) && PostsOf(*two).contains(32.5) && !PostsOf(*one).contains(-17.5);
  })) << testing::PrintToString(PostsOf(*one))
      << testing::PrintToString(PostsOf(*two));
  EXPECT_FALSE(PostsOf(*two).contains(92.5));
}

TEST(WorkerClientTest, AViewerSeesTheWholeStreetAndTakesNoPart) {
  Cluster cluster(2, {"--players", "1"}, Street());
  const auto viewer = cluster.Join(1, kFirstViewer + 7), beyond = cluster.Join(2, kFirstViewer + 7);
  EXPECT_FALSE(viewer->started) << "it is not the player that the world waits for";
  const auto player = cluster.Join(1, 1), player_beyond = cluster.Join(2, 1);
  ASSERT_TRUE(Until({viewer.get(), beyond.get(), player.get(), player_beyond.get()},
                    [&] { return PostsOf(*viewer).size() == 10 && PostsOf(*beyond).size() == 10; }));
  const BodyId own = PlayerBodyId(PlayerNumber(1));
  ASSERT_TRUE(Until({viewer.get(), beyond.get(), player.get(), player_beyond.get()},
                    [&] { return viewer->bodies.contains(own) && viewer->started; }));
  EXPECT_FALSE(viewer->bodies.contains(PlayerBodyId(PlayerNumber(kFirstViewer + 7))));
  const double applied = Metric(cluster.metrics_port(1), "tessera_region_inputs_total{result=\"applied\"}");
  const Tick then = viewer->tick;
  std::uint32_t number = 0;
  ASSERT_TRUE(Until({viewer.get(), beyond.get(), player.get(), player_beyond.get()}, [&] {
    viewer->SendInput({.number = ++number, .body = own, .target = Tick(), .force_n = {1000, 0, 0}, .torque_nm = {}});
    return viewer->tick > then + 30;
  }));
  EXPECT_FALSE(viewer->input_refused.has_value()) << "nobody reads it";
  EXPECT_EQ(Metric(cluster.metrics_port(1), "tessera_region_inputs_total{result=\"applied\"}"), applied);
}

TEST(WorkerClientTest, ARegionServesFewViewers) {
  Cluster cluster(1);
  std::vector<std::unique_ptr<TestClient>> viewers;
  for (std::uint32_t i = 0; i < kMaxViewers; ++i) viewers.push_back(cluster.Join(1, kFirstTrustedViewer + i));
  TestClient late(cluster.scene().bounds);
  EXPECT_TRUE(late.Connect(cluster.game_port(1), RegionId(1), CredentialsFor(kFirstTrustedViewer + 1000)));
  ASSERT_TRUE(late.Until([&] { return late.refusal.has_value(); }));
  EXPECT_EQ(late.refusal->reason(), v1::REFUSAL_REASON_FULL);
  const auto again = cluster.Join(1, kFirstTrustedViewer);  // takes its own place
  EXPECT_TRUE(again->welcome.has_value());
  const auto player = cluster.Join(1, 1);
  EXPECT_TRUE(player->welcome.has_value()) << "players have places of their own";
}

TEST(WorkerClientTest, StrangersViewersLeaveHalfOfThePlacesToGateways) {
  Cluster cluster(1);
  std::vector<std::unique_ptr<TestClient>> viewers;
  for (std::uint32_t i = 0; i < kMaxStrangersViewers; ++i) viewers.push_back(cluster.Join(1, kFirstViewer + i));
  TestClient late(cluster.scene().bounds);
  EXPECT_TRUE(late.Connect(cluster.game_port(1), RegionId(1), CredentialsFor(kFirstTrustedViewer - 1)));
  ASSERT_TRUE(late.Until([&] { return late.refusal.has_value(); }));
  EXPECT_EQ(late.refusal->reason(), v1::REFUSAL_REASON_FULL);
  const auto again = cluster.Join(1, kFirstViewer);  // takes its own place
  EXPECT_TRUE(again->welcome.has_value());
  const auto gateway = cluster.Join(1, kFirstTrustedViewer);
  EXPECT_TRUE(gateway->welcome.has_value());
}

TEST(WorkerClientTest, DeltasFollowWhatIsAcknowledged) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  ASSERT_TRUE(client->Until([&] { return client->bodies.size() == kBalls + 1; }));
  const std::uint32_t full_before = client->full_records, records_before = client->records;
  ASSERT_TRUE(client->Until([&] { return client->records > records_before + 300; }));
  EXPECT_LT(client->full_records - full_before, 100u);  // most have a baseline by now
  EXPECT_GT(Metric(cluster.metrics_port(1), "tessera_region_snapshot_delta_seconds_count"), 0);
  EXPECT_GT(Metric(cluster.metrics_port(1), "tessera_region_snapshot_full_seconds_count"), 0);
  EXPECT_GT(Metric(cluster.metrics_port(1), "tessera_region_snapshot_bytes_total"), 0);
}

TEST(WorkerClientTest, WaitsForItsPlayers) {
  Cluster cluster(1, {"--players", "2"});
  const auto first = cluster.Join(1, 1);
  EXPECT_FALSE(first->welcome->started());
  EXPECT_EQ(first->welcome->tick(), 0u);
  const auto second = cluster.Join(1, 2);
  EXPECT_TRUE(Until({first.get(), second.get()}, [&] {
    return first->started && second->started && first->tick > Tick(10) && second->tick > Tick(10);
  }));
  EXPECT_TRUE(Until({first.get(), second.get()}, [&] {
    return first->bodies.contains(PlayerBodyId(PlayerNumber(1))) &&
           first->bodies.contains(PlayerBodyId(PlayerNumber(2)));
  }));
}

TEST(WorkerClientTest, InputMovesTheOwnBody) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  const BodyId own = PlayerBodyId(PlayerNumber(1));
  ASSERT_TRUE(client->Until([&] { return client->bodies.contains(own); }));
  std::uint32_t number = 0;
  Tick then;
  EXPECT_TRUE(client->Until([&] {
    if (std::exchange(then, client->tick) < client->tick) {  // one a snapshot: faster, and they would queue up
      client->SendInput({.number = ++number, .body = own, .target = Tick(), .force_n = {0, 0, 2000}, .torque_nm = {}});
    }
    return client->bodies.at(own).linear_velocity.z > 1;
  }));
  EXPECT_GT(client->last_input, 0u);
  EXPECT_FALSE(client->input_refused.has_value());
  EXPECT_GT(Metric(cluster.metrics_port(1), "tessera_region_inputs_total{result=\"applied\"}"), 0);
}

TEST(WorkerClientTest, InputForAnotherBodyIsRefusedNamingIt) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  ASSERT_TRUE(client->Until([&] { return client->bodies.contains(BodyId(100)); }));
  std::uint32_t number = 0;
  ASSERT_TRUE(client->Until([&] {
    client->SendInput(
        {.number = ++number, .body = BodyId(100), .target = Tick(), .force_n = {0, 100, 0}, .torque_nm = {}});
    return client->input_refused.has_value();
  }));
  EXPECT_EQ(client->input_refused->body(), 100u);
  EXPECT_GE(client->input_refused->input_number(), 1u);
  EXPECT_NE(client->input_refused->detail().find("100"), std::string::npos) << client->input_refused->detail();
  EXPECT_GT(Metric(cluster.metrics_port(1), "tessera_region_inputs_total{result=\"refused\"}"), 0);
}

TEST(WorkerClientTest, InputThatIsNotFiniteOrNotAnInputHarmsNothing) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  const BodyId own = PlayerBodyId(PlayerNumber(1));
  ASSERT_TRUE(client->Until([&] { return client->bodies.contains(own); }));
  auto bytes = replication::EncodeInput(
      {.ack = {}, .inputs = {{.number = 1, .body = own, .target = Tick(), .force_n = {1, 2, 3}, .torque_nm = {}}}});
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(bytes.data() + bytes.size() - 12, &nan, sizeof nan);  // the force stands last: there is no torque
  ASSERT_TRUE(client->Until([&] {
    client->SendDatagram(bytes);
    return client->input_refused.has_value();
  }));
  EXPECT_NE(client->input_refused->detail().find("finite"), std::string::npos) << client->input_refused->detail();
  client->SendDatagram({});
  client->SendDatagram(std::vector<std::uint8_t>{2});
  client->SendDatagram(std::vector<std::uint8_t>(1000, 0xff));
  const Tick then = client->tick;
  EXPECT_TRUE(client->Until([&] { return client->tick > then + 30; }));
  EXPECT_EQ(Metric(cluster.metrics_port(1), "tessera_region_nonfinite_bodies_total"), 0);
}

// The acceptor gives the reason of a refusal, and no connection.
class WorkerRefusalTest : public testing::Test {
 protected:
  v1::RegionRefusal RefusalOf(const net::Credentials& credentials, RegionId region = RegionId(1)) {
    TestClient client(cluster_.scene().bounds);
    EXPECT_FALSE(client.Connect(cluster_.game_port(1), region, credentials));
    EXPECT_TRUE(client.refusal.has_value());
    EXPECT_FALSE(client.welcome.has_value());
    return client.refusal.value_or(v1::RegionRefusal());
  }
  Cluster cluster_{1};
};

TEST_F(WorkerRefusalTest, CredentialOfAnotherKey) {
  const v1::RegionRefusal refusal =
      RefusalOf(net::IssuePlayer(kStandaloneInstanceId, PlayerNumber(1), net::Generation(1), net::SigningKey::Make()));
  EXPECT_EQ(refusal.reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
  EXPECT_FALSE(refusal.detail().empty());
}

TEST_F(WorkerRefusalTest, DamagedCredential) {
  net::Credentials credentials = CredentialsFor(1);
  credentials.statement.back() ^= 1;
  EXPECT_EQ(RefusalOf(credentials).reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
  EXPECT_EQ(RefusalOf({}).reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
}

TEST_F(WorkerRefusalTest, CredentialThatWasOverheardButNotItsKey) {
  net::Credentials credentials = CredentialsFor(1);
  credentials.key = CredentialsFor(1).key;  // goes with another credential of the same player
  EXPECT_EQ(RefusalOf(credentials).reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
}

TEST_F(WorkerRefusalTest, CredentialOfAnotherInstanceNamesBoth) {
  const v1::RegionRefusal refusal =
      RefusalOf(net::IssuePlayer("inst-7", PlayerNumber(1), net::Generation(1), StandaloneKey()));
  EXPECT_EQ(refusal.reason(), v1::REFUSAL_REASON_WRONG_INSTANCE);
  EXPECT_NE(refusal.detail().find("inst-7"), std::string::npos) << refusal.detail();
  EXPECT_NE(refusal.detail().find(kStandaloneInstanceId), std::string::npos) << refusal.detail();
}

TEST_F(WorkerRefusalTest, CertificateOfARegion) {
  const net::EndpointIdentity region =
      net::TestWorker(StandaloneKey(), kStandaloneInstanceId, RegionId(2), Incarnation(2));
  EXPECT_EQ(RefusalOf(net::CredentialsOf(region)).reason(), v1::REFUSAL_REASON_BAD_CREDENTIAL);
}

TEST_F(WorkerRefusalTest, AnotherRegionNamesBoth) {
  const v1::RegionRefusal refusal = RefusalOf(CredentialsFor(1), RegionId(7));
  EXPECT_EQ(refusal.reason(), v1::REFUSAL_REASON_WRONG_REGION);
  EXPECT_EQ(refusal.detail(), "this is region 1, not 7");
}

TEST(WorkerClientTest, PlayerThatComesAgainTakesItsPlace) {
  Cluster cluster(1);
  const auto first = cluster.Join(1, 1);
  const auto again = cluster.Join(1, 1);
  EXPECT_TRUE(Until({first.get(), again.get()}, [&] { return first->disconnected && again->tick > Tick(0); }));
  EXPECT_FALSE(again->disconnected);
  EXPECT_EQ(Metric(cluster.metrics_port(1), "tessera_region_clients"), 1);
}

// Each is told once, and the older one does not get in again, in whatever order they come.
TEST(WorkerClientTest, OfTwoProcessesOfOnePlayerTheNewerOneStays) {
  Cluster cluster(1);
  const auto dial = [&](std::uint64_t generation) {
    auto client = std::make_unique<TestClient>(cluster.scene().bounds);
    EXPECT_TRUE(client->Connect(cluster.game_port(1), RegionId(1), CredentialsFor(1, generation)));
    return client;
  };
  const auto older = dial(1);
  ASSERT_TRUE(older->Until([&] { return older->welcome.has_value(); }));
  const auto newer = dial(2);
  ASSERT_TRUE(Until({older.get(), newer.get()}, [&] { return older->disconnected && newer->tick > Tick(0); }));
  ASSERT_TRUE(older->refusal.has_value());
  EXPECT_EQ(older->refusal->reason(), v1::REFUSAL_REASON_REPLACED);
  EXPECT_EQ(older->refusal->detail(), "player 1 was joined by another process");
  const auto again = dial(1);
  ASSERT_TRUE(Until({again.get(), newer.get()}, [&] { return again->disconnected; }));
  ASSERT_TRUE(again->refusal.has_value());
  EXPECT_EQ(again->refusal->reason(), v1::REFUSAL_REASON_REPLACED);
  EXPECT_FALSE(again->welcome.has_value());
  const Tick then = newer->tick;
  EXPECT_TRUE(newer->Until([&] { return newer->tick > then + 30; }));
  EXPECT_FALSE(newer->disconnected);
  EXPECT_FALSE(newer->refusal.has_value());
}

TEST(WorkerClientTest, SigtermTellsClientsThatTheRegionEnds) {
  Cluster cluster(1);
  const auto client = cluster.Join(1, 1);
  ASSERT_TRUE(client->Until([&] { return client->tick > Tick(0); }));
  cluster.worker(1).Signal(SIGTERM);
  EXPECT_TRUE(client->Until([&] { return client->stopping.has_value() && client->disconnected; }));
  EXPECT_FALSE(client->stopping->goes_on()) << "nobody is known to run it elsewhere";
  EXPECT_EQ(cluster.worker(1).Wait(), 0);
}

}  // namespace
}  // namespace tessera::worker

// A client whose program stood for a while, or polls late: it is up to date at once, and no poll takes long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/client_fixture.h"
#include "core/region/region_players.h"
#include "core/world/math.h"

namespace tessera::client {
namespace {

using replication::BodyRecord;
using replication::DepartureRecord;

using ClientLateTest = ClientFixture;

// A program that stood for a second: what came meanwhile is passed over but for the newest, and what it said of bodies
// that have left and of properties comes all the same.
TEST_F(ClientLateTest, AClientThatStoodForASecondIsAtTheNewestStateAtOnce) {
  Make(1);
  Join();
  Play();
  FakeRegion& region = *instance->regions[0];
  std::vector<BodyRecord> bodies;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    bodies.push_back({BodyId(i), Epoch(1), Moving(-40 + 0.5 * static_cast<double>(i), 1)});
  }
  const auto step = [&] {
    for (BodyRecord& body : bodies) body.state.position.x += 1.0 / 30;
  };
  std::int64_t usual = 0;
  for (int i = 0; i < 20; ++i) {
    step();
    Advance([&](Tick at) { region.Snapshot(at, bodies); });
    usual = std::max(usual, client->Stats().work_units);
  }
  const std::uint64_t read = client->Stats().regions[0].datagrams;
  const std::vector<DepartureRecord> leaves = {{BodyId(100), Epoch(1), RegionId()}};
  for (int i = 0; i < 30; ++i) {
    step();
    tick = tick + 2;
    if (i == 10) bodies.pop_back();
    region.Snapshot(tick, bodies, i == 10 ? leaves : std::vector<DepartureRecord>());
    instance->Service();
  }
  now += std::chrono::seconds(1);
  int polls = 0;
  std::int64_t dearest = 0;
  const TimePoint limit = Clock::now() + std::chrono::seconds(30);
  for (; client->tick() != tick && Clock::now() < limit; ++polls) {
    PollOnce();
    dearest = std::max(dearest, client->Stats().work_units);
    now += std::chrono::milliseconds(1);
  }
  EXPECT_EQ(client->tick(), tick);
  EXPECT_LE(polls, 10);
  EXPECT_LE(dearest, 4 * usual);
  const ClientStats stats = client->Stats();
  EXPECT_GE(stats.datagrams_passed_over, 20u);
  EXPECT_LE(stats.regions[0].datagrams - read, 12u) << "of thirty snapshots no more than two a poll are read";
  EXPECT_EQ(stats.datagrams_lost, 0u);
  EXPECT_EQ(stats.decode_errors, 0u);
  for (int i = 0; i < 3; ++i) {
    step();
    Advance([&](Tick at) { region.Snapshot(at, bodies); });
  }
  EXPECT_FALSE(client->World().contains(BodyId(100)));
  EXPECT_NEAR(client->World().at(BodyId(7)).state.position.x, bodies[6].state.position.x, 0.01);
}

// More had come than one poll receives, and the next poll came in time.
TEST_F(ClientLateTest, APollAfterALateOneReadsNoMoreThanThat) {
  Make(1);
  Join();
  Play();
  FakeRegion& region = *instance->regions[0];
  std::vector<BodyRecord> bodies;
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    bodies.push_back({BodyId(i), Epoch(1), Moving(-40 + 0.05 * static_cast<double>(i), 1)});
  }
  const auto snapshot = [&](Tick at) {
    for (BodyRecord& body : bodies) body.state.position.x += 1.0 / 30;
    region.Snapshot(at, bodies);
  };
  std::int64_t usual = 0;
  for (int i = 0; i < 20; ++i) {
    Advance(snapshot);
    usual = std::max(usual, client->Stats().work_units);
  }
  for (int i = 0; i < 80; ++i) {
    tick = tick + 2;
    snapshot(tick);
    instance->Service();
  }
  now += std::chrono::seconds(1);
  std::int64_t dearest = 0;
  int polls = 0;
  const TimePoint limit = Clock::now() + std::chrono::seconds(30);
  for (; client->tick() != tick && Clock::now() < limit; ++polls) {
    PollOnce();
    dearest = std::max(dearest, client->Stats().work_units);
    now += std::chrono::milliseconds(1);
  }
  EXPECT_EQ(client->tick(), tick);
  EXPECT_GE(polls, 2) << "one poll took all of it";
  EXPECT_LE(dearest, 5 * usual / 2);
}

// A thousand bodies, of which a snapshot holds a third, in datagrams ascending by id: the own body is in each snapshot,
// and in the last datagram of it. The region is the test's own, and moves that body by its inputs, one a tick.
struct ClientCrowdTest : ClientFixture, testing::WithParamInterface<int> {  // ticks between polls
  static constexpr double kTick_s = 1.0 / kTickRate;
  // Within which a shown place is to follow the region's, as a share of a second of the body's way.
  static constexpr double kFollows_s = 0.2;

  FakeRegion& Region() { return *instance->regions[0]; }
  BodyState& Own() { return bodies.back().state; }

  void Begin() {
    Make(1, "gravity { } view { bytes_per_second: 100000 } ");
    JoinOptions options = Options();
    options.predict = true;
    auto joined = Client::Join(options);
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
    Play();
    for (std::uint64_t i = 1; i <= 1000; ++i) {
      bodies.push_back({BodyId(i), Epoch(1), Moving(-45 + 0.05 * static_cast<double>(i), 1)});
    }
    bodies.push_back({client->own_body(), Epoch(1), Moving(0, 0)});
    Region().view = {.centre = Own().position, .own = client->own_body()};
    Region().applied = 0;
  }
  void Step(bool drops_last) {
    tick = tick + 1;
    now += kTick;
    BodyState& own = Own();
    if (acted < Region().inputs.size()) {
      const PlayerInput& input = Region().inputs[acted++];
      const Vec3d force(region::LimitedForce(*instance->scene->player, input.force_n, own.linear_velocity));
      own.linear_velocity = Vec3f(Vec3d(own.linear_velocity) + force * kTick_s);
      Region().applied = input.number;
    }
    for (BodyRecord& body : bodies) body.state.position += Vec3d(body.state.linear_velocity) * kTick_s;
    if (tick.value() % 2 != 0) return;
    Region().drops_last = drops_last;
    Region().Snapshot(tick, bodies);
  }
  // Polls every so many ticks for ten seconds, and steers along x, then along z. `loses`: the last datagram of the
  // newest snapshot is lost before each poll, as where a socket's buffer is full.
  void Steer(int ticks_a_poll, bool loses) {
    for (int at = 1; at <= 10 * static_cast<int>(kTickRate); ++at) {
      const int until_poll = (ticks_a_poll - at % ticks_a_poll) % ticks_a_poll;
      Step(loses && until_poll < 2);
      if (until_poll > 0) continue;
      const bool turned = at > 5 * static_cast<int>(kTickRate);
      client->Move(turned ? Vec3f{0, 0, 10} : Vec3f{10, 0, 0}, {});
      PollOnce();
      const std::vector<ShownBody> shown = client->Interpolated(now);
      instance->Service();
      if (at < 2 * static_cast<int>(kTickRate)) continue;
      ++frames;
      const auto own = std::ranges::find(shown, client->own_body(), &ShownBody::id);
      ASSERT_NE(own, shown.end());
      predicted += own->predicted ? 1 : 0;
      off_m = std::max(off_m, Length(own->pose.position - Own().position));
    }
  }
  void ExpectFollowed() {
    EXPECT_GT(Own().position.x, 5) << "it has been moved";
    EXPECT_GT(Own().position.z, 5);
    EXPECT_EQ(predicted, frames);
    EXPECT_LT(off_m, kFollows_s * instance->scene->player->max_speed_m_s);
    EXPECT_TRUE(client->Stats().predicting);
    EXPECT_EQ(client->Stats().decode_errors, 0u);
  }

  std::vector<BodyRecord> bodies;
  std::size_t acted = 0;
  int frames = 0, predicted = 0;
  double off_m = 0;
};

TEST_P(ClientCrowdTest, TheOwnBodyIsPredictedAndShownWhereItsInputsHaveMovedIt) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  ASSERT_NO_FATAL_FAILURE(Steer(GetParam(), false));
  ExpectFollowed();
}

// Polls every 33, 133, 200, 250 and 300 ms.
INSTANTIATE_TEST_SUITE_P(Ticks, ClientCrowdTest, testing::Values(2, 8, 12, 15, 18));

using ClientLateCrowdTest = ClientCrowdTest;

TEST_P(ClientLateCrowdTest, TheOwnBodyIsPredictedWhereTheEndOfTheNewestSnapshotIsNotThere) {
  ASSERT_NO_FATAL_FAILURE(Begin());
  ASSERT_NO_FATAL_FAILURE(Steer(GetParam(), true));
  ExpectFollowed();
}

INSTANTIATE_TEST_SUITE_P(Ticks, ClientLateCrowdTest, testing::Values(8, 12, 15, 18));

}  // namespace
}  // namespace tessera::client

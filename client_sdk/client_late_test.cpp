// A client whose program stood for a while, or polls late: it is up to date at once, and no poll takes long.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/client_fixture.h"

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

}  // namespace
}  // namespace tessera::client

// Sender and receiver over a network that loses, doubles and reorders, from seeds.
#include "core/replication/snapshot.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "core/replication/testing/moving_bodies.h"
#include "core/replication/testing/snapshot_link.h"

namespace tessera::replication {
namespace {

TEST(SnapshotTest, OnAPerfectNetworkEachSnapshotIsSeenWhole) {
  MovingBodies world({.count = 60});
  SnapshotLink link(world.bounds(), {});
  for (int n = 0; n < 100; ++n) {
    world.Step(1.0 / 30);
    const WrittenSnapshot written = link.Snapshot(world.bodies());
    EXPECT_EQ(written.bodies, 60u);
    EXPECT_EQ(written.full, n == 0) << n;
    ExpectSeesAll(link, link.tick());
  }
}

TEST(SnapshotTest, RestCostsNothingOnceAcknowledged) {
  MovingBodies world({.count = 200});
  for (BodyRecord& body : world.bodies()) {
    body.state.asleep = true;
    body.state.linear_velocity = body.state.angular_velocity = {};
  }
  SnapshotLink link(world.bounds(), {});
  EXPECT_TRUE(link.Snapshot(world.bodies()).full);
  int datagrams = 0;
  for (int n = 0; n < 240; ++n) {
    const WrittenSnapshot written = link.Snapshot(world.bodies());
    EXPECT_EQ(written.bodies, 0u);
    ASSERT_LE(written.datagrams.size(), 1u);
    if (written.datagrams.empty()) continue;
    ++datagrams;  // a datagram with the tick alone, now and then
    EXPECT_LE(written.datagrams[0].size(), 16u);
  }
  EXPECT_NEAR(datagrams, 240 * 2 / static_cast<int>(SnapshotSettings().idle_ticks), 1);
  // Long after its state left the history, a body that wakes is sent as a change of the state that the client has.
  world.bodies()[17].state.asleep = false;
  world.bodies()[17].state.position.x += 0.01;
  const WrittenSnapshot written = link.Snapshot(world.bodies());
  EXPECT_EQ(written.bodies, 1u);
  EXPECT_FALSE(written.full);
  ExpectSeesAll(link, link.tick());
}

TEST(SnapshotTest, WhatChangesEndsTheSilenceAtOnce) {
  MovingBodies world({.count = 3});
  for (BodyRecord& body : world.bodies()) body.state.asleep = true;
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  std::uint64_t tick = 0;
  const auto write = [&](std::uint32_t last_input, std::int32_t margin, std::span<const DepartureRecord> gone = {}) {
    history.Push(Tick(++tick), world.bodies(), gone);
    const WrittenSnapshot written = sender.Write(history, last_input, margin);
    for (const Bytes& datagram : written.datagrams) EXPECT_TRUE(receiver.Read(datagram).ok());
    EXPECT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
    return written.datagrams.size();
  };
  EXPECT_EQ(write(0, 0), 1u);
  EXPECT_EQ(write(0, 0), 0u);
  EXPECT_EQ(write(1, 0), 1u);  // an input was applied
  EXPECT_EQ(write(1, 0), 0u);
  EXPECT_EQ(write(1, -2), 1u);  // or came late
  EXPECT_EQ(write(1, -2), 0u);
  world.bodies()[1].state.position.x += 1;
  EXPECT_EQ(write(1, -2), 1u);
  EXPECT_EQ(write(1, -2), 0u);
  const DepartureRecord gone{world.bodies()[2].id, Epoch(1), RegionId()};
  world.bodies().pop_back();
  EXPECT_EQ(write(1, -2, {&gone, 1}), 1u);
  EXPECT_EQ(write(1, -2), 0u);
}

TEST(SnapshotTest, ABodyThatComesToRestIsRepeatedUntilAcknowledged) {
  MovingBodies world({.count = 1, .kicks_per_s = 0});
  SnapshotLink link(world.bounds(), {});
  link.Snapshot(world.bodies());
  link.Snapshot(world.bodies());
  world.bodies()[0].state.asleep = true;
  link.SetNetwork({.loss = 1});
  // At once, once more, and then whenever it had time to answer.
  EXPECT_EQ(link.Snapshot(world.bodies()).bodies, 1u);
  EXPECT_EQ(link.Snapshot(world.bodies()).bodies, 1u);
  std::uint32_t sent = 0;
  for (int n = 0; n < 60; ++n) sent += link.Snapshot(world.bodies()).bodies;
  EXPECT_GE(sent, 5u);
  EXPECT_LE(sent, 30u);
  link.SetNetwork({});
  for (int n = 0; n < 12; ++n) link.Snapshot(world.bodies());
  ExpectSeesAll(link, link.tick());
  for (int n = 0; n < 60; ++n) EXPECT_EQ(link.Snapshot(world.bodies()).bodies, 0u);
}

TEST(SnapshotTest, WithoutAcknowledgementsEverySnapshotIsFull) {
  MovingBodies world({.count = 20});
  SnapshotLink link(world.bounds(), {.loss = 1});
  for (int n = 0; n < 200; ++n) {
    world.Step(1.0 / 30);
    const WrittenSnapshot written = link.Snapshot(world.bodies());
    EXPECT_TRUE(written.full);
    EXPECT_EQ(written.bodies, 20u);
  }
}

TEST(SnapshotTest, AfterALongSilenceDeltasComeBack) {
  MovingBodies world({.count = 20});
  SnapshotLink link(world.bounds(), {});
  const auto run = [&](int snapshots) {
    WrittenSnapshot last;
    for (int n = 0; n < snapshots; ++n) {
      world.Step(1.0 / 30);
      last = link.Snapshot(world.bodies());
    }
    return last;
  };
  EXPECT_FALSE(run(10).full);
  link.SetNetwork({.loss = 1});
  EXPECT_TRUE(run(70).full);  // the acknowledged baseline has left the history
  link.SetNetwork({});
  EXPECT_FALSE(run(10).full);
  ExpectSeesAll(link, link.tick());
  EXPECT_EQ(link.refused(), 0u);
}

TEST(SnapshotTest, DatagramsKeepWithinTheirSize) {
  for (const std::size_t limit : {std::size_t{120}, std::size_t{300}, std::size_t{1148}}) {
    SnapshotSettings settings;
    settings.max_datagram_bytes = limit;
    MovingBodies world({.count = 300});
    SnapshotLink link(world.bounds(), {.loss = 0.2}, settings);
    for (int n = 0; n < 60; ++n) {
      world.Step(1.0 / 30);
      for (const Bytes& bytes : link.Snapshot(world.bodies()).datagrams) EXPECT_LE(bytes.size(), limit);
    }
  }
}

// Bodies leave and come back under a higher epoch, over a bad network; the client hears of each departure exactly once
// and ends with what is there.
TEST(SnapshotTest, DeparturesAreHeardOnceAndReturnsAreSeen) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    MovingBodies world({.count = 60, .seed = seed});
    SnapshotLink link(world.bounds(), {.loss = 0.3, .duplicate = 0.2, .max_delay = 4, .seed = seed});
    std::vector<BodyRecord> away;
    std::set<std::pair<BodyId, Epoch>> left;
    for (int n = 0; n < 400; ++n) {
      world.Step(1.0 / 30);
      std::vector<BodyRecord>& here = world.bodies();
      std::vector<DepartureRecord> departures;
      for (auto at = here.begin(); at != here.end();) {
        if (n > 20 && n < 350 && world.Chance(0.01)) {
          departures.push_back({at->id, at->epoch, RegionId(2)});
          left.insert({at->id, at->epoch});
          away.push_back(*at);
          at = here.erase(at);
        } else {
          ++at;
        }
      }
      for (auto at = away.begin(); at != away.end();) {
        if (world.Chance(0.1)) {
          at->epoch = Epoch(at->epoch.value() + 2);
          here.insert(std::lower_bound(here.begin(), here.end(), at->id,
                                       [](const BodyRecord& body, BodyId id) { return body.id < id; }),
                      *at);
          at = away.erase(at);
        } else {
          ++at;
        }
      }
      link.Snapshot(here, departures);
      ASSERT_FALSE(testing::Test::HasFatalFailure()) << "seed " << seed;
    }
    link.SetNetwork({});
    for (int n = 0; n < 10; ++n) link.Snapshot(world.bodies());
    ExpectSeesAll(link, link.tick());
    for (const auto& departure : left) EXPECT_LE(link.departures().count(departure), 1u);
    for (const auto& departure : link.departures()) EXPECT_TRUE(left.contains(departure));
    for (const BodyRecord& body : away) EXPECT_EQ(link.departures().count({body.id, body.epoch}), 1u);
  }
}

TEST(SnapshotTest, ADepartureTellsWhereTo) {
  const Aabb bounds{{-10, -10, -10}, {10, 10, 10}};
  SnapshotHistory history(bounds, {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(bounds, {});
  const std::vector<BodyRecord> both = {{BodyId(1), Epoch(4), {}}, {BodyId(2), Epoch(1), {}}};
  history.Push(Tick(1), both, {});
  ASSERT_TRUE(receiver.Read(sender.Write(history, 0, 0).datagrams.at(0)).ok());
  const std::vector<DepartureRecord> departures = {{BodyId(1), Epoch(4), RegionId(3)},
                                                   {BodyId(2), Epoch(1), RegionId()}};
  history.Push(Tick(2), {}, departures);
  const auto got = receiver.Read(sender.Write(history, 0, 0).datagrams.at(0));
  ASSERT_TRUE(got.ok());
  ASSERT_EQ(got->departures.size(), 2u);
  EXPECT_EQ(got->departures[0].to, RegionId(3));
  EXPECT_EQ(got->departures[0].epoch, Epoch(4));
  EXPECT_EQ(got->departures[1].to, RegionId());
}

// One client, and what it sees of bodies that are shown to some only.
class AudienceTest : public ::testing::Test {
 protected:
  // Bodies and departures that the client is told of by a snapshot of these bodies, which are all that there are.
  void Push(const std::vector<BodyRecord>& bodies) {
    history_.Push(Tick(++tick_), bodies, {});
    for (const Bytes& datagram : sender_.Write(history_, view_, 0, 0).datagrams) {
      const auto got = receiver_.Read(datagram);
      ASSERT_TRUE(got.ok()) << got.status();
      for (const BodyRecord& body : got->bodies) {
        seen_.insert(body.id);
        if (body.properties != nullptr) properties_[body.id] = *body.properties;
      }
      for (const DepartureRecord& departure : got->departures) {
        seen_.erase(departure.id);
        EXPECT_EQ(departure.why, DepartureRecord::Why::kOutOfInterest);
      }
    }
    ASSERT_TRUE(sender_.Acknowledge(receiver_.WriteAck()).ok());
  }
  static BodyRecord Body(std::uint64_t id, Visibility visible_to, TeamId team) {
    BodyRecord body{BodyId(id), Epoch(1), {}};
    body.visible_to = visible_to;
    body.team = team;
    body.properties = std::make_shared<const Bytes>(Bytes{1});
    body.team_properties = std::make_shared<const Bytes>(Bytes{2});
    return body;
  }

  const Aabb bounds_{{-10, -10, -10}, {10, 10, 10}};
  SnapshotHistory history_{bounds_, {}};
  SnapshotSender sender_{{}};
  SnapshotReceiver receiver_{bounds_, {}};
  ClientView view_{.centre = {}, .own = BodyId(9), .team = 5};
  std::uint64_t tick_ = 0;
  std::set<BodyId> seen_;
  std::map<BodyId, Bytes> properties_;
};

TEST_F(AudienceTest, ABodyIsSentToThoseAloneWhoMaySeeIt) {
  Push({Body(1, Visibility::kEveryone, 6), Body(2, Visibility::kTeam, 5), Body(3, Visibility::kTeam, 6),
        Body(4, Visibility::kTeam, 0), Body(5, Visibility::kServers, 5), Body(9, Visibility::kServers, 0)});
  EXPECT_EQ(seen_, (std::set<BodyId>{BodyId(1), BodyId(2), BodyId(9)})) << "its own player sees it always";
  EXPECT_EQ(properties_[BodyId(1)], Bytes{1});
  EXPECT_EQ(properties_[BodyId(2)], Bytes{2}) << "what a team tells its own";
  EXPECT_EQ(properties_[BodyId(9)], Bytes{2});
}

TEST_F(AudienceTest, ABodyThatIsHiddenGoesAndComesBackUnderTheSameEpoch) {
  Push({Body(1, Visibility::kEveryone, 6)});
  Push({Body(1, Visibility::kServers, 6)});
  EXPECT_EQ(seen_, std::set<BodyId>());
  Push({Body(1, Visibility::kTeam, 6)});
  EXPECT_EQ(seen_, std::set<BodyId>());
  Push({Body(1, Visibility::kTeam, 5)});
  EXPECT_EQ(seen_, std::set<BodyId>{BodyId(1)});
}

TEST_F(AudienceTest, WhoChangesTheTeamSeesWhatTheOtherOneDoes) {
  const std::vector<BodyRecord> bodies = {Body(1, Visibility::kEveryone, 6), Body(2, Visibility::kTeam, 5),
                                          Body(3, Visibility::kTeam, 6)};
  for (int i = 0; i < 3; ++i) Push(bodies);
  EXPECT_EQ(seen_, (std::set<BodyId>{BodyId(1), BodyId(2)}));
  EXPECT_EQ(properties_[BodyId(1)], Bytes{1});
  view_.team = 6;
  for (int i = 0; i < 3; ++i) Push(bodies);
  EXPECT_EQ(seen_, (std::set<BodyId>{BodyId(1), BodyId(3)}));
  EXPECT_EQ(properties_[BodyId(1)], Bytes{2}) << "though it has not changed";
  view_.team = 0;
  for (int i = 0; i < 3; ++i) Push(bodies);
  EXPECT_EQ(seen_, std::set<BodyId>{BodyId(1)});
  EXPECT_EQ(properties_[BodyId(1)], Bytes{1});
}

TEST(SnapshotTest, ALateStateOfADepartedBodyDoesNotBringItBack) {
  const Aabb bounds{{-10, -10, -10}, {10, 10, 10}};
  SnapshotHistory history(bounds, {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(bounds, {});
  const std::vector<BodyRecord> one = {{BodyId(1), Epoch(4), {}}};
  history.Push(Tick(1), one, {});
  const Bytes late = sender.Write(history, 0, 0).datagrams.at(0);
  history.Push(Tick(2), {}, std::vector<DepartureRecord>{{BodyId(1), Epoch(4), RegionId(3)}});
  EXPECT_EQ(receiver.Read(sender.Write(history, 0, 0).datagrams.at(0))->departures.size(), 1u);
  const auto got = receiver.Read(late);
  ASSERT_TRUE(got.ok());
  EXPECT_TRUE(got->bodies.empty());
}

// Properties come with a body's first record and whenever they change, over any loss, and cost nothing in between.
TEST(SnapshotTest, PropertiesAreToldUntilAcknowledged) {
  for (const double loss : {0.0, 0.4}) {
    MovingBodies world({.count = 40, .kicks_per_s = 0.2, .rest_speed_m_s = 0.8});
    SnapshotHistory history(world.bounds(), {});
    SnapshotSender sender({});
    SnapshotReceiver receiver(world.bounds(), {});
    std::mt19937 random(5);
    std::map<BodyId, Bytes> seen, truth;
    std::size_t received = 0;
    for (std::uint64_t n = 1; n <= 400; ++n) {
      world.Step(1.0 / 30);
      if (n % 10 == 0 && n < 300) {
        BodyRecord& body = world.bodies()[random() % world.bodies().size()];
        Bytes bytes(1 + random() % 40);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        truth[body.id] = bytes;
        body.properties = std::make_shared<const Bytes>(bytes);
      }
      history.Push(Tick(2 * n), world.bodies(), {});
      for (const Bytes& datagram : sender.Write(history, 0, 0).datagrams) {
        if (n < 350 && std::uniform_real_distribution<double>(0, 1)(random) < loss) continue;
        const auto got = receiver.Read(datagram);
        ASSERT_TRUE(got.ok()) << got.status();
        for (const BodyRecord& body : got->bodies) {
          if (body.properties == nullptr) continue;
          seen[body.id] = *body.properties;
          ++received;
        }
      }
      ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
    }
    EXPECT_EQ(seen, truth);
    EXPECT_GE(received, truth.size());
    if (loss == 0) {
      EXPECT_LE(received, 30u);
    }
  }
}

// A body that a game puts elsewhere, or changes, is written anew until it is acknowledged, and known by its count.
TEST(SnapshotTest, TraitsAreToldUntilAcknowledged) {
  MovingBodies world({.count = 3});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  std::uint64_t tick = 0;
  std::map<BodyId, BodyTraits> seen;
  const auto write = [&](bool lost) {
    world.Step(1.0 / 60);
    history.Push(Tick(++tick), world.bodies(), {});
    const WrittenSnapshot written = sender.Write(history, 0, 0);
    if (lost) return;
    for (const Bytes& datagram : written.datagrams) {
      const auto got = receiver.Read(datagram);
      ASSERT_TRUE(got.ok()) << got.status();
      for (const BodyRecord& body : got->bodies) seen[body.id] = body.traits;
    }
    ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
  };
  for (int i = 0; i < 6; ++i) write(false);
  const BodyId moved = world.bodies()[1].id;
  EXPECT_TRUE(seen.at(moved).empty());
  BodyTraits traits{.jumps = 7, .tuning = {.gravity_scale = 0.0f, .friction = {}, .restitution = 0.5f}};
  traits.tuning.claim = SpawnClaim{PlayerNumber(9), 4'000'000'000};
  world.bodies()[1].traits = traits;
  world.bodies()[1].state.position.x += 20;
  write(true);
  write(true);
  EXPECT_TRUE(seen.at(moved).empty());
  for (int i = 0; i < 6; ++i) {
    write(false);
    EXPECT_EQ(seen.at(moved), traits) << "after snapshot " << i;
    EXPECT_TRUE(seen.at(world.bodies()[0].id).empty());
  }
  traits.jumps = 8;
  world.bodies()[1].traits = traits;
  write(false);
  EXPECT_EQ(seen.at(moved).jumps, 8);
}

TEST(SnapshotTest, ADuplicateIsNamed) {
  MovingBodies world({.count = 3});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  EXPECT_TRUE(receiver.WriteAck().empty());
  history.Push(Tick(1), world.bodies(), {});
  const Bytes datagram = sender.Write(history, 0, 0).datagrams.at(0);
  EXPECT_TRUE(receiver.Read(datagram).ok());
  EXPECT_EQ(receiver.Read(datagram).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST(SnapshotTest, OtherBoundsAreRefused) {
  MovingBodies world({.count = 3});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds().Expanded(1), {});
  history.Push(Tick(1), world.bodies(), {});
  EXPECT_EQ(receiver.Read(sender.Write(history, 0, 0).datagrams.at(0)).status().message(),
            "snapshot: other settings or world bounds");
}

TEST(SnapshotTest, AcknowledgementsOfWhatWasNeverSentAreRefused) {
  SnapshotSender sender({});
  EXPECT_TRUE(sender.Acknowledge({}).ok());
  EXPECT_EQ(sender.Acknowledge(Bytes(12, 1)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(sender.Acknowledge(Bytes(11, 0)).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(sender.Acknowledge(Bytes(12, 0)).code(), absl::StatusCode::kInvalidArgument);
  std::mt19937 random(1);
  for (int i = 0; i < 10'000; ++i) {
    Bytes noise(random() % 14);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random());
    EXPECT_EQ(sender.Acknowledge(noise).ok(), noise.empty());
  }
}

// Noise, flipped bits and cut tails between good datagrams: nothing aborts, and what is refused leaves no trace, so
// that the good ones go on to give true states.
TEST(SnapshotTest, MalformedDatagramsLeaveNoTrace) {
  std::mt19937 random(3);
  MovingBodies world({.count = 80, .rest_speed_m_s = 0.8});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  const Quantizer quantizer(world.bounds(), {});
  std::size_t refused = 0;
  for (std::uint64_t n = 1; n <= 400; ++n) {
    world.Step(1.0 / 30);
    history.Push(Tick(2 * n), world.bodies(), {});
    for (const Bytes& good : sender.Write(history, 0, 0).datagrams) {
      for (int i = 0; i < 50; ++i) {
        Bytes bad = good;
        if (i % 3 == 0) bad.resize(random() % good.size());
        if (i % 3 == 1) {
          for (std::size_t at = 7 + random() % 4; at < bad.size(); ++at) bad[at] = static_cast<std::uint8_t>(random());
        }
        if (i % 3 == 2) bad.push_back(static_cast<std::uint8_t>(random()));
        if (bad == good) continue;
        const Bytes ack = receiver.WriteAck();
        SnapshotReceiver& target = receiver;
        const auto got = target.Read(bad);
        if (got.ok()) {
          // Noise that parses is not wrong in itself: only a checksum can tell. It must not happen to what is cut or
          // longer.
          ADD_FAILURE() << "kind " << i % 3 << " of " << bad.size() << " bytes was accepted";
          return;
        }
        ++refused;
        EXPECT_EQ(receiver.WriteAck(), ack);
      }
      const auto got = receiver.Read(good);
      ASSERT_TRUE(got.ok()) << got.status();
      for (const BodyRecord& body : got->bodies) {
        const BodyRecord& truth = world.bodies()[body.id.value() - 1];
        ASSERT_EQ(body.state, quantizer.Dequantize(quantizer.Quantize(truth.state)));
      }
    }
    ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
  }
  EXPECT_GT(refused, 10'000u);
}

// Single flipped bits parse now and then; whatever they say stays in range and harms nothing.
TEST(SnapshotTest, FlippedBitsNeverHarm) {
  std::mt19937 random(4);
  MovingBodies world({.count = 40});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  for (std::uint64_t n = 1; n <= 2000; ++n) {
    world.Step(1.0 / 30);
    history.Push(Tick(2 * n), world.bodies(), {});
    for (Bytes bytes : sender.Write(history, 0, 0).datagrams) {
      const std::size_t bit = random() % (bytes.size() * 8);
      if (n % 2 == 0) bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1u << (bit % 8)));
      const auto got = receiver.Read(bytes);
      if (!got.ok()) continue;
      for (const BodyRecord& body : got->bodies) {
        EXPECT_TRUE(IsFinite(body.state.position) && IsFinite(body.state.orientation));
        EXPECT_TRUE(IsFinite(body.state.linear_velocity) && IsFinite(body.state.angular_velocity));
      }
    }
    (void)sender.Acknowledge(receiver.WriteAck());
  }
}

}  // namespace
}  // namespace tessera::replication

// Snapshots over a bad network: nothing is ever misread, and a late datagram is still understood.
#include <gtest/gtest.h>

#include "core/replication/testing/moving_bodies.h"
#include "core/replication/testing/snapshot_link.h"

namespace tessera::replication {
namespace {

TEST(SnapshotLossTest, LossDuplicatesAndReorderingNeverGiveAWrongState) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    MovingBodies world({.count = 150, .seed = seed, .rest_speed_m_s = 0.8});
    SnapshotLink link(world.bounds(), {.loss = 0.02 * seed, .duplicate = 0.1, .max_delay = 6, .seed = seed});
    for (int n = 0; n < 300; ++n) {
      world.Step(1.0 / 30);
      link.Snapshot(world.bodies());
      ASSERT_FALSE(testing::Test::HasFatalFailure()) << "seed " << seed;
    }
    link.SetNetwork({});
    for (int n = 0; n < 10; ++n) link.Snapshot(world.bodies());  // everything arrives
    ExpectSeesAll(link, link.tick());
  }
}

// Each datagram decodes alone: one that others have overtaken still finds its samples.
TEST(SnapshotLossTest, WhatWasOvertakenIsStillUnderstood) {
  MovingBodies world({.count = 60});
  SnapshotLink link(world.bounds(), {.max_delay = 4, .seed = 3});
  for (int n = 0; n < 300; ++n) {
    world.Step(1.0 / 30);
    link.Snapshot(world.bodies());
  }
  EXPECT_EQ(link.refused(), 0u);
}

// A body that has rested for long is predicted first by samples acknowledged long ago, then by samples acknowledged
// just now: the second datagram may come first.
TEST(SnapshotLossTest, WhatWakesMayBeOvertaken) {
  MovingBodies world({.count = 1, .kicks_per_s = 0});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  std::uint64_t tick = 0;
  const auto write = [&] {
    history.Push(Tick(tick += 2), world.bodies(), {});
    return sender.Write(history, 0, 0).datagrams;
  };
  BodyState& state = world.bodies()[0].state;
  const auto settle = [&] {
    for (int n = 0; n < 200; ++n) {
      for (const Bytes& datagram : write()) ASSERT_TRUE(receiver.Read(datagram).ok());
      ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
    }
  };
  state.asleep = true;
  settle();
  state.asleep = false;
  state.position.x += 1;
  const Bytes first = write().at(0);
  ASSERT_TRUE(receiver.Read(first).ok());
  state.position.x += 1;
  const Bytes late = write().at(0);
  ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
  state.position.x += 1;
  ASSERT_TRUE(receiver.Read(write().at(0)).ok());
  const auto got = receiver.Read(late);
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_NEAR(got->bodies.at(0).state.position.x, state.position.x - 1, 1e-3);
}

// Phases of motion and rest of any length, loss both ways, everything out of order: each datagram that arrives within
// the time that it may be overtaken by is understood.
TEST(SnapshotLossTest, EveryDatagramIsUnderstoodThroughQuietAndUnquietTimes) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(random);
    };
    MovingBodies world({.count = 40, .seed = seed, .kicks_per_s = uniform(0, 2), .rest_speed_m_s = 0.8});
    SnapshotLink link(world.bounds(), {.loss = uniform(0, 0.5),
                                       .duplicate = 0.05,
                                       .max_delay = static_cast<int>(uniform(0, 10)),
                                       .seed = seed,
                                       .ack_loss = uniform(0, 0.8)});
    for (int phase = 0; phase < 12; ++phase) {
      const bool quiet = phase % 2 == 1;
      for (BodyRecord& body : world.bodies()) {
        const bool stays = uniform(0, 1) < 0.3;
        body.state.asleep = quiet || stays;
        const Vec3d velocity = body.state.asleep ? Vec3d() : Vec3d(uniform(-5, 5), uniform(0, 6), uniform(-5, 5));
        body.state.linear_velocity = Vec3f(velocity);
        body.state.angular_velocity = Vec3f(velocity);
      }
      const int snapshots = static_cast<int>(uniform(1, uniform(0, 1) < 0.3 ? 150 : 20));
      for (int n = 0; n < snapshots; ++n) {
        if (!quiet) world.Step(1.0 / 30);
        link.Snapshot(world.bodies());
        ASSERT_FALSE(testing::Test::HasFatalFailure()) << "seed " << seed;
      }
    }
    EXPECT_EQ(link.refused(), 0u) << "seed " << seed;
  }
}

// A turn is predicted only for a body that turns, and for the velocities of one that has turned before.
TEST(SnapshotLossTest, BodiesThatTurnNowAndThenAreNeverMisread) {
  std::mt19937 random(7);
  MovingBodies world({.count = 30, .kicks_per_s = 0});
  SnapshotLink link(world.bounds(), {.loss = 0.1, .max_delay = 3, .seed = 7});
  const auto speed = [&] { return static_cast<float>(random() % 100) * 0.1f; };
  const auto step = [&] {
    for (BodyRecord& body : world.bodies()) {
      BodyState& state = body.state;
      state.asleep = false;
      if (random() % 2 == 0) state.orientation = Normalized(Quatd(0.05, 0, 0.1, 1) * state.orientation);
      if (random() % 2 == 0) state.position.x += 0.01;
      state.angular_velocity = {speed(), 0, -speed()};
    }
    link.Snapshot(world.bodies());
  };
  for (int n = 0; n < 300; ++n) {
    step();
    ASSERT_FALSE(testing::Test::HasFatalFailure()) << n;
  }
  link.SetNetwork({});
  for (int n = 0; n < 10; ++n) step();
  ExpectSeesAll(link, link.tick());
  EXPECT_EQ(link.refused(), 0u);
}

// Worlds that run for years, and clocks that jump: the sender's 32-bit stamps go on from another origin.
TEST(SnapshotLossTest, TicksMayGoOnForEver) {
  MovingBodies world({.count = 30, .kicks_per_s = 0.5, .rest_speed_m_s = 0.8});
  SnapshotHistory history(world.bounds(), {});
  SnapshotSender sender({});
  SnapshotReceiver receiver(world.bounds(), {});
  std::uint64_t tick = 0;
  std::map<BodyId, BodyState> seen;
  const Quantizer quantizer(world.bounds(), {});
  for (int n = 0; n < 600; ++n) {
    tick += n % 100 != 99 ? 2 : std::uint64_t{1} << (28 + n / 50);  // up to 2^39
    for (BodyRecord& body : world.bodies()) body.state.asleep = body.state.asleep || n % 150 > 120;
    world.Step(1.0 / 30);
    history.Push(Tick(tick), world.bodies(), {});
    for (const Bytes& datagram : sender.Write(history, 0, 0).datagrams) {
      const auto got = receiver.Read(datagram);
      ASSERT_TRUE(got.ok()) << got.status() << " at " << n;
      for (const BodyRecord& body : got->bodies) seen[body.id] = body.state;
    }
    ASSERT_TRUE(sender.Acknowledge(receiver.WriteAck()).ok());
    for (const BodyRecord& body : world.bodies()) {
      const BodyState truth = quantizer.Dequantize(quantizer.Quantize(body.state));
      ASSERT_EQ(seen.at(body.id).position, truth.position) << "body " << body.id << " at " << n;
    }
  }
}

}  // namespace
}  // namespace tessera::replication

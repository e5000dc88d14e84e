// A client in a large world sees the part around its own body, nearest first, within its budget.
#include "core/replication/interest.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <random>
#include <utility>

#include "core/replication/quantize.h"
#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"

namespace tessera::replication {
namespace {

constexpr Aabb kArena{{-500, -2, -500}, {500, 50, 500}};

TEST(InterestWindowTest, SeesTheCellsWithinTheRadiusAndKeepsThemALittleLonger) {
  const CellGrid grid(kArena, 100);
  InterestWindow window;
  EXPECT_TRUE(window.Follow(grid, 100, Vec3d(0, 0, 0)));
  for (double x = -480; x < 480; x += 7) {
    for (double z = -480; z < 480; z += 7) {
      const std::uint32_t cell = grid.CellAt({x, 0, z}, std::nullopt);
      const double distance_m = std::hypot(x, z);
      if (distance_m <= 100) {
        EXPECT_TRUE(window.Sees(cell)) << x << " " << z;
      }
      if (distance_m > 100 + grid.cell_m() * 1.5) {
        EXPECT_FALSE(window.Sees(cell)) << x << " " << z;
      }
    }
  }
  const std::uint32_t edge = grid.CellAt({-99, 0, 0}, std::nullopt);
  window.Follow(grid, 100, Vec3d(10, 0, 0));
  EXPECT_TRUE(window.Sees(edge));
  window.Follow(grid, 100, Vec3d(60, 0, 0));
  EXPECT_FALSE(window.Sees(edge));
}

TEST(InterestWindowTest, WithoutAPlaceSeesAllUntilItHasOne) {
  const CellGrid grid(kArena, 50);
  InterestWindow window;
  EXPECT_TRUE(window.Follow(grid, 50, std::nullopt));
  EXPECT_FALSE(window.Follow(grid, 50, std::nullopt));
  EXPECT_EQ(window.cells().size(), static_cast<std::size_t>(grid.columns() * grid.rows()));
  EXPECT_TRUE(window.Follow(grid, 50, Vec3d(0, 0, 0)));
  EXPECT_FALSE(window.Sees(grid.CellAt({400, 0, 400}, std::nullopt)));
  EXPECT_TRUE(window.Follow(grid, 50, std::nullopt));
  EXPECT_TRUE(window.Sees(grid.CellAt({400, 0, 400}, std::nullopt)));
}

TEST(CellGridTest, ABodyOnAnEdgeDoesNotChangeCellsToAndFro) {
  const CellGrid grid(kArena, 100);
  const double edge = kArena.min.x + 10 * grid.cell_m();
  std::uint32_t cell = grid.CellAt({edge - 1, 0, 0}, std::nullopt);
  const std::uint32_t first = cell;
  for (int i = 0; i < 20; ++i) {
    cell = grid.CellAt({edge + (i % 2 == 0 ? 0.5 : -0.5), 0, 0}, cell);
    EXPECT_EQ(cell, first);
  }
  EXPECT_NE(grid.CellAt({edge + 0.2 * grid.cell_m(), 0, 0}, cell), first);
}

// A client that walks through a world, over a network that loses and delays.
class Walker {
 public:
  Walker(const SnapshotSettings& settings, double loss, int delay, unsigned seed)
      : loss_(loss), delay_(delay), random_(seed), sender_(settings), receiver_(kArena, settings) {}

  WrittenSnapshot See(const SnapshotHistory& history, Tick tick, Vec3d at) {
    WrittenSnapshot written = sender_.Write(history, {.centre = at, .own = BodyId(1)}, 0, 0);
    for (const Bytes& datagram : written.datagrams) {
      bytes += datagram.size() + kDatagramOverheadBytes;
      if (std::uniform_real_distribution<double>(0, 1)(random_) >= loss_) down_.emplace_back(tick, datagram);
    }
    while (!down_.empty() && down_.front().first + static_cast<std::uint64_t>(delay_) <= tick) {
      const auto got = receiver_.Read(down_.front().second);
      down_.pop_front();
      EXPECT_TRUE(got.ok()) << got.status();
      if (got.ok()) Take(*got);
    }
    up_.emplace_back(tick, receiver_.WriteAck());
    while (!up_.empty() && up_.front().first + static_cast<std::uint64_t>(delay_) <= tick) {
      EXPECT_TRUE(sender_.Acknowledge(up_.front().second).ok());
      up_.pop_front();
    }
    return written;
  }

  std::map<BodyId, BodyState> seen;
  std::map<BodyId, Tick> first_seen;
  std::size_t appeared = 0, vanished = 0, bytes = 0;

 private:
  void Take(const ReceivedSnapshot& snapshot) {
    for (const BodyRecord& body : snapshot.bodies) {
      appeared += seen.contains(body.id) ? 0 : 1;
      seen[body.id] = body.state;
      first_seen.try_emplace(body.id, snapshot.tick);
    }
    for (const DepartureRecord& departure : snapshot.departures) {
      EXPECT_EQ(departure.why, DepartureRecord::Why::kOutOfInterest);
      EXPECT_EQ(seen.erase(departure.id), 1u) << "body " << departure.id << " vanished twice";
      ++vanished;
    }
  }

  double loss_;
  int delay_;
  std::mt19937 random_;
  SnapshotSender sender_;
  SnapshotReceiver receiver_;
  std::deque<std::pair<Tick, Bytes>> down_, up_;
};

// Bodies at rest on a lattice of `pitch_m`, ids from 1.
std::vector<BodyRecord> Lattice(int columns, double pitch_m) {
  std::vector<BodyRecord> bodies;
  for (int i = 0; i < columns * columns; ++i) {
    BodyRecord body{.id = BodyId(static_cast<std::uint64_t>(i) + 1), .epoch = Epoch(1), .state = {}};
    body.state.position = {(i % columns - columns / 2) * pitch_m, 0.5, (i / columns - columns / 2) * pitch_m};
    body.state.asleep = true;
    bodies.push_back(body);
  }
  return bodies;
}

TEST(InterestTest, AClientSeesWhatIsNearAndEachAppearsAndVanishesOnceAWay) {
  for (const double loss : {0.0, 0.2}) {
    SnapshotSettings settings;
    settings.interest_radius_m = 60;
    const std::vector<BodyRecord> bodies = Lattice(60, 10);
    SnapshotHistory history(kArena, settings);
    Walker walker(settings, loss, 6, 1);
    std::uint64_t tick = 0;
    const auto stand = [&](Vec3d at, int snapshots) {
      for (int n = 0; n < snapshots; ++n) {
        tick += 2;
        history.Push(Tick(tick), tick == 2 ? bodies : std::vector<BodyRecord>(), {});
        walker.See(history, Tick(tick), at);
      }
      for (const BodyRecord& body : bodies) {
        const double distance_m = std::hypot(body.state.position.x - at.x, body.state.position.z - at.z);
        if (distance_m <= 60) {
          EXPECT_TRUE(walker.seen.contains(body.id)) << body.id;
        }
        if (distance_m > 60 * 1.17 + 15 * 1.5) {
          EXPECT_FALSE(walker.seen.contains(body.id)) << body.id;
        }
      }
    };
    stand({0, 1, 0}, 60);
    EXPECT_EQ(walker.vanished, 0u);
    EXPECT_EQ(walker.appeared, walker.seen.size());
    for (double x = 0; x < 200; x += 5) {
      tick += 2;
      history.Push(Tick(tick), {}, {});
      walker.See(history, Tick(tick), {x, 1, 0});
    }
    stand({200, 1, 0}, 60);
    EXPECT_EQ(walker.appeared, walker.seen.size() + walker.vanished);
    stand({0, 1, 0}, 60);  // bodies that it turned away from come back as they were
    EXPECT_EQ(walker.appeared, walker.seen.size() + walker.vanished);
  }
}

TEST(InterestTest, KeepsWithinItsBytesASecondAndNothingIsForgotten) {
  SnapshotSettings settings;
  settings.client_bytes_per_s = 20'000;
  MovingBodies world({.count = 800, .world_m = 200});
  const Quantizer quantizer(kArena, settings);
  SnapshotHistory history(kArena, settings);
  Walker walker(settings, 0.05, 6, 2);
  constexpr int kSnapshots = 300;
  std::uint32_t deferred = 0;
  for (int n = 1; n <= kSnapshots; ++n) {
    world.Step(1.0 / 30);
    history.Push(Tick(2 * static_cast<std::uint64_t>(n)), world.bodies(), {});
    deferred += walker.See(history, Tick(2 * static_cast<std::uint64_t>(n)), world.bodies()[0].state.position).deferred;
  }
  EXPECT_GT(deferred, 0u);
  EXPECT_LE(static_cast<double>(walker.bytes), 20'000 * (kSnapshots / 30.0 + 0.2));
  EXPECT_GE(static_cast<double>(walker.bytes), 20'000 * (kSnapshots / 30.0) * 0.8);
  EXPECT_EQ(walker.seen.size(), 800u);
  // Once they rest, the client gets the present state of all.
  for (BodyRecord& body : world.bodies()) {
    body.state.asleep = true;
    body.state.linear_velocity = body.state.angular_velocity = {};
  }
  for (int n = kSnapshots + 1; n <= 2 * kSnapshots; ++n) {
    history.Push(Tick(2 * static_cast<std::uint64_t>(n)), world.bodies(), {});
    walker.See(history, Tick(2 * static_cast<std::uint64_t>(n)), world.bodies()[0].state.position);
  }
  for (const BodyRecord& body : world.bodies()) {
    EXPECT_EQ(walker.seen.at(body.id), quantizer.Dequantize(quantizer.Quantize(body.state))) << body.id;
  }
}

// A region that owns little of what the client sees has a small share, and sends something at each snapshot all the
// same. When the player comes over to it, those bytes are not held against it.
TEST(InterestTest, ADebtOfLongAgoDoesNotStarveTheClient) {
  SnapshotSettings settings;
  settings.client_bytes_per_s = 32'000;
  MovingBodies world({.count = 200, .world_m = 50});
  SnapshotHistory history(kArena, settings);
  SnapshotSender sender(settings);
  std::uint64_t tick = 0;
  const auto sent = [&](double share, int snapshots) {
    std::size_t bodies = 0;
    for (int n = 0; n < snapshots; ++n) {
      tick += 2;
      world.Step(1.0 / 30);
      history.Push(Tick(tick), world.bodies(), {});
      bodies += sender.Write(history, {.centre = Vec3d(), .own = BodyId(1), .budget_share = share}, 0, 0).bodies;
    }
    return bodies;
  };
  EXPECT_GE(sent(0.001, 1800), 1800u) << "one at least, each time";
  EXPECT_GT(sent(1, 15), 200u);
}

// Bodies that go round at a distance of 5 and of 30 m, all of them in every snapshot, and a client between them that
// may be sent so much of it.
class CrowdTest : public testing::Test {
 protected:
  static constexpr std::size_t kNear = 100, kAll = 800;

  // How many of so many snapshots brought a body, in the mean of the near ones and of the far ones.
  std::pair<double, double> Rates(double share, int snapshots) {
    std::array<double, 2> came{};
    deferred = 0;
    for (int n = 0; n < snapshots; ++n) {
      tick_ += 2;
      history_.Push(Tick(tick_), Circle(), {});
      const WrittenSnapshot written =
          sender_.Write(history_, {.centre = Vec3d(), .own = BodyId(1), .budget_share = share}, 0, 0);
      deferred += written.deferred;
      for (const Bytes& bytes : written.datagrams) {
        const auto got = receiver_.Read(bytes);
        EXPECT_TRUE(got.ok()) << got.status();
        if (!got.ok()) continue;
        for (const BodyRecord& body : got->bodies) came[body.id.value() <= kNear ? 0 : 1] += 1;
      }
      EXPECT_TRUE(sender_.Acknowledge(receiver_.WriteAck()).ok());
    }
    return {came[0] / (kNear * snapshots), came[1] / ((kAll - kNear) * snapshots)};
  }

  std::uint32_t deferred = 0;

 private:
  static SnapshotSettings Settings() {
    SnapshotSettings settings;
    settings.interest_radius_m = 60;
    settings.client_bytes_per_s = 200'000;
    return settings;
  }
  std::vector<BodyRecord> Circle() const {
    std::vector<BodyRecord> bodies;
    bodies.reserve(kAll);
    for (std::size_t i = 0; i < kAll; ++i) {
      const double radius = i < kNear ? 5 : 40, angle = static_cast<double>(i) + static_cast<double>(tick_) / 60;
      BodyRecord body{.id = BodyId(i + 1), .epoch = Epoch(1), .state = {}};
      body.state.position = {radius * std::cos(angle), 0.5, radius * std::sin(angle)};
      body.state.linear_velocity = {static_cast<float>(-radius * std::sin(angle)), 0,
                                    static_cast<float>(radius * std::cos(angle))};
      bodies.push_back(body);
    }
    return bodies;
  }

  const SnapshotSettings settings_ = Settings();
  SnapshotHistory history_{kArena, settings_};
  SnapshotSender sender_{settings_};
  SnapshotReceiver receiver_{kArena, settings_};
  std::uint64_t tick_ = 0;
};

TEST_F(CrowdTest, WhatIsNearComesWithEachSnapshotAndWhatIsFarAsOftenAsThereIsRoom) {
  Rates(1, 30);  // it joins
  EXPECT_EQ(Rates(1, 64), std::pair(1.0, 0.25));
  EXPECT_EQ(deferred, 0U);
  Rates(0.2, 60);
  const auto [near, far] = Rates(0.2, 64);
  EXPECT_EQ(near, 1);
  EXPECT_LE(far, 0.125);
  EXPECT_GE(far, 0.0625);
  EXPECT_EQ(deferred, 0U) << "what is due fits again";
  Rates(1, 60);
  EXPECT_EQ(Rates(1, 64), std::pair(1.0, 0.25)) << "there is room again";
}

// A view among bodies that stand in a row and wobble, so that each changes with every snapshot; those that are far are
// shown with one snapshot in four.
class RowTest : public testing::Test {
 protected:
  static constexpr BodyId kBody{7};

  // Whether the next snapshot brings the body, which is at `body`, to a client that looks from `centre`.
  bool Comes(Vec3d body, Vec3d centre) {
    tick_ += 2;
    std::vector<BodyRecord> bodies;
    for (std::uint64_t id = 1; id <= 20; ++id) {
      BodyRecord& record = bodies.emplace_back(BodyRecord{.id = BodyId(id), .epoch = Epoch(1), .state = {}});
      record.state.position = BodyId(id) == kBody ? body : Vec3d(-30, 0.5, static_cast<double>(id));
      record.state.position.y += tick_ % 4 == 0 ? 0.1 : 0;
    }
    history_.Push(Tick(tick_), bodies, {});
    bool came = false;
    for (const Bytes& bytes : sender_.Write(history_, {.centre = centre, .own = BodyId(1)}, 0, 0).datagrams) {
      const auto got = receiver_.Read(bytes);
      EXPECT_TRUE(got.ok()) << got.status();
      for (const BodyRecord& record : got->bodies) came = came || record.id == kBody;
    }
    EXPECT_TRUE(sender_.Acknowledge(receiver_.WriteAck()).ok());
    return came;
  }
  int CountOf(int snapshots, Vec3d body, Vec3d centre) {
    int count = 0;
    for (int n = 0; n < snapshots; ++n) count += Comes(body, centre) ? 1 : 0;
    return count;
  }

 private:
  const SnapshotSettings settings_{.interest_radius_m = 60};
  SnapshotHistory history_{kArena, settings_};
  SnapshotSender sender_{settings_};
  SnapshotReceiver receiver_{kArena, settings_};
  std::uint64_t tick_ = 0;
};

TEST_F(RowTest, ABodyThatComesNearIsShownWithEachSnapshotFromTheNextOneOn) {
  const Vec3d far(40, 0.5, 0), near(5, 0.5, 0);
  CountOf(20, far, {});
  EXPECT_EQ(CountOf(40, far, {}), 10);
  EXPECT_EQ(CountOf(1, near, {}), 1) << "it is in another cell, so it is looked at out of turn";
  EXPECT_EQ(CountOf(10, near, {}), 10);
}

TEST_F(RowTest, AViewThatIsPutElsewhereFindsWhatIsNearThere) {
  const Vec3d body(40, 0.5, 0);
  CountOf(20, body, {});
  EXPECT_EQ(CountOf(40, body, {}), 10);
  EXPECT_EQ(CountOf(11, body, {35, 0, 0}), 11);
}

TEST(InterestTest, AWorldIsJoinedFromTheNearToTheFar) {
  SnapshotSettings settings;
  settings.client_bytes_per_s = 30'000;
  const std::vector<BodyRecord> bodies = Lattice(70, 10);
  SnapshotHistory history(kArena, settings);
  Walker walker(settings, 0, 3, 3);
  for (std::uint64_t n = 1; n <= 240; ++n) {
    history.Push(Tick(2 * n), n == 1 ? bodies : std::vector<BodyRecord>(), {});
    walker.See(history, Tick(2 * n), {0, 1, 0});
  }
  ASSERT_EQ(walker.seen.size(), bodies.size());
  Tick near_by, far_by;
  for (const BodyRecord& body : bodies) {
    const bool near = std::hypot(body.state.position.x, body.state.position.z) < 80;
    Tick& last = near ? near_by : far_by;
    last = std::max(last, walker.first_seen.at(body.id));
  }
  EXPECT_LE(near_by, Tick(20));
  EXPECT_GE(far_by, Tick(60));
}

TEST(NeighboursInARowTest, NamesEachOnceAndKeepsNeighboursTogether) {
  std::vector<std::optional<Vec3d>> places;
  places.reserve(64);
  for (int i = 0; i < 64; ++i) places.emplace_back(Vec3d(i % 2 == 0 ? -200.0 - i : 200.0 + i, 1, 3.0 * i));
  places.emplace_back(std::nullopt);
  places.emplace_back(Vec3d(1e12, 0, -1e12));
  std::vector<std::uint32_t> order = NeighboursInARow(places, 20);
  EXPECT_EQ(order.back(), 64u);
  int crossings = 0;
  for (std::size_t i = 1; i + 1 < order.size(); ++i) {
    crossings += (places[order[i]]->x < 0) != (places[order[i - 1]]->x < 0) ? 1 : 0;
  }
  EXPECT_LE(crossings, 3);  // 63 in the order they came
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

}  // namespace
}  // namespace tessera::replication

// The cost of snapshots in bytes and in time: 500 bodies in motion, 8 clients, 30 snapshots a second. Prints its
// figures; holds them to bounds that only a mistake would exceed.
#include <gtest/gtest.h>

#include <cstdio>
#include <ctime>

#include "core/replication/snapshot.h"
#include "core/replication/testing/moving_bodies.h"

namespace tessera::replication {
namespace {

constexpr std::size_t kBodies = 500, kClients = 8, kSnapshots = 300, kAckDelay = 2;
constexpr std::uint64_t kTicksPerSnapshot = 2;

struct MeasuredClient {
  explicit MeasuredClient(const Aabb& bounds, const SnapshotSettings& settings)
      : sender(settings), receiver(bounds, settings) {}
  SnapshotSender sender;
  SnapshotReceiver receiver;
  std::vector<Bytes> acks;
};

struct Cost {
  std::size_t snapshots = 0, bytes = 0, records = 0;
  double seconds = 0;
  void Print(const char* what) const {
    std::printf("%-8s %6.2f bytes a body, %7.0f bytes a snapshot, %6.1f us a snapshot and client\n", what,
                double(bytes) / double(records), double(bytes) / double(snapshots), seconds / double(snapshots) * 1e6);
  }
};

// CPU time of this thread, whatever else the machine does.
double CpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + double(now.tv_nsec) * 1e-9;
}

TEST(SnapshotSizeTest, FiveHundredMovingBodies) {
  MovingBodies world({.count = kBodies});
  const SnapshotSettings settings;
  SnapshotHistory history(world.bounds(), settings);
  std::vector<MeasuredClient> clients;
  for (std::size_t i = 0; i < kClients; ++i) clients.emplace_back(world.bounds(), settings);

  Cost full, delta, push, ack, read;
  for (std::size_t n = 0; n < kSnapshots; ++n) {
    for (std::uint64_t i = 0; i < kTicksPerSnapshot; ++i) world.Step(1.0 / 60);
    const double start = CpuSeconds();
    history.Push(Tick((n + 1) * kTicksPerSnapshot), world.bodies(), {});
    push.seconds += CpuSeconds() - start;
    for (MeasuredClient& client : clients) {
      const double before = CpuSeconds();
      const WrittenSnapshot written = client.sender.Write(history, 0, 0);
      const double after = CpuSeconds();
      Cost& cost = written.full ? full : delta;
      cost.seconds += after - before;
      ++cost.snapshots;
      cost.records += written.bodies;
      for (const Bytes& bytes : written.datagrams) {
        cost.bytes += bytes.size();
        ASSERT_LE(bytes.size(), settings.max_datagram_bytes);
        ASSERT_TRUE(client.receiver.Read(bytes).ok());
      }
      const double read_done = CpuSeconds();
      read.seconds += read_done - after;
      client.acks.push_back(client.receiver.WriteAck());
      if (n >= kAckDelay) {
        ASSERT_TRUE(client.sender.Acknowledge(client.acks[n - kAckDelay]).ok());
      }
      ack.seconds += CpuSeconds() - read_done;
    }
  }
  full.Print("full");
  delta.Print("delta");
  std::printf("push %.1f us a tick; read %.1f, acknowledge %.1f us a snapshot and client\n",
              push.seconds / double(kSnapshots) * 1e6, read.seconds / double(kSnapshots * kClients) * 1e6,
              ack.seconds / double(kSnapshots * kClients) * 1e6);
  const double writing = full.seconds + delta.seconds + push.seconds + ack.seconds;
  std::printf("region's share of a core at %zu clients and 30 Hz: %.2f %%\n", kClients,
              writing / (kSnapshots / 30.0) * 100);
  EXPECT_LT(double(full.bytes) / double(full.records), 26);
  EXPECT_LT(double(delta.bytes) / double(delta.records), 15);
}

}  // namespace
}  // namespace tessera::replication

// Runs a fake instance for as long as it is let: prints the address of its control plane, then moves two bodies about.
#include <cstdio>
#include <thread>

#include "client_sdk/fake_instance.h"
#include "client_sdk/fake_instance_door.h"

using namespace tessera;
using namespace tessera::client;

int main() {
  using Clock = std::chrono::steady_clock;
  FakeInstance instance(2);
  const InstanceDoor door(instance);
  std::printf("%s\n", instance.address.c_str());
  std::fflush(stdout);
  for (const auto& region : instance.regions) region->Start(Tick(0));

  constexpr auto kInterval = std::chrono::nanoseconds(1'000'000'000 / kSnapshotRate);
  Tick tick;
  for (auto next = Clock::now();; std::this_thread::sleep_for(std::chrono::milliseconds(2))) {
    instance.Service();
    if (Clock::now() < next) continue;
    next += kInterval;
    tick = tick + kTickRate / kSnapshotRate;
    const double t = static_cast<double>(tick.value()) / kTickRate;
    BodyState state;
    state.position = {-5 - 3 * std::cos(t), 1, 3 * std::sin(t)};
    state.linear_velocity = Vec3f(Vec3d(3 * std::sin(t), 0, 3 * std::cos(t)));
    const std::vector<replication::BodyRecord> west = {{BodyId(1), Epoch(1), state}};
    state.position.x += 10;
    const std::vector<replication::BodyRecord> east = {{BodyId(2), Epoch(1), state}};
    instance.regions[0]->Snapshot(tick, west);
    instance.regions[1]->Snapshot(tick, east);
  }
}

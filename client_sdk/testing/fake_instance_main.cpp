// Runs a fake instance for as long as it is let: prints the address of its control plane, then moves two bodies about.
//
//   tessera_fake_instance [--tls]          with --tls the address is of a players' door by TLS: HOST:PORT#FINGERPRINT
#include <cstdio>
#include <string>
#include <string_view>
#include <thread>

#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/testing/fake_tls.h"
#include "client_sdk/testing/instance_door.h"
#include "trust/certificate.h"

using namespace tessera;
using namespace tessera::client;

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  const bool by_tls = argc == 2 && std::string_view(argv[1]) == "--tls";
  if (argc > 1 && !by_tls) {
    std::fprintf(stderr, "usage: tessera_fake_instance [--tls]\n");
    return 2;
  }
  FakeInstance instance(2);
  const InstanceDoor door(instance);
  const trust::KeyedCertificate authority = *trust::MakeAuthority();
  const InstanceDoor tls_door(instance, TlsWith(*trust::IssueServer(authority, "01"), authority.certificate));
  const std::string tls_address = tls_door.address() + "#" + trust::ReadCertificate(authority.certificate)->fingerprint;
  std::printf("%s\n", by_tls ? tls_address.c_str() : instance.address.c_str());
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

// Drifter: the smallest game there is. Joins an instance, pushes its body about, and prints what it sees once a second.
//
//   tessera-drifter 127.0.0.1:7700 plaza-1 [seconds]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "client_sdk/client.h"

using namespace tessera;
using namespace tessera::client;

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s CONTROL_ADDRESS INSTANCE_ID [SECONDS]\n", argv[0]);
    return 2;
  }
  const double seconds = argc > 3 ? std::atof(argv[3]) : 10;
  auto joined = Client::Join({.control_address = argv[1], .instance_id = argv[2], .player_name = "drifter"});
  if (!joined.ok()) {
    std::fprintf(stderr, "%s\n", std::string(joined.status().message()).c_str());
    return 1;
  }
  Client& client = **joined;
  std::printf("player %u in %s\n", client.player().value(), client.scene().name.c_str());

  const TimePoint start = Clock::now();
  TimePoint print_at = start;
  const auto running = [&] { return std::chrono::duration<double>(Clock::now() - start).count() < seconds; };
  while (running() && client.state() != ClientState::kEnded) {
    for (const ClientEvent& event : client.Poll(Clock::now())) {
      if (!event.detail.empty()) std::printf("%s\n", event.detail.c_str());
    }
    // In slow circles, as hard as the scene lets a player push.
    const double angle = std::chrono::duration<double>(Clock::now() - start).count();
    const double force = client.scene().player ? client.scene().player->max_force_n : 0;
    client.Move(Vec3f(Vec3d(force * std::cos(angle), 0, force * std::sin(angle))), {});

    const std::vector<ShownBody> shown = client.Interpolated(Clock::now());
    if (Clock::now() >= print_at) {
      print_at += std::chrono::seconds(1);
      const ClientStats stats = client.Stats();
      std::printf("tick %llu: %zu bodies, %.0f B/s in, delay %.0f ms", (unsigned long long)client.tick().value(),
                  shown.size(), stats.bytes_in_per_s, stats.snapshot_delay_s * 1e3);
      if (const auto own = client.World().find(client.own_body()); own != client.World().end()) {
        const Vec3d p = own->second.state.position;
        std::printf("; I am at (%.1f, %.1f, %.1f) in region %u", p.x, p.y, p.z, own->second.region.value());
      }
      std::printf("\n");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(8));
  }
  if (!client.reason().ok()) return 1;
  return client.state() == ClientState::kEnded || client.Leave().ok() ? 0 : 1;
}

// Drifter: the smallest game there is, in C++. Joins an instance, pushes its body about in slow circles, and prints
// what it sees twice a second.
//
//   drifter GRANT_FILE [SECONDS]        the grant is what a game's backend gives; here grant.c fetched it
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <tessera/tessera.hpp>
#include <thread>
#include <vector>

namespace {

int Fail(const tessera::Error& error) {
  std::fprintf(stderr, "%s\n", error.text.c_str());
  return 1;
}

void Draw(tessera::Client& client) {
  const tessera::Stats stats = client.GetStats();
  std::printf("tick %llu: %zu bodies, %.0f B/s in, delay %.0f ms", static_cast<unsigned long long>(client.tick()),
              client.Bodies().size(), stats.bytes_in_per_s, stats.render_delay_s * 1e3);
  if (const auto own = client.Find(client.own_body())) {
    std::printf("; I am at (%.1f, %.1f, %.1f) in region %u", own->position[0], own->position[1], own->position[2],
                own->region);
  }
  std::printf("\n");
}

// In scenes that declare it.
void ShowHealth(const tessera::Client& client, std::uint64_t body) {
  const auto health = client.PropertyOf(body, "health");
  if (!health || !std::holds_alternative<std::int64_t>(*health)) return;
  std::printf("%s has health %lld\n", body == client.own_body() ? "my body" : "a body",
              static_cast<long long>(std::get<std::int64_t>(*health)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s GRANT_FILE [SECONDS]\n", argv[0]);
    return 2;
  }
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<std::uint8_t> grant{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  tessera::Client client;
  if (const auto error = client.JoinByGrant(grant)) return Fail(error);
  tessera::SceneInfo scene = client.Scene();  // an empty one until the state says more
  bool inside = false;

  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t start = tessera_now(), end = start + (argc > 2 ? std::atoi(argv[2]) : 10) * kSecond;
  std::int64_t draw_at = start;
  while (tessera_now() < end && !client.ended()) {
    if (const auto error = client.Poll()) return Fail(error);
    for (const tessera::Event& event : client.TakeEvents()) {
      if (!event.detail.empty()) std::printf("%s\n", event.detail.c_str());
      if (event.kind == TESSERA_EVENT_PROPERTY_CHANGED) ShowHealth(client, event.body);
    }
    if (!inside && client.state() != TESSERA_JOINING) {
      inside = true;
      scene = client.Scene();
      std::printf("player %u in %s\n", client.player(), scene.name);
    }
    const double angle = static_cast<double>(tessera_now() - start) / kSecond;
    const double force = scene.player_max_force_n;
    client.Move({static_cast<float>(force * std::cos(angle)), 0, static_cast<float>(force * std::sin(angle))});
    client.Bodies();
    if (tessera_now() >= draw_at) {
      draw_at += kSecond / 2;
      Draw(client);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(8));
  }
  if (client.ended()) return 0;
  const auto error = client.Leave();
  return error ? Fail(error) : 0;
}

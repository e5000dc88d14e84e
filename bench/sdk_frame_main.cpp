// tessera-frame FRAMES: a client among 2000 moving bodies draws so many frames, for somebody who counts what
// tessera::bench::DrawFrame executes. Frames before, in which it joins and its clock settles, go another way.
#include <cstdio>
#include <cstdlib>

#include "bench/sdk_stage.h"
#include "client_sdk/client.h"

namespace tessera::bench {
namespace {

using client::Client;
using client::TimePoint;

constexpr std::size_t kBodies = 2000;
constexpr int kBefore = 300;  // frames
constexpr std::chrono::nanoseconds kFrame{1'000'000'000 / client::kTickRate};

std::vector<BodyDef> Balls() {
  std::vector<BodyDef> balls;
  const auto ball = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  for (std::size_t i = 1; i <= kBodies; ++i) {
    BodyDef& def = balls.emplace_back();
    def.id = BodyId(i);
    def.shape = ball;
  }
  return balls;
}

std::size_t Draw(Client& client, TimePoint now) {
  (void)client.Poll(now);
  return client.Interpolated(now).size();
}

}  // namespace

// A game does this in each frame: one poll, and the bodies to be drawn.
[[gnu::noinline]] std::size_t DrawFrame(Client& client, TimePoint now) { return Draw(client, now); }

namespace {

int Run(int frames) {
  SdkStage stage(SdkScene(Balls()));
  client::GrantOptions options;
  options.bind_address = "127.0.0.1";
  options.predict = true;
  options.scene = stage.scene;
  auto client = Client::JoinByGrant(stage.Grant(), options);
  if (!client.ok()) {
    std::fprintf(stderr, "tessera-frame: %s\n", std::string(client.status().message()).c_str());
    return EXIT_FAILURE;
  }
  TimePoint now{std::chrono::hours(1)};
  Tick tick;
  std::size_t drawn = 0;
  for (int frame = 1; frame <= kBefore + frames; ++frame) {
    now += kFrame;
    if (frame % 2 == 0) {
      tick = tick + 2;
      stage.region.Snapshot(tick, MovingBodiesAt(kBodies, static_cast<double>(frame) / client::kTickRate));
    }
    stage.region.Service();
    if (frame <= kBefore) {
      (void)Draw(**client, now);
    } else {
      drawn += DrawFrame(**client, now);
    }
  }
  std::printf("bodies a frame: %.1f, tick %llu of %llu\n", static_cast<double>(drawn) / frames,
              static_cast<unsigned long long>((*client)->tick().value()),
              static_cast<unsigned long long>(tick.value()));
  return drawn >= kBodies * static_cast<std::size_t>(frames) ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  const int frames = argc == 2 ? std::atoi(argv[1]) : 0;
  if (frames <= 0) {
    std::fprintf(stderr, "usage: tessera-frame FRAMES\n");
    return 2;
  }
  return tessera::bench::Run(frames);
}

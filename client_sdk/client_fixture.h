// ClientFixture: a client against a fake instance over real sockets. Time is the test's own: it stands while datagrams
// are on their way, so nothing depends on how fast this machine is.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/testing/fake_instance.h"
#include "client_sdk/world_view.h"

namespace tessera::client {

inline constexpr BodyId kBall{1};
inline constexpr std::chrono::nanoseconds kTick{1'000'000'000 / kTickRate};

inline BodyState Moving(double x, float speed) {
  BodyState state;
  state.position = {x, 1, 0};
  state.linear_velocity = {speed, 0, 0};
  return state;
}

struct ClientFixture : testing::Test {
  // `more`: fields of the scene.
  void Make(std::uint32_t regions, const std::string& more = "") {
    instance = std::make_unique<FakeInstance>(regions, more);
  }
  JoinOptions Options() const {
    return {.control_address = instance->address,
            .instance_id = FakeInstance::kId,
            .player_name = "ada",
            .bind_address = "127.0.0.1"};
  }
  void Join() {
    auto joined = Client::Join(Options());
    ASSERT_TRUE(joined.ok()) << joined.status();
    client = *std::move(joined);
  }
  void PollOnce() {
    instance->Service();
    for (ClientEvent& event : client->Poll(now)) events.push_back(std::move(event));
  }
  // Polls until it is so; the test's clock stands unless `clock_runs`.
  bool Until(const std::function<bool()>& done, bool clock_runs = false) {
    const TimePoint limit = Clock::now() + std::chrono::seconds(30);
    while (!done() && Clock::now() < limit) {
      if (clock_runs) now += std::chrono::milliseconds(1);
      PollOnce();
    }
    return done();
  }
  void Play() {
    ASSERT_TRUE(Until([&] { return client->state() == ClientState::kWaiting; }));
    for (const auto& region : instance->regions) region->Start(Tick(0));
    ASSERT_TRUE(Until([&] { return client->state() == ClientState::kPlaying; }));
  }
  // Two ticks on; `snapshots` sends what the regions have, and the client takes it in.
  void Advance(const std::function<void(Tick)>& snapshots) {
    tick = tick + 2;
    now += 2 * kTick;
    snapshots(tick);
    ASSERT_TRUE(Until([&] { return client->tick() == tick; })) << "tick " << tick;
  }
  int Count(ClientEvent::Kind kind) const {
    return static_cast<int>(
        std::count_if(events.begin(), events.end(), [&](const ClientEvent& e) { return e.kind == kind; }));
  }
  const ClientEvent* Find(ClientEvent::Kind kind) const {
    const auto found = std::find_if(events.begin(), events.end(), [&](const ClientEvent& e) { return e.kind == kind; });
    return found == events.end() ? nullptr : &*found;
  }

  std::unique_ptr<FakeInstance> instance;
  std::unique_ptr<Client> client;
  std::vector<ClientEvent> events;
  TimePoint now{std::chrono::hours(1)};
  Tick tick;
};

}  // namespace tessera::client

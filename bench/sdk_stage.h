// SdkStage: one region over real sockets whose world a measurement moves by hand, and grants that lead to it.
//
// Thread rule: one thread at a time.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "client_sdk/testing/fake_instance.h"
#include "core/world/scene.h"
#include "net/join_grant.h"

namespace tessera::bench {

class SdkStage {
 public:
  static constexpr const char* kInstance = "sdk-1";
  static constexpr PlayerNumber kPlayer{1};

  explicit SdkStage(std::shared_ptr<const Scene> scene_in)
      : scene(std::move(scene_in)),
        map(*MakeGridMap(scene->ground(), 1)),
        region(RegionId(1), *scene, map, key_, kInstance) {
    region.started = true;
  }

  std::vector<std::uint8_t> Grant() const {
    return net::EncodeJoinGrant({.player = kPlayer,
                                 .credentials = net::IssuePlayer(kInstance, kPlayer, net::Generation(1), key_),
                                 .map = map,
                                 .regions = {{RegionId(1), "127.0.0.1", region.port()}},
                                 .scene_hash = std::string(64, 'a'),
                                 .tick_rate_hz = client::kTickRate,
                                 .snapshot_rate_hz = client::kSnapshotRate,
                                 .expected_players = 0});
  }

  std::shared_ptr<const Scene> scene;
  PartitionMap map;

 private:
  const net::SigningKey key_ = net::SigningKey::Make();

 public:
  client::FakeRegion region;
};

// A world of a kilometre in which a ball is a player, with these bodies.
inline std::shared_ptr<Scene> SdkScene(std::vector<BodyDef> bodies) {
  auto scene = std::make_shared<Scene>();
  scene->name = "sdk";
  scene->bounds = {{-500, -50, -500}, {500, 100, 500}};
  scene->tick_rate_hz = client::kTickRate;
  scene->kinds = {""};
  scene->layers = {""};
  scene->view.bytes_per_s = 2e6;
  scene->bodies = std::move(bodies);
  PlayerRules rules;
  rules.body.shape = std::make_shared<const Shape>(Shape{SphereShape{0.5}});
  rules.body.mass_kg = 1;
  rules.spawn_points = {{0, 1, 0}};
  rules.max_force_n = 10;
  rules.max_speed_m_s = 5;
  scene->player = rules;
  return scene;
}

// The player's ball and `count` others, all of which move.
inline std::vector<replication::BodyRecord> MovingBodiesAt(std::size_t count, double seconds) {
  std::vector<replication::BodyRecord> bodies;
  for (std::size_t i = 1; i <= count; ++i) {
    const double phase = static_cast<double>(i) * 0.37, row = static_cast<double>(i % 50),
                 line = static_cast<double>(i / 50);
    BodyState state;
    state.position = {row * 3 - 75 + std::sin(seconds + phase), 1, line * 3 - 60 + std::cos(seconds + phase)};
    state.linear_velocity = Vec3f(Vec3d{std::cos(seconds + phase), 0, -std::sin(seconds + phase)});
    bodies.push_back({BodyId(i), Epoch(1), state});
  }
  BodyState own;
  own.position = {2 * std::sin(seconds), 0.5, 2 * std::cos(seconds)};
  own.linear_velocity = Vec3f(Vec3d{2 * std::cos(seconds), 0, -2 * std::sin(seconds)});
  bodies.push_back({PlayerBodyId(SdkStage::kPlayer), Epoch(1), own});
  return bodies;
}

}  // namespace tessera::bench

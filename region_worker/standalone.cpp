#include "region_worker/standalone.h"

#include <sodium.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <string_view>
#include <utility>

#include "region_worker/input_files.h"

namespace tessera::worker {
namespace {

// A player that came by itself: its body is made by the region that owns its spawn point.
OrderedPlayer MakePlayer(PlayerNumber number, const Scene& scene, const PartitionMap& map) {
  OrderedPlayer player{.number = number};
  if (scene.player) {
    const auto& points = scene.player->spawn_points;
    player.spawn_region = map.OwnerOf(points[(number.value() - 1) % points.size()]);
  }
  return player;
}

}  // namespace

net::SigningKey StandaloneKey() {
  constexpr std::string_view kText = "tessera: the key of standalone worlds";
  net::Seed seed;
  crypto_generichash(seed.data(), seed.size(), reinterpret_cast<const unsigned char*>(kText.data()), kText.size(),
                     nullptr, 0);
  return net::SigningKey(seed);
}

absl::StatusOr<StandaloneWorld> PrepareStandalone(const Standalone& flags, const Identity& self,
                                                  const net::VerificationKey& key) {
  absl::StatusOr<std::shared_ptr<const Scene>> scene = LoadSceneFile(flags.scene_path);
  if (!scene.ok()) return scene.status();
  absl::StatusOr<PartitionMap> map = MakeGridMap((*scene)->ground(), flags.regions);
  if (!map.ok()) return map.status();
  StandaloneWorld world{.scene = *std::move(scene), .order = {}};
  Order& order = world.order;
  order.revision = 1;
  order.map = *std::move(map);
  const net::SigningKey instance_key = StandaloneKey();
  order.certified = {
      .instance_key = instance_key.verification_key(),
      .certificate = net::Sign(
          net::WorkerCertificate{
              .instance_id = self.instance_id, .region = self.region, .incarnation = self.incarnation, .key = key},
          instance_key),
      .worker_key = key};
  order.snapshot_rate_hz = flags.snapshot_rate_hz;
  order.borders = flags.borders;
  // There is no backend: events for it are dropped as they come.
  order.backend.published_up_to = std::numeric_limits<std::uint64_t>::max();
  if (!flags.game_path.empty()) {
    const std::string name = std::filesystem::path(flags.game_path).filename().string();
    order.game = {.path = flags.game_path, .hash = {}, .name = name, .number = 0, .failure = {}};
  }
  if (const std::filesystem::path module = flags.game_module_path; !module.empty()) {
    const std::string folder = module.has_parent_path() ? module.parent_path().string() : ".";
    auto loaded = game::NativeModule::Load(folder, module.stem().string());
    if (!loaded.ok()) return loaded.status();
    world.module = *std::move(loaded);
  }
  if (!flags.movement_path.empty()) {
    auto loaded = game::NativeModule::LoadMovementFile(flags.movement_path);
    if (!loaded.ok()) return loaded.status();
    world.movement = *std::move(loaded);
  }
  for (std::uint32_t region = 1; region <= flags.regions; ++region) {
    const auto link_port = static_cast<std::uint16_t>(flags.base_port + 3 * (region - 1) + 1);
    order.peers.push_back({RegionId(region), Incarnation(region), "127.0.0.1", link_port});
  }
  return world;
}

StandaloneRules RulesOf(const Standalone& flags, const StandaloneWorld& world) {
  StandaloneRules rules;
  rules.players = flags.players;
  if (flags.seconds) {
    rules.runtime = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*flags.seconds));
  }
  rules.make_player = [scene = world.scene, map = *world.order.map](PlayerNumber number) {
    return MakePlayer(number, *scene, map);
  };
  return rules;
}

}  // namespace tessera::worker

// InstancePlan: a client's request for an instance, checked, with all that follows from it alone. It is made outside
// any lock, because a scene can be large; what it needs from the cluster (room, an id) comes later.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/control_records.pb.h"
#include "control_plane/stored_records.h"
#include "core/world/limits.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

struct InstancePlan {
  std::string request_id;
  std::string scene_name;
  std::string scene_hash;
  std::string game_name;     // empty: it runs none
  std::string game_hash;     // empty for a native one: the build that the hosts have
  bool game_native = false;  // it is a shared library of the hosts', of this name
  // A shared library of the hosts' with a movement for the players of a game in Lua; its hash may be empty.
  std::optional<v1::NativeGame> movement;
  Contents contents;
  std::uint32_t tick_rate_hz = 0;
  std::uint32_t snapshot_rate_hz = 0;
  std::uint32_t expected_players = 0, max_players = kUsualPlayers;
  std::chrono::milliseconds start_deadline{0};
  bool lazy = false;
  bool guests = true;  // players may join without a ticket
  bool balance = false;
  std::chrono::milliseconds checkpoint_interval{0};  // 0: none by themselves
  std::uint32_t keep_checkpoints = 3;
  v1::BorderSettings borders;  // every field set
  std::uint32_t region_threads = 1;
  v1::LeaverPolicy leaver_policy = v1::LEAVER_POLICY_STAY;
  std::chrono::milliseconds leaver_grace{0};
  PartitionMap map;                           // the grid
  std::optional<records::Manifest> restored;  // the checkpoint that it starts from
  std::vector<v1::Property> properties;       // that the scene declares
  std::vector<v1::Property> world_properties;
  std::vector<std::string> visuals;    // SHA-256 of the files that the scene is drawn with
  std::vector<Vec3d> spawn_points;     // empty: nobody can join
  std::vector<BodyId> bodies;          // dynamic, of the scene; ascending
  std::shared_ptr<const Scene> scene;  // as it was checked
};

// kInvalidArgument in one line that begins with the field: "spec.regions: 0 is not in 1 to 1000". A game is loaded
// once, within the limits of the Lua host, and one that does not load is refused by file and line: "game.lua:12: ...".
// `guests`: whether they may join where the request does not say so. `uploaded`: the scene that spec.scene_file names,
// serialised; null where the request has its scene inside.
absl::StatusOr<InstancePlan> PlanInstance(const v1::CreateInstanceRequest& request, bool guests = true,
                                          const std::string* uploaded = nullptr);
// The hash of a game that loads with this scene. Errors are as above, with `field` before those of the file itself.
absl::StatusOr<std::string> CheckGame(const v1::GameSource& game, const char* field,
                                      const std::shared_ptr<const Scene>& scene);

}  // namespace tessera::control

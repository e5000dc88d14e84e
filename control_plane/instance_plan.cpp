#include "control_plane/instance_plan.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/message_cost.h"
#include "core/game/game_file.h"
#include "core/game/game_host.h"
#include "core/game/native_name.h"
#include "core/region/settings.h"
#include "core/world/limits.h"
#include "core/world/scene_load.h"
#include "core/world/scene_visuals.h"
#include "game_sdk/lua/lua_module.h"

namespace tessera::control {
namespace {

absl::Status CheckRange(const char* field, std::uint64_t value, std::uint64_t lowest, std::uint64_t highest) {
  if (value >= lowest && value <= highest) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", value, " is not in ", lowest, " to ", highest));
}

absl::StatusOr<std::chrono::milliseconds> StartDeadline(const v1::InstanceSpec& spec) {
  if (!spec.has_start_deadline()) return kDefaultStartDeadline;
  const auto& asked = spec.start_deadline();
  const std::int64_t largest_s = std::chrono::duration_cast<std::chrono::seconds>(kMaxStartDeadline).count();
  if (asked.seconds() < 0 || asked.seconds() >= largest_s || asked.nanos() < 0 || asked.nanos() > 999'999'999) {
    return absl::InvalidArgumentError(
        absl::StrCat("spec.start_deadline: ", asked.seconds(), " s is not in 0 to ", largest_s, " s"));
  }
  return std::chrono::milliseconds(asked.seconds() * 1000 + asked.nanos() / 1'000'000);
}

absl::StatusOr<std::chrono::milliseconds> Span(const char* field, const google::protobuf::Duration& asked,
                                               std::chrono::milliseconds lowest, std::chrono::milliseconds highest) {
  const auto span = std::chrono::milliseconds(asked.nanos() / 1'000'000);
  const bool sane = asked.nanos() >= 0 && asked.nanos() <= 999'999'999 && asked.seconds() >= 0 &&
                    asked.seconds() <= std::chrono::duration_cast<std::chrono::seconds>(highest).count();
  const auto whole = std::chrono::seconds(sane ? asked.seconds() : 0) + span;
  if (sane && whole >= lowest && whole <= highest) return whole;
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", asked.seconds(), " s is not in ",
                                                 static_cast<double>(lowest.count()) / 1000, " to ",
                                                 highest.count() / 1000, " s"));
}

absl::Status PlanLife(const v1::InstanceSpec& spec, InstancePlan& plan) {
  plan.checkpoint_interval = kDefaultCheckpointInterval;
  if (spec.has_checkpoint_interval()) {
    const bool none = spec.checkpoint_interval().seconds() == 0 && spec.checkpoint_interval().nanos() == 0;
    const auto interval = Span("spec.checkpoint_interval", spec.checkpoint_interval(),
                               none ? std::chrono::milliseconds(0) : kMinCheckpointInterval, kMaxCheckpointInterval);
    if (!interval.ok()) return interval.status();
    plan.checkpoint_interval = *interval;
  }
  if (absl::Status status = CheckRange("spec.keep_checkpoints", spec.keep_checkpoints(), 0, kMaxKeptCheckpoints);
      !status.ok()) {
    return status;
  }
  plan.keep_checkpoints = spec.keep_checkpoints() == 0 ? kDefaultKeptCheckpoints : spec.keep_checkpoints();
  plan.leaver_grace = kDefaultLeaverGrace;
  if (spec.has_leaver_grace()) {
    const auto grace = Span("spec.leaver_grace", spec.leaver_grace(), std::chrono::milliseconds(0), kMaxLeaverGrace);
    if (!grace.ok()) return grace.status();
    plan.leaver_grace = *grace;
  }
  if (!v1::LeaverPolicy_IsValid(spec.leaver_policy())) {
    return absl::InvalidArgumentError(
        absl::StrCat("spec.leaver_policy: ", static_cast<int>(spec.leaver_policy()), " is not known"));
  }
  plan.leaver_policy =
      spec.leaver_policy() == v1::LEAVER_POLICY_UNSPECIFIED ? v1::LEAVER_POLICY_STAY : spec.leaver_policy();
  plan.balance = spec.balance();
  if (spec.region_threads() != 0) {
    const absl::Status status = CheckRange("spec.region_threads", spec.region_threads(), 1, region::kMaxRegionThreads);
    if (!status.ok()) return status;
    plan.region_threads = spec.region_threads();
  }
  return absl::OkStatus();
}

absl::Status PlanBorders(const v1::BorderSettings& asked, InstancePlan& plan) {
  if (absl::Status status = CheckRange("spec.borders.ghost_depth", asked.ghost_depth(), 0, region::kMaxGhostDepth);
      !status.ok()) {
    return status;
  }
  if (absl::Status status = CheckRange("spec.borders.whole_up_to", asked.whole_up_to(), 0, region::kMaxWholeUpTo);
      !status.ok()) {
    return status;
  }
  plan.borders = asked;
  if (!asked.has_ghost_depth()) plan.borders.set_ghost_depth(region::RegionSettings().ghost_depth);
  if (!asked.has_whole_up_to()) plan.borders.set_whole_up_to(region::RegionSettings().whole_up_to);
  return absl::OkStatus();
}

absl::Status CheckModule(const char* field, const v1::NativeGame& module) {
  if (absl::Status status = game::CheckModuleName(module.name()); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(field, ".name: ", status.message()));
  }
  if (!module.hash().empty() && !game::IsModuleHash(module.hash())) {
    return absl::InvalidArgumentError(
        absl::StrCat(field, ".hash: must be 64 lower-case hexadecimal digits, or left out"));
  }
  return absl::OkStatus();
}

// The movement itself is with the hosts, whose workers hold it against the scene.
absl::Status PlanMovement(const v1::InstanceSpec& spec, const Scene& scene, InstancePlan& plan) {
  if (!spec.has_movement()) return absl::OkStatus();
  if (!spec.has_game()) {
    return absl::InvalidArgumentError("spec.movement: stands beside a game in Lua, and spec.game is missing");
  }
  if (!scene.player) return absl::InvalidArgumentError("spec.movement: the scene has no player");
  if (absl::Status status = CheckModule("spec.movement", spec.movement()); !status.ok()) return status;
  plan.movement = spec.movement();
  return absl::OkStatus();
}

absl::Status PlanNativeGame(const v1::InstanceSpec& spec, InstancePlan& plan) {
  if (spec.has_game()) {
    return absl::InvalidArgumentError("spec.native_game: spec.game is there too, and a world runs one game");
  }
  const v1::NativeGame& game = spec.native_game();
  if (absl::Status status = CheckModule("spec.native_game", game); !status.ok()) return status;
  plan.game_name = game.name();
  plan.game_hash = game.hash();
  plan.game_native = true;
  return absl::OkStatus();
}

// The game itself is thrown away: what the workers load is checked there again.
absl::Status PlanGame(const v1::InstanceSpec& spec, const std::shared_ptr<const Scene>& scene, InstancePlan& plan) {
  if (spec.has_native_game()) return PlanNativeGame(spec, plan);
  if (!spec.has_game()) return absl::OkStatus();
  auto hash = CheckGame(spec.game(), "spec.game", scene);
  if (!hash.ok()) return hash.status();
  plan.game_name = spec.game().name();
  plan.game_hash = *std::move(hash);
  plan.contents.game = spec.game().content();
  return absl::OkStatus();
}

std::uint32_t MaxPlayersOf(const v1::InstanceSpec& spec) {
  return spec.max_players() == 0 ? kUsualPlayers : spec.max_players();
}

absl::Status CheckNumbers(const v1::CreateInstanceRequest& request) {
  const v1::InstanceSpec& spec = request.spec();
  if (request.request_id().size() > kMaxRequestIdBytes) {
    return absl::InvalidArgumentError(
        absl::StrCat("request_id: ", request.request_id().size(), " bytes are more than ", kMaxRequestIdBytes));
  }
  if (!request.has_spec()) return absl::InvalidArgumentError("spec: missing");
  if (!spec.scene_file().empty() && spec.has_scene()) {
    return absl::InvalidArgumentError("spec.scene_file: spec.scene is there too");
  }
  if (!spec.has_scene() && spec.scene_file().empty()) return absl::InvalidArgumentError("spec.scene: missing");
  if (absl::Status status = CheckRange("spec.regions", spec.regions(), 1, kMaxRegions); !status.ok()) return status;
  if (absl::Status status = CheckRange("spec.max_players", spec.max_players(), 0, kMaxPlayers); !status.ok()) {
    return status;
  }
  return CheckRange("spec.expected_players", spec.expected_players(), 0, MaxPlayersOf(spec));
}

// A request is measured before it is parsed, and so is an upload.
absl::StatusOr<LoadedScene> LoadUploaded(const v1::InstanceSpec& spec, const std::string& bytes) {
  if (!TakesAtMost(bytes, *v1::Scene::descriptor(), kMaxParsedSceneBytes)) {
    return absl::ResourceExhaustedError("spec.scene_file: the scene would take too much memory");
  }
  return LoadScene(SceneForm::kSerialised, bytes, "spec.scene_file", {.scatter_count = {}, .hash = spec.scene_file()});
}

}  // namespace

absl::StatusOr<std::string> CheckGame(const v1::GameSource& game, const char* field,
                                      const std::shared_ptr<const Scene>& scene) {
  const game::GameFile file{game.name(), game.content()};
  if (absl::Status status = game::CheckGameFile(file); !status.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(field, ".", status.message()));
  }
  const auto loaded = game::GameHost::Load(*game::LuaGameModule(), file, scene);
  if (!loaded.ok()) return absl::InvalidArgumentError(loaded.status().message());
  return game::GameHash(file.bytes);
}

absl::StatusOr<InstancePlan> PlanInstance(const v1::CreateInstanceRequest& request, bool guests,
                                          const std::string* uploaded) {
  if (absl::Status status = CheckNumbers(request); !status.ok()) return status;
  const v1::InstanceSpec& spec = request.spec();
  const auto deadline = StartDeadline(spec);
  if (!deadline.ok()) return deadline.status();

  // Agents and workers check the scene again: none of them believes what it is sent, see scene_load.h.
  const absl::StatusOr<LoadedScene> loaded =
      uploaded == nullptr ? LoadScene(spec.scene(), "spec.scene") : LoadUploaded(spec, *uploaded);
  if (!loaded.ok()) return loaded.status();
  const Scene& scene = *loaded->scene;
  const v1::Scene& message = loaded->message;
  auto map = MakeGridMap(scene.ground(), spec.regions());
  if (!map.ok()) return map.status();
  if (absl::Status status = CheckRange("spec.snapshot_rate_hz", spec.snapshot_rate_hz(), 0, scene.tick_rate_hz);
      !status.ok()) {
    return status;
  }
  if (spec.expected_players() > 0 && !scene.player) {
    return absl::InvalidArgumentError(
        absl::StrCat("spec.expected_players: ", spec.expected_players(), ", but the scene has no player"));
  }

  InstancePlan plan;
  if (absl::Status status = PlanLife(spec, plan); !status.ok()) return status;
  if (absl::Status status = PlanBorders(spec.borders(), plan); !status.ok()) return status;
  if (absl::Status status = PlanGame(spec, loaded->scene, plan); !status.ok()) return status;
  if (absl::Status status = PlanMovement(spec, scene, plan); !status.ok()) return status;
  plan.request_id = request.request_id();
  plan.scene_name = scene.name;
  plan.scene_hash = loaded->hash;
  plan.contents.scene = uploaded == nullptr ? message.SerializeAsString() : *uploaded;
  plan.tick_rate_hz = scene.tick_rate_hz;
  plan.snapshot_rate_hz =
      spec.snapshot_rate_hz() > 0 ? spec.snapshot_rate_hz() : std::min(kDefaultSnapshotRateHz, plan.tick_rate_hz);
  plan.expected_players = spec.expected_players();
  plan.max_players = MaxPlayersOf(spec);
  plan.start_deadline = *deadline;
  plan.lazy = spec.lazy();
  plan.guests = spec.has_guests() ? spec.guests() : guests;
  plan.map = *std::move(map);
  plan.properties.assign(message.properties().begin(), message.properties().end());
  plan.world_properties.assign(message.instance_properties().begin(), message.instance_properties().end());
  plan.visuals = VisualFiles(message);
  if (plan.visuals.size() > kMaxVisualFiles) {
    return absl::InvalidArgumentError(absl::StrCat("spec.scene: is drawn with ", plan.visuals.size(),
                                                   " files of meshes, which are more than ", kMaxVisualFiles));
  }
  if (scene.player) plan.spawn_points = scene.player->spawn_points;
  for (const BodyDef& body : scene.bodies) {
    if (body.motion == Motion::kDynamic) plan.bodies.push_back(body.id);
  }
  std::sort(plan.bodies.begin(), plan.bodies.end());
  plan.scene = loaded->scene;
  return plan;
}

}  // namespace tessera::control

// The C interface: worlds in the game's own process.
#include "client_sdk/include/tessera/local.h"

#include <string>
#include <utility>
#include <vector>

#include "client_sdk/c_api/connect.h"
#include "client_sdk/local/local_world.h"

using namespace tessera;
using namespace tessera::c_api;

struct tessera_local {
  std::unique_ptr<local::LocalWorld> world;
  std::string line;  // that was given out last
  const tessera_movement* movement = nullptr;
};

namespace {

// An exception becomes an error, for C has none.
template <class Call>
tessera_code LocalGuarded(Call call) {
  try {
    return SetLastError(call());
  } catch (const std::exception& thrown) {
    return tessera_set_last_error(TESSERA_INTERNAL, thrown.what());
  }
}

absl::StatusOr<local::LocalWorldOptions> OptionsOf(const tessera_local_options& given) {
  if (given.scene == nullptr) return absl::InvalidArgumentError("options.scene: is NULL");
  if (given.game == nullptr && given.game_size > 0) return absl::InvalidArgumentError("options.game: is NULL");
  local::LocalWorldOptions options{.scene = {given.scene, given.scene_size}};
  if (given.scene_name != nullptr) options.scene_name = given.scene_name;
  if (given.game_size > 0) options.game.assign(given.game, given.game_size);
  if (given.game_name != nullptr) options.game_name = given.game_name;
  options.snapshot_rate_hz = given.snapshot_rate_hz;
  options.movement = given.movement;
  return options;
}

}  // namespace

tessera_code tessera_local_world(const tessera_local_options* given, tessera_local** out) {
  if (out == nullptr) return RefuseArgument("world: is NULL");
  *out = nullptr;
  if (given == nullptr) return RefuseArgument("options: is NULL");
  constexpr std::size_t kLeast = offsetof(tessera_local_options, scene_name);
  if (!IsAtLeast(given->size, kLeast, "options.size")) return TESSERA_INVALID_ARGUMENT;
  tessera_local_options whole = TESSERA_LOCAL_OPTIONS;
  std::memcpy(static_cast<void*>(&whole), given, std::min<std::size_t>(given->size, sizeof whole));
  return LocalGuarded([&]() -> absl::Status {
    const auto options = OptionsOf(whole);
    if (!options.ok()) return options.status();
    auto world = local::LocalWorld::Open(*options);
    if (!world.ok()) return world.status();
    *out = new tessera_local{.world = *std::move(world), .line = {}, .movement = whole.movement};
    return absl::OkStatus();
  });
}

tessera_code tessera_local_advance(tessera_local* handle, int64_t now_ns) {
  if (handle == nullptr) return RefuseArgument("world: is NULL");
  const std::chrono::steady_clock::time_point now{std::chrono::nanoseconds(now_ns)};
  return LocalGuarded([&] { return handle->world->Advance(now); });
}

tessera_code tessera_local_join(tessera_local* handle, const tessera_grant_options* given, tessera_client** client) {
  if (handle == nullptr || client == nullptr) return RefuseArgument("world or client: is NULL");
  *client = nullptr;
  tessera_grant_options options = TESSERA_GRANT_OPTIONS;
  if (given != nullptr) {
    constexpr std::size_t kLeast = offsetof(tessera_grant_options, bind_address);
    if (!IsAtLeast(given->size, kLeast, "options.size")) return TESSERA_INVALID_ARGUMENT;
    std::memcpy(static_cast<void*>(&options), given, std::min<std::size_t>(given->size, sizeof options));
  }
  const std::vector<std::uint8_t>& scene = handle->world->packed_scene();
  options.size = sizeof options;
  options.bind_address = "127.0.0.1";
  options.scene = scene.data();
  options.scene_size = scene.size();
  absl::StatusOr<std::vector<std::uint8_t>> grant;
  if (const tessera_code made = LocalGuarded([&] { return (grant = handle->world->Grant()).status(); });
      made != TESSERA_OK) {
    if (options.free_user != nullptr) options.free_user(options.user);  // as the joining does that fails
    return made;
  }
  const tessera_code joined = tessera_join_grant(grant->data(), grant->size(), &options, client);
  if (joined != TESSERA_OK || handle->movement == nullptr) return joined;
  const tessera_code set = tessera_set_movement(*client, handle->movement);
  if (set == TESSERA_OK) return set;
  const std::string why = tessera_last_error();
  tessera_close(*client);
  *client = nullptr;
  return tessera_set_last_error(set, why.c_str());
}

uint64_t tessera_local_tick(const tessera_local* handle) {
  return handle == nullptr ? 0 : handle->world->tick().value();
}

const char* tessera_local_line(tessera_local* handle) {
  if (handle == nullptr) return nullptr;
  const auto line = handle->world->TakeLine();
  if (!line) return nullptr;
  handle->line = (line->error ? "error: " : "") + line->text;
  return handle->line.c_str();
}

void tessera_local_close(tessera_local* handle) { delete handle; }

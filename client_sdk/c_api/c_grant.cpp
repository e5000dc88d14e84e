// The C interface: joining by a grant.
#include <utility>

#include "client_sdk/c_api/handle.h"
#include "client_sdk/session.h"
#include "core/world/packed_scene.h"
#include "net/join_grant.h"

using namespace tessera;
using namespace tessera::c_api;

static_assert(TESSERA_MAX_GRANT == net::kMaxJoinGrantBytes);
static_assert(TESSERA_MAX_TOKEN >= client::kMaxReturnTokenBytes);

namespace {

// The program's pointer, given back once: when the last call that may use it is over.
std::shared_ptr<void> Owned(const tessera_grant_options& options) {
  return {options.user, [free_user = options.free_user](void* user) {
            if (free_user != nullptr) free_user(user);
          }};
}

client::LeaveCall LeaveOf(const tessera_grant_options& options, std::shared_ptr<void> user) {
  if (options.on_leave == nullptr) return nullptr;
  return [call = options.on_leave, user = std::move(user)](const net::Credentials& credentials,
                                                           std::chrono::milliseconds deadline) {
    const std::vector<std::uint8_t> token = client::ReturnTokenOf(credentials);
    const tessera_code code =
        call(user.get(), token.data(), token.size(), static_cast<std::uint32_t>(deadline.count()));
    if (code == TESSERA_OK) return absl::OkStatus();
    return absl::Status(static_cast<absl::StatusCode>(code), tessera_last_error());
  };
}

}  // namespace

tessera_code tessera_renew(tessera_client* handle, const void* grant, size_t grant_size) {
  if (handle == nullptr || grant == nullptr) return Refuse("client or grant: is NULL");
  if (grant_size > TESSERA_MAX_GRANT) return Refuse("grant_size: more than a grant has");
  return Guarded([&] { return Report(handle->client->Renew({static_cast<const std::uint8_t*>(grant), grant_size})); });
}

tessera_code tessera_join_grant(const void* grant, size_t grant_size, const tessera_grant_options* given,
                                tessera_client** out) {
  if (out == nullptr) return Refuse("client: is NULL");
  *out = nullptr;
  if (given != nullptr && !IsSize<tessera_grant_options>(given->size, "options.size")) return TESSERA_INVALID_ARGUMENT;
  return Guarded([&] {
    tessera_grant_options options = TESSERA_GRANT_OPTIONS;
    if (given != nullptr) options = TakeIn(given, options);
    const std::shared_ptr<void> user = Owned(options);
    if (grant == nullptr) return Refuse("grant: is NULL");
    if (grant_size > TESSERA_MAX_GRANT) return Refuse("grant_size: more than a grant has");
    client::GrantOptions join;
    join.deadline = std::chrono::milliseconds(options.deadline_ms);
    join.predict = (options.flags & TESSERA_JOIN_PREDICT) != 0;
    if (options.bind_address != nullptr) join.bind_address = options.bind_address;
    if (options.scene_cache_dir != nullptr) join.scene_cache_dir = options.scene_cache_dir;
    if (options.scene_size > 0) {
      if (options.scene == nullptr) return Refuse("options.scene: is NULL");
      const auto* bytes = static_cast<const std::uint8_t*>(options.scene);
      join.packed_scene.assign(bytes, bytes + options.scene_size);
      if (absl::Status status = CheckPackedScene(join.packed_scene); !status.ok()) return Report(status);
    }
    join.leave = LeaveOf(options, user);
    auto joined = client::Client::JoinByGrant({static_cast<const std::uint8_t*>(grant), grant_size}, join);
    if (!joined.ok()) return Report(joined.status());
    *out = new tessera_client{.client = *std::move(joined), .events = {}, .detail = {}, .property = {}, .user = user};
    return tessera_code{TESSERA_OK};
  });
}

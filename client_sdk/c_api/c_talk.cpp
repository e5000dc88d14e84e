// The C interface: commands, the game's events, names, spectators.
#include <cstring>
#include <optional>
#include <variant>

#include "client_sdk/c_api/handle.h"

using namespace tessera;
using namespace tessera::c_api;

static_assert(TESSERA_EVENT_COMMAND_REFUSED == static_cast<int>(client::ClientEvent::Kind::kCommandRefused));
static_assert(TESSERA_EVENT_GRANT_NEEDED == static_cast<int>(client::ClientEvent::Kind::kGrantNeeded));
static_assert(TESSERA_EVENT_RESTORED == static_cast<int>(client::ClientEvent::Kind::kRestored));
static_assert(TESSERA_EVENT_WORLD_PROPERTY_CHANGED ==
              static_cast<int>(client::ClientEvent::Kind::kWorldPropertyChanged));
static_assert(TESSERA_EVENT_PREDICTION_CORRECTED == static_cast<int>(client::ClientEvent::Kind::kPredictionCorrected));
static_assert(TESSERA_EVENT_MOVEMENT_MISSING == static_cast<int>(client::ClientEvent::Kind::kMovementMissing));
static_assert(TESSERA_EVENT_SPAWN_TAKEN == static_cast<int>(client::ClientEvent::Kind::kSpawnTaken));
static_assert(TESSERA_EVENT_SPAWN_LOST == static_cast<int>(client::ClientEvent::Kind::kSpawnLost));
static_assert(TESSERA_EVENT_TILE_GONE == static_cast<int>(client::ClientEvent::kLastKind));
static_assert(TESSERA_MAX_PREDICTED_SPAWNS == client::Client::kMaxPredictedSpawns);

namespace {

// Writes the text only if it fits with its end, and gives its length.
size_t GiveText(const std::string& text, char* to, size_t capacity) {
  if (to != nullptr && text.size() < capacity) std::memcpy(to, text.c_str(), text.size() + 1);
  return text.size();
}

struct FieldWriter {
  tessera_game_event_field& out;
  void operator()(bool value) const { out.type = TESSERA_FIELD_BOOL, out.integer = value ? 1 : 0; }
  void operator()(std::int64_t value) const { out.type = TESSERA_FIELD_INT, out.integer = value; }
  void operator()(double value) const { out.type = TESSERA_FIELD_REAL, out.real = value; }
  void operator()(const std::string& value) const {
    out.type = TESSERA_FIELD_TEXT, out.text = value.c_str(), out.text_size = value.size();
  }
  void operator()(const Vec3d& v) const {
    out.type = TESSERA_FIELD_VECTOR, out.vector[0] = v.x, out.vector[1] = v.y, out.vector[2] = v.z;
  }
  void operator()(BodyId id) const { out.type = TESSERA_FIELD_BODY, out.integer = static_cast<int64_t>(id.value()); }
  void operator()(PlayerNumber player) const { out.type = TESSERA_FIELD_PLAYER, out.integer = player.value(); }
};

}  // namespace

tessera_code tessera_send(tessera_client* handle, const void* bytes, size_t size) {
  if (handle == nullptr) return Refuse("client: is NULL");
  if (bytes == nullptr && size > 0) return Refuse("bytes: is NULL");
  return Guarded([&] { return Report(handle->client->Send({static_cast<const char*>(bytes), size})); });
}

tessera_code tessera_predict_spawn(tessera_client* handle, const tessera_spawn* given, const void* command,
                                   size_t command_size, uint64_t* body) {
  if (handle == nullptr || given == nullptr) return Refuse("client or spawn: is NULL");
  if (command == nullptr && command_size > 0) return Refuse("command: is NULL");
  if (!IsSize<tessera_spawn>(given->size, "spawn.size")) return TESSERA_INVALID_ARGUMENT;
  const tessera_spawn from = TakeIn(given, tessera_spawn TESSERA_SPAWN);
  if (from.prefab == nullptr) return Refuse("prefab: is NULL");
  if ((from.flags & ~std::uint32_t{TESSERA_SPAWN_FROM_OWN}) != 0) return Refuse("flags: more than there are");
  return Guarded([&] {
    const auto vector = [](const double* of) { return Vec3d(of[0], of[1], of[2]); };
    const double* const q = from.orientation;
    const client::SpawnAsk ask{.prefab = from.prefab,
                               .motion = {.position = vector(from.position),
                                          .rotation = Quatd(q[0], q[1], q[2], q[3]),
                                          .velocity_m_s = vector(from.velocity),
                                          .spin_rad_s = vector(from.spin)},
                               .from_own = (from.flags & TESSERA_SPAWN_FROM_OWN) != 0};
    const auto made = handle->client->PredictSpawn(ask, {static_cast<const char*>(command), command_size});
    if (!made.ok()) return Report(made.status());
    if (body != nullptr) *body = made->value();
    return tessera_code{TESSERA_OK};
  });
}

int32_t tessera_next_game_event(tessera_client* handle, tessera_game_event* out) {
  if (handle == nullptr || out == nullptr || !IsSize<tessera_game_event>(out->size, "event.size")) return 0;
  return GuardedValue(int32_t{0}, [&]() -> int32_t {
    for (client::GameEvent& event : handle->client->TakeGameEvents()) handle->game_events.push_back(std::move(event));
    if (handle->game_events.empty()) return 0;
    handle->game_event = std::move(handle->game_events.front());
    handle->game_events.pop_front();
    tessera_game_event given = TESSERA_GAME_EVENT;
    given.name = handle->game_event.name.c_str();
    given.field_count = handle->game_event.values.size();
    GiveOut(given, out);
    return 1;
  });
}

tessera_code tessera_game_event_field_at(const tessera_client* handle, size_t index, tessera_game_event_field* out) {
  if (handle == nullptr || out == nullptr) return Refuse("client or field: is NULL");
  if (!IsSize<tessera_game_event_field>(out->size, "field.size")) return TESSERA_INVALID_ARGUMENT;
  const auto& values = handle->game_event.values;
  if (index >= values.size()) return Report(absl::NotFoundError("index: the event has fewer fields"));
  tessera_game_event_field given = TESSERA_GAME_EVENT_FIELD;
  given.name = values[index].first.c_str();
  std::visit(FieldWriter{given}, values[index].second);
  GiveOut(given, out);
  return TESSERA_OK;
}

tessera_code tessera_find_game_event_field(const tessera_client* handle, const char* name,
                                           tessera_game_event_field* out) {
  if (handle == nullptr || name == nullptr || out == nullptr) return Refuse("client, name or field: is NULL");
  if (!IsSize<tessera_game_event_field>(out->size, "field.size")) return TESSERA_INVALID_ARGUMENT;
  const auto& values = handle->game_event.values;
  for (size_t i = 0; i < values.size(); ++i) {
    if (values[i].first == name) return tessera_game_event_field_at(handle, i, out);
  }
  return Report(absl::NotFoundError("name: the event has no such field"));
}

size_t tessera_player_name(const tessera_client* handle, uint32_t player, char* name, size_t capacity) {
  if (handle == nullptr) return 0;
  return GuardedValue(size_t{0},
                      [&] { return GiveText(handle->client->NameOf(PlayerNumber(player)), name, capacity); });
}

size_t tessera_disconnect_reason(const tessera_client* handle, char* reason, size_t capacity) {
  if (handle == nullptr) return 0;
  return GuardedValue(size_t{0},
                      [&] { return GiveText(std::string(handle->client->reason().message()), reason, capacity); });
}

int32_t tessera_spectating(const tessera_client* handle, double view[3]) {
  if (handle == nullptr) return 0;
  const std::optional<Vec3d> at = handle->client->spectator_view();
  if (!at) return 0;
  if (view != nullptr) view[0] = at->x, view[1] = at->y, view[2] = at->z;
  return 1;
}

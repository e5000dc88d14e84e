// Tessera's client for C++17 and later: the C interface of tessera.h with objects that clean up after themselves.
// Header only, so no C++ type crosses the library's border; what holds for tessera.h holds here.
//
//   tessera::Client client;
//   if (tessera::Error error = client.JoinByGrant(grant)) return Fail(error.text);   // from the game's backend
//   while (running) {                                      // once a frame
//     client.Poll();
//     for (const tessera::Event& event : client.TakeEvents()) ...
//     client.Move({fx, 0, fz});
//     for (const tessera::Body& body : client.Bodies()) Draw(body.id, body.position, body.orientation);
//   }
#ifndef TESSERA_TESSERA_HPP_
#define TESSERA_TESSERA_HPP_

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "tessera.h"

namespace tessera {

// True where something went wrong.
struct Error {
  tessera_code code = TESSERA_OK;
  std::string text;
  explicit operator bool() const { return code != TESSERA_OK; }
  static Error Of(tessera_code code) { return code == TESSERA_OK ? Error{} : Error{code, tessera_last_error()}; }
};

// Options for Client::Join.
struct Options {
  std::string control_address{};  // as in tessera_join_options; empty: this user's `tessera up`
  std::string instance_id{};
  std::string player_name{};
  std::chrono::milliseconds deadline{10'000};
  std::string bind_address{};  // IPv4, of the local socket; empty: any
  bool predict = true;         // show the own body as the inputs already made will have it
  bool watch = false;          // join as a viewer: TESSERA_JOIN_WATCH
  // Client::ReturnToken of an earlier client of this player: comes back as the same one. Empty: a new player.
  std::vector<std::uint8_t> returning{};
  std::string ticket{};  // as in tessera_join_options; empty: a guest
};

// Options for Client::JoinByGrant.
struct GrantOptions {
  std::chrono::milliseconds deadline{10'000};
  std::string bind_address{};     // IPv4, of the local socket; empty: any
  std::string scene_cache_dir{};  // a folder that keeps scenes; empty: none is kept
  bool predict = true;            // show the own body as the inputs already made will have it
};

class LocalWorld;  // <tessera/local.hpp>

struct Event {
  tessera_event_kind kind = TESSERA_EVENT_ENDED;
  std::uint64_t body = 0;
  std::uint32_t region = 0, input = 0;
  std::string detail{};
  std::uint64_t other = 0;
  std::string property{};
  std::array<double, 3> contact_point{}, contact_normal{};
  double contact_impulse = 0;
  bool since_before = false;  // the two touched or overlapped already when this client connected to the region
  std::uint32_t tile = 0;
};

// A value of an event of the game; bodies and players are their ids.
using GameValue = std::variant<bool, std::int64_t, double, std::string, std::array<double, 3>>;
struct GameEvent {
  std::string name{};
  std::map<std::string, GameValue> values{};
};

struct BodyReference {
  std::uint64_t id = 0;  // 0: none
};
using Property = std::variant<bool, std::int64_t, double, std::string, std::array<double, 3>, BodyReference,
                              std::vector<std::uint8_t>>;

using Body = tessera_body;
using Stats = tessera_stats;
using RegionStats = tessera_region_info;
using Steering = tessera_steering;  // begins as TESSERA_STEERING
using Spawn = tessera_spawn;        // begins as TESSERA_SPAWN
using BodyInfo = tessera_body_info;
using SceneInfo = tessera_scene_info;
using ShapeInfo = tessera_shape_info;
using VisualInfo = tessera_visual_info;
using TileInfo = tessera_tile_info;
using Vector = std::array<float, 3>;

// A shape of the scene; valid as long as its client, or the tile that it is in.
//   for (const ShapeChild& child : shape.Children()) Draw(child.shape, child.position, child.orientation);
struct ShapeChild;
class SceneShape {
 public:
  SceneShape() = default;
  explicit SceneShape(const tessera_shape* handle) : handle_(handle) {}
  explicit operator bool() const { return handle_ != nullptr; }
  // kind, dimensions, vertices, indices: as the kind has them.
  ShapeInfo Info() const {
    ShapeInfo info = TESSERA_SHAPE_INFO;
    tessera_get_shape(handle_, &info);
    return info;
  }
  // The parts of a compound; no other shape has any.
  std::vector<ShapeChild> Children() const;
  // Meshes that are drawn in its place; most shapes have none.
  std::vector<VisualInfo> Visuals() const {
    std::vector<VisualInfo> visuals;
    VisualInfo info = TESSERA_VISUAL_INFO;
    while (handle_ != nullptr && tessera_shape_visual(handle_, visuals.size(), &info) == TESSERA_OK) {
      visuals.push_back(info);
    }
    return visuals;
  }
  const tessera_shape* get() const { return handle_; }

 private:
  const tessera_shape* handle_ = nullptr;
};
struct ShapeChild {
  SceneShape shape{};
  std::array<double, 3> position{};  // in the compound
  std::array<double, 4> orientation{};
};
inline std::vector<ShapeChild> SceneShape::Children() const {
  std::vector<ShapeChild> children(handle_ == nullptr ? 0 : Info().child_count);
  for (std::size_t i = 0; i < children.size(); ++i) {
    const tessera_shape* child = nullptr;
    tessera_shape_child(handle_, i, &child, children[i].position.data(), children[i].orientation.data());
    children[i].shape = SceneShape(child);
  }
  return children;
}

// The body that a player has, in the world or not; 0 for a body that is no player's, and the other way round.
inline std::uint64_t BodyOfPlayer(std::uint32_t player) { return tessera_player_body(player); }
inline std::uint32_t PlayerOfBody(std::uint64_t body) { return tessera_player_of_body(body); }

class Client {
 public:
  // By a grant: does not wait. Until the state is WAITING or PLAYING the scene is an empty one.
  Error JoinByGrant(const void* grant, std::size_t size, const GrantOptions& options = {}) {
    tessera_grant_options given = TESSERA_GRANT_OPTIONS;
    given.deadline_ms = static_cast<std::uint32_t>(options.deadline.count());
    given.bind_address = options.bind_address.empty() ? nullptr : options.bind_address.c_str();
    given.scene_cache_dir = options.scene_cache_dir.empty() ? nullptr : options.scene_cache_dir.c_str();
    given.flags = options.predict ? std::uint32_t{TESSERA_JOIN_PREDICT} : 0;
    tessera_client* joined = nullptr;
    const Error error = Error::Of(tessera_join_grant(grant, size, &given, &joined));
    client_.reset(joined);
    return error;
  }
  Error JoinByGrant(const std::vector<std::uint8_t>& grant, const GrantOptions& options = {}) {
    return JoinByGrant(grant.data(), grant.size(), options);
  }
  // Goes on by a newer grant for the same player: after TESSERA_EVENT_GRANT_NEEDED, or before.
  Error Renew(const void* grant, std::size_t size) { return Error::Of(tessera_renew(get(), grant, size)); }
  Error Renew(const std::vector<std::uint8_t>& grant) { return Renew(grant.data(), grant.size()); }
  // Through a control plane: in <tessera/connect.hpp>, and libtessera-connect.
  Error Join(const Options& options);
  // Into a world in this process: in <tessera/local.hpp>, and libtessera-local.
  Error JoinLocal(LocalWorld& world, const GrantOptions& options = {});
  Error Leave(std::chrono::milliseconds deadline = std::chrono::milliseconds(2000)) {
    return Error::Of(tessera_leave(get(), static_cast<std::uint32_t>(deadline.count())));
  }

  // A recording, as if it were played again now.
  Error Play(const std::string& file) {
    tessera_client* playing = nullptr;
    const Error error = Error::Of(tessera_play(file.c_str(), &playing));
    client_.reset(playing);
    return error;
  }
  // `max_bytes` 0: 1 GiB.
  Error Record(const std::string& file, std::uint64_t max_bytes = 0) {
    return Error::Of(tessera_record(get(), file.c_str(), max_bytes));
  }
  // How long a recording is, and where it is played from next: seconds.
  double RecordingSeconds() const { return tessera_recording_seconds(get()); }
  Error Seek(double seconds) { return Error::Of(tessera_seek(get(), seconds)); }
  Error StopRecording() { return Error::Of(tessera_stop_recording(get())); }

  // Makes whoever has it this player, until the player leaves. Secret.
  std::vector<std::uint8_t> ReturnToken() const {
    std::vector<std::uint8_t> token(TESSERA_MAX_TOKEN);
    token.resize(tessera_return_token(get(), token.data(), token.size()));
    return token;
  }

  Error Poll(std::int64_t now_ns = tessera_now()) { return Error::Of(tessera_poll(get(), now_ns)); }
  std::vector<Event> TakeEvents() {
    std::vector<Event> events;
    tessera_event event = TESSERA_EVENT;
    while (tessera_next_event(get(), &event) != 0) {
      events.push_back({event.kind,
                        event.body,
                        event.region,
                        event.input,
                        event.detail,
                        event.other,
                        event.property,
                        {event.contact_point[0], event.contact_point[1], event.contact_point[2]},
                        {event.contact_normal[0], event.contact_normal[1], event.contact_normal[2]},
                        event.contact_impulse,
                        (event.flags & TESSERA_EVENT_SINCE_BEFORE) != 0,
                        event.tile});
    }
    return events;
  }
  // Asks something of the game: exactly once, in order; at most TESSERA_MAX_COMMAND bytes.
  Error Send(std::string_view bytes) { return Error::Of(tessera_send(get(), bytes.data(), bytes.size())); }
  // The same, and shows at once the body that the game makes by it; `body` gets the id that it has until an event
  // says under which one it goes on.
  //   Spawn ball = TESSERA_SPAWN;
  //   ball.prefab = "ball";
  //   if (client.PredictSpawn(ball, "throw", body)) client.Send("throw");  // where nothing is predicted
  Error PredictSpawn(const Spawn& spawn, std::string_view command, std::uint64_t& body) {
    return Error::Of(tessera_predict_spawn(get(), &spawn, command.data(), command.size(), &body));
  }
  // Events that the game sent this player since the last call, each once and in order.
  //   for (const GameEvent& event : client.TakeGameEvents()) {
  //     if (event.name == "score") Draw(std::get<std::int64_t>(event.values.at("points")));
  //   }
  std::vector<GameEvent> TakeGameEvents() {
    std::vector<GameEvent> events;
    tessera_game_event event = TESSERA_GAME_EVENT;
    while (tessera_next_game_event(get(), &event) != 0) {
      GameEvent& taken = events.emplace_back();
      taken.name = event.name;
      for (std::size_t i = 0; i < event.field_count; ++i) {
        tessera_game_event_field field = TESSERA_GAME_EVENT_FIELD;
        if (tessera_game_event_field_at(get(), i, &field) == TESSERA_OK) taken.values.emplace(field.name, Of(field));
      }
    }
    return events;
  }
  // The name of a player whose body is in sight; empty for others, and for those without one.
  std::string NameOf(std::uint32_t player) const {
    char name[TESSERA_MAX_PLAYER_NAME + 1] = "";
    tessera_player_name(get(), player, name, sizeof name);
    return name;
  }
  // Why the client has ended: the game's own words where the game sent the player away.
  std::string DisconnectReason() const {
    std::string reason(tessera_disconnect_reason(get(), nullptr, 0) + 1, 0);
    tessera_disconnect_reason(get(), reason.data(), reason.size());
    reason.pop_back();
    return reason;
  }
  // Where the player looks from while the game keeps its body out of the world.
  std::optional<std::array<double, 3>> SpectatorView() const {
    std::array<double, 3> view{};
    if (tessera_spectating(get(), view.data()) == 0) return std::nullopt;
    return view;
  }

  tessera_state state() const { return tessera_get_state(get()); }
  bool ended() const { return state() == TESSERA_ENDED; }

  // As they are to be drawn now. Valid until the next call.
  const std::vector<Body>& Bodies(std::int64_t now_ns = tessera_now()) {
    for (;;) {
      const std::size_t room = bodies_.size();
      const std::size_t count = tessera_bodies(get(), now_ns, bodies_.data(), sizeof(Body), room);
      bodies_.resize(count, Body TESSERA_BODY);
      if (count <= room) return bodies_;
    }
  }
  std::optional<Body> Find(std::uint64_t id) const {
    Body body = TESSERA_BODY;
    if (tessera_find_body(get(), id, &body) != TESSERA_OK) return std::nullopt;
    return body;
  }
  // A property that the scene declares, as it is now; nothing if there is no such body or property.
  //   if (auto health = client.PropertyOf(id, "health")) Draw(std::get<std::int64_t>(*health));
  std::optional<Property> PropertyOf(std::uint64_t body, const std::string& name) const {
    tessera_property value = TESSERA_PROPERTY;
    if (tessera_get_property(get(), body, name.c_str(), &value) != TESSERA_OK) return std::nullopt;
    return PropertyFrom(value);
  }
  // The same of the world as a whole: one of the scene's instance_properties.
  std::optional<Property> WorldPropertyOf(const std::string& name) const {
    tessera_property value = TESSERA_PROPERTY;
    if (tessera_get_world_property(get(), name.c_str(), &value) != TESSERA_OK) return std::nullopt;
    return PropertyFrom(value);
  }
  std::uint32_t player() const { return tessera_player(get()); }
  std::uint64_t own_body() const { return tessera_own_body(get()); }
  std::uint64_t tick() const { return tessera_tick(get()); }
  std::uint64_t map_version() const { return tessera_map_version(get()); }
  std::uint32_t last_applied_input() const { return tessera_last_applied_input(get()); }
  tessera_clock Clock() const {
    tessera_clock clock = TESSERA_CLOCK;
    tessera_get_clock(get(), &clock);
    return clock;
  }

  std::uint32_t Move(Vector force, Vector torque = {}) { return tessera_move(get(), force.data(), torque.data()); }

  std::uint32_t Steer(const Steering& steering) { return tessera_steer(get(), &steering); }

  // The function by which the world's game moves players' bodies, from <tessera/movement.h>; null: none any more. It
  // outlives the client.
  Error SetMovement(const tessera_movement* movement) { return Error::Of(tessera_set_movement(get(), movement)); }

  SceneInfo Scene() const {
    SceneInfo scene = TESSERA_SCENE_INFO;
    tessera_get_scene(get(), &scene);
    return scene;
  }
  // All bodies of the scene but those in tiles, ascending by id; static ones never appear among Bodies().
  //   for (const BodyInfo& body : client.SceneBodies()) Draw(SceneShape(body.shape), body.position, body.orientation);
  std::vector<BodyInfo> SceneBodies() const {
    std::vector<BodyInfo> bodies(Scene().body_count, BodyInfo TESSERA_BODY_INFO);
    for (std::size_t i = 0; i < bodies.size(); ++i) tessera_scene_body(get(), i, &bodies[i]);
    return bodies;
  }
  // A tile of a large level, 0 to Scene().tile_count - 1; nothing beyond.
  std::optional<TileInfo> Tile(std::uint32_t tile) const {
    TileInfo info = TESSERA_TILE_INFO;
    if (tessera_get_tile(get(), tile, &info) != TESSERA_OK) return std::nullopt;
    return info;
  }
  // The bodies of a tile, ascending by id; none while it is not here.
  std::vector<BodyInfo> TileBodies(std::uint32_t tile) const {
    const std::optional<TileInfo> info = Tile(tile);
    std::vector<BodyInfo> bodies(info ? info->body_count : 0, BodyInfo TESSERA_BODY_INFO);
    for (std::size_t i = 0; i < bodies.size(); ++i) tessera_tile_body(get(), tile, i, &bodies[i]);
    return bodies;
  }
  // Which tiles come: those within `radius_m` of the own body, or of `centre`; see tessera_view_tiles.
  Error ViewTiles(double radius_m, const std::optional<std::array<double, 3>>& centre = std::nullopt) {
    return Error::Of(tessera_view_tiles(get(), centre ? centre->data() : nullptr, radius_m));
  }
  std::optional<BodyInfo> InfoOf(std::uint64_t id) const {
    BodyInfo info = TESSERA_BODY_INFO;
    if (tessera_body_of(get(), id, &info) != TESSERA_OK) return std::nullopt;
    return info;
  }
  Stats GetStats() const {
    Stats stats = TESSERA_STATS;
    tessera_get_stats(get(), &stats);
    return stats;
  }

  // The regions that the client is connected to or dials, with what they say of themselves; ascending by number.
  std::vector<RegionStats> Regions() const {
    std::vector<RegionStats> regions;
    RegionStats region = TESSERA_REGION_INFO;
    while (tessera_region_stats(get(), regions.size(), &region) == TESSERA_OK) regions.push_back(region);
    return regions;
  }

  Error SimulateNetwork(const tessera_network& network) { return Error::Of(tessera_simulate_network(get(), &network)); }

  tessera_client* get() const { return client_.get(); }

 private:
  static Property PropertyFrom(const tessera_property& value) {
    switch (value.type) {
      case TESSERA_PROPERTY_BOOL:
        return Property(value.integer != 0);
      case TESSERA_PROPERTY_INT:
        return Property(value.integer);
      case TESSERA_PROPERTY_REAL:
        return Property(value.real);
      case TESSERA_PROPERTY_VECTOR:
        return Property(std::array<double, 3>{value.vector[0], value.vector[1], value.vector[2]});
      case TESSERA_PROPERTY_BODY:
        return Property(BodyReference{value.body});
      case TESSERA_PROPERTY_BYTES:
        return Property(std::vector<std::uint8_t>(value.bytes, value.bytes + value.byte_count));
      default:
        return Property(std::string(value.text));
    }
  }

  static GameValue Of(const tessera_game_event_field& field) {
    switch (field.type) {
      case TESSERA_FIELD_BOOL:
        return field.integer != 0;
      case TESSERA_FIELD_REAL:
        return field.real;
      case TESSERA_FIELD_TEXT:
        return std::string(field.text, field.text_size);
      case TESSERA_FIELD_VECTOR:
        return std::array<double, 3>{field.vector[0], field.vector[1], field.vector[2]};
      default:
        return field.integer;
    }
  }

  struct Close {
    void operator()(tessera_client* client) const { tessera_close(client); }
  };
  std::unique_ptr<tessera_client, Close> client_;
  std::vector<Body> bodies_;
};

}  // namespace tessera

#endif  // TESSERA_TESSERA_HPP_

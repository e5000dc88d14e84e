// Client: a player's way into a running world. What a game embeds.
//
// It joins through the control plane, holds one connection to each region that its interest touches, and merges their
// snapshots into one world: of two states of a body the one with the higher ownership epoch counts, then the later
// tick. So a body that crosses a border is always there, and there once. Regions that come, go or move while it plays
// are followed by the map; one that falls silent is dialled again, as the same player.
//
//   auto client = Client::Join({.control_address = address, .instance_id = "plaza-1", .player_name = "ada"});
//   if (!client.ok()) ...                                  // says why
//   while (running) {                                      // once a frame
//     for (const ClientEvent& event : (*client)->Poll(Clock::now())) ...
//     (*client)->Move(steering, {});
//     for (const ShownBody& body : (*client)->Interpolated(Clock::now())) Draw(body.id, body.pose);
//   }
//
// It has 50 methods: one for each function of tessera.h, which passes its calls on to them.
//
// Poll never waits; Join and Leave do, up to a deadline. JoinByGrant does not: it needs no control plane, and gets the
// scene from the regions while it is JOINING. It uses no thread of its own beyond gRPC's, which only Join has.
// Thread rule: one thread at a time. Times given to one client never go back.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/network_conditions.h"
#include "client_sdk/stats.h"
#include "core/world/body_tuning.h"
#include "core/world/level_tiles.h"
#include "core/world/partition_map.h"
#include "core/world/prefab.h"
#include "core/world/properties.h"
#include "core/world/scene.h"
#include "net/credential.h"
#include "trust/credentials.h"

struct tessera_movement;  // tessera/movement.h

namespace tessera::client {

using Clock = std::chrono::steady_clock;
using TimePoint = Clock::time_point;

struct JoinOptions {
  std::string control_address;  // unix:PATH, or HOST:PORT#FINGERPRINT; see trust/control_address.h
  std::string instance_id;
  std::string player_name;  // shown to others; at most 32 bytes of UTF-8 without control characters
  // Client::return_token of an earlier client of this player, in whatever process: comes back as the same player, whose
  // body is where the world left it; a process that plays it still is told so and ends. Empty: a new player.
  std::vector<std::uint8_t> returning{};
  // Until the control plane has answered, and then until all regions have. A lazy instance starts its workers
  // meanwhile.
  std::chrono::milliseconds deadline{10'000};
  std::string bind_address = "0.0.0.0";  // IPv4, of the local socket
  NetworkConditions network{};           // to try a game on a bad one
  // Show the own body and the bodies that it touches where the inputs already made will bring them, rather than where
  // the newest snapshot has them. Costs up to a dozen steps of a small world for each snapshot.
  bool predict = false;
  // Join as a viewer: it sees all of the world, whatever the scene's view, and takes no part in it. It has no player,
  // no body and no return token, nobody knows of it, and a lazy instance does not start for it. For programs that show
  // a world or record it; a region serves few of them.
  bool watch = false;
  trust::Credentials credentials{};  // for a door that asks for them; players need none
  // A game's backend's word about who the player is (docs/tickets.md), which is good for one join and says the name.
  // Then player_name and returning are empty.
  std::string ticket{};
};

// Tells whoever gave the grant that the player leaves.
using LeaveCall = std::function<absl::Status(const net::Credentials& credentials, std::chrono::milliseconds deadline)>;

struct GrantOptions {
  // Until all regions have answered; while the scene comes, it begins anew with each part.
  std::chrono::milliseconds deadline{10'000};
  std::string bind_address = "0.0.0.0";  // as in JoinOptions, and so on
  NetworkConditions network{};
  bool predict = false;
  // A folder that keeps scenes for the next time; empty: none is kept.
  std::string scene_cache_dir{};
  // The scene, for a caller that has it, packed (core/world/packed_scene.h) or whole: it is not fetched then.
  std::vector<std::uint8_t> packed_scene{};
  std::shared_ptr<const Scene> scene{};
  LeaveCall leave{};
};

enum class ClientState : std::uint8_t {
  kJoining,  // not all regions have answered yet, or the scene is not here
  kWaiting,  // for the other players
  kPlaying,  // the world moves
  kEnded,    // for good; see Client::reason()
};

// Where and how hard two bodies met.
struct MeetingPoint {
  Vec3d point;        // m in the world
  Vec3f normal;       // unit, from `body` to `other`; 0 where it is not known
  float impulse = 0;  // N s, in the step in which they met
  friend bool operator==(const MeetingPoint&, const MeetingPoint&) = default;
};

struct ClientEvent {
  enum class Kind : std::uint8_t {
    kAppeared,      // body, region
    kVanished,      // body: removed for good, or no region has it any more
    kStarted,       // the world moves from now on
    kInputRefused,  // body, input_number, detail
    kRegionLost,    // region: the connection is gone, it is dialled again; its bodies stand still
    kRegionBack,    // region: one that was lost, and only then
    kMapChanged,
    kEnded,            // detail
    kContactBegan,     // body, other, region, contact: one of them is a player's
    kContactEnded,     // body, other, region
    kTriggerEntered,   // body, other, region: one of them is a trigger
    kTriggerLeft,      // body, other, region
    kRecordingEnded,   // detail: why it could not go on; nothing after StopRecording
    kPropertyChanged,  // body, region, property: of one that has appeared before; PropertyOf gives the new value
    kClockChanged,     // the world pauses, goes on, or goes at another pace: see Client::clock
    kCommandRefused,   // region, input_number: of the command, detail. It is sent again unless it can never be taken
    kGrantNeeded,      // no known address has answered for 1.5 s: Client::Renew with another grant may lead back
    kRestored,         // the world goes on from an earlier moment: all bodies vanish, and appear as they were then
    kWorldPropertyChanged,  // property: WorldPropertyOf gives the new value
    // The own body was shown more than a centimetre elsewhere than it came to be. body, region, input_number: the
    // newest that had acted, other: the body that it touched, or 0, detail: how far, and why as far as is known.
    kPredictionCorrected,
    // The world moves the own body by a function of its game that this program does not have, or not in that version:
    // it is shown as the server has it. body, detail: which one, and which one is here.
    kMovementMissing,
    // The game has made what PredictSpawn showed: body, from now on, region, other: as it was called until then, detail
    // and off_m: how far the two were apart, which is blended away.
    kSpawnTaken,
    kSpawnLost,  // body: as PredictSpawn called it, which is gone: the game did not make it, or not in time; detail
    kTileCame,   // tile: TileAt has it from now on
    kTileGone,   // tile: the view has moved away from it; what it holds is there until the next Poll
  };
  static constexpr Kind kLastKind = Kind::kTileGone;
  Kind kind = Kind::kEnded;
  BodyId body{};
  BodyId other{};  // higher than `body`, where they are a pair
  RegionId region{};
  std::uint32_t input_number = 0;
  std::string detail{};
  std::string property{};                 // its name
  std::optional<MeetingPoint> contact{};  // nothing for a pair that met before this client came
  bool since_before =
      false;  // for a pair that begins: it touched or overlapped already when the region was connected to
  double off_m = 0;
  std::uint32_t tile = 0;  // its place in Tiles()
};

// How the world's time goes. A tick is as long in the world's own time at each pace, so fewer of them are slow motion.
struct WorldClock {
  bool paused = false;          // nothing moves, and inputs are not taken
  double ticks_per_second = 0;  // while it moves
  friend bool operator==(const WorldClock&, const WorldClock&) = default;
};

// An event that the game sent this player, with its values by name, ascending.
struct GameEvent {
  using Value = std::variant<bool, std::int64_t, double, std::string, Vec3d, BodyId, PlayerNumber>;
  std::string name;
  std::vector<std::pair<std::string, Value>> values{};
};

// The newest known state of a body.
struct SeenBody {
  BodyId id;
  RegionId region;  // its owner
  Epoch epoch;      // its ownership's
  Tick tick;        // time of `state`; older than the world's where nothing has changed since
  BodyState state;
  // PropertySet::Encode of the properties that differ from the scene's; null where none does.
  std::shared_ptr<const std::vector<std::uint8_t>> properties = nullptr;
  std::uint8_t jumps = 0;  // how often a game put it elsewhere; after 255 comes 0
  BodyTuning tuning = {};  // changes that a game made to its definition
};

// A body as it is to be drawn.
struct ShownBody {
  BodyId id;
  Pose pose;
  bool extrapolated = false;       // its newest state is older than the moment that is shown
  bool predicted = false;          // as it will be when the inputs already made act
  const SeenBody* seen = nullptr;  // as World() has it, until the next Poll; null: it does not
  // While PredictSpawn alone shows it; once World() has it they are 0.
  Vec3f velocity_m_s{}, spin_rad_s{};
};

// A player asks for this (core/world/player_input.h): all of it goes to the region, with every input.
struct Steering {
  Vec3f force_n, torque_nm;          // world frame
  Vec2f move;                        // x right, y forward, at most 1 long
  float yaw_rad = 0, pitch_rad = 0;  // yaw about +y, 0 along -z, to the left; pitch up
  std::uint32_t buttons = 0;
};

// A body that the game is to make, and that this client shows at once: what the player throws.
struct SpawnAsk {
  std::string_view prefab;  // one that has one body
  SpawnMotion motion{};     // as the game makes it
  bool from_own = false;    // the position counts from the own body's centre of mass
};

struct Session;

class Client {
 public:
  // Errors: NOT_FOUND "instance plaza-9: no such instance", UNAVAILABLE "control plane at ...", DEADLINE_EXCEEDED,
  // FAILED_PRECONDITION (it has ended, its scene has no player, or the returning player has left for good),
  // RESOURCE_EXHAUSTED (full), INVALID_ARGUMENT, UNAUTHENTICATED (the return token has expired or belongs elsewhere).
  static absl::StatusOr<std::unique_ptr<Client>> Join(const JoinOptions& options);
  // A grant for what Join would join, as a blob. Waits and fails as Join does. With `returning`, for that player: what
  // Renew takes. Of the options only those that say where and who count.
  static absl::StatusOr<std::vector<std::uint8_t>> GetGrant(const JoinOptions& options);
  // By a grant that the control plane made (net/join_grant.h): INVALID_ARGUMENT naming what is wrong with it,
  // UNAVAILABLE (no local socket). A viewer's grant makes a viewer. Does not wait; until the state is WAITING or
  // PLAYING the scene is an empty one.
  static absl::StatusOr<std::unique_ptr<Client>> JoinByGrant(std::span<const std::uint8_t> grant,
                                                             const GrantOptions& options);
  ~Client();  // without Leave: the body stays in the world
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  // A recording, as if it were played again now: the world and its events come by Poll as they came then, states of
  // motion included; there is nobody to move, and no token. Ends with the file. Errors: NOT_FOUND, INVALID_ARGUMENT
  // (not a recording), DATA_LOSS (damaged); each begins with the file's name.
  static absl::StatusOr<std::unique_ptr<Client>> Play(const std::string& file);

  // For a recording: the next Poll is at this time in it, as if its client had only just come to know that world.
  // That Poll tells first that all bodies known so far vanish. It plays on from a key at most some seconds before, so
  // it takes a moment in a large world. Later than its end: its end. FAILED_PRECONDITION for a client of a world.
  absl::Status Seek(std::chrono::microseconds at);
  // For a recording: how long it is.
  std::optional<std::chrono::microseconds> length() const;
  // Notes that stand beside the world (Note), since the last call; the newest 256 of those that nobody takes.
  std::vector<std::string> TakeNotes();

  // Goes on by another grant for the same player and instance: its addresses count beside those that are known, and are
  // dialled at once. For a client that says kGrantNeeded, or at any time before. Errors: INVALID_ARGUMENT naming the
  // field (damaged, another instance or player), FAILED_PRECONDITION (it has ended, or is a recording).
  absl::Status Renew(std::span<const std::uint8_t> grant);

  // Takes in what has come, sends what is due. Call at least 30 times a second.
  std::vector<ClientEvent> Poll(TimePoint now);
  ClientState state() const;
  // Why it ended: OK after Leave and when the instance ended in order; ABORTED with the game's own words when the game
  // refused or kicked the player; ALREADY_EXISTS when another process has joined as this player since. OK while it has
  // not.
  absl::Status reason() const;
  // Whether it ended because no address that it knows answers any more: another grant may lead to the world.
  bool needs_new_grant() const;

  PlayerNumber player() const;  // 0: a viewer
  BodyId own_body() const;      // that the inputs move: the player's, or one that the game gave; 0: a viewer has none
  // Makes its holder this player, until it leaves: to be kept where a later process of the game finds it. Secret. The
  // process that joins with it last plays; the others end.
  std::vector<std::uint8_t> return_token() const;
  // The static bodies of a large level are in tiles instead.
  const Scene& scene() const;
  // The tiles of a large level, which come as the view reaches them; null: all of the level is in scene(). A client by
  // a control plane has all of any level.
  const LevelIndex* Tiles() const;
  // Null: it is not here.
  std::shared_ptr<const Tile> TileAt(std::uint32_t tile) const;
  // From now on those tiles come that are within `radius_m` of `centre` on the ground, the nearest first, and go when
  // they are well beyond. Nothing for `centre`: about the own body, or where a spectator looks from; of a viewer the
  // middle of the world. 0: the radius of the scene's view, and all of the level where it has none, and for a viewer;
  // infinite: all. What prediction needs comes besides.
  void ViewTiles(std::optional<Vec3d> centre, double radius_m);
  // The definition of one of the scene's bodies or, the same for all, of a player's; null if the scene has no such
  // body, or it is in tiles that are not here. Of a body in several tiles: the part in one of them.
  const BodyDef* DefOf(BodyId body) const;
  const PartitionMap& map() const;
  // The newest tick in any region's snapshots.
  Tick tick() const;
  WorldClock clock() const;
  // Number of the last input that a region has applied to the own body.
  std::uint32_t last_applied_input() const;

  // All bodies, as new as they are known; ascending by id.
  const std::map<BodyId, SeenBody>& World() const;
  // A property that the scene declares: its owner's newest value; for a static body, and for one that is not in sight,
  // the scene's value. Nothing if the scene has no such body, or declares no such property.
  std::optional<PropertyValue> PropertyOf(BodyId body, std::string_view name) const;
  // The same of the world: one of the scene's instance_properties. Where the client may not see it, the scene's value.
  std::optional<PropertyValue> WorldPropertyOf(std::string_view name) const;
  // All bodies at one moment in the recent past, so far back that their states from before and after it are mostly
  // here: between them linearly, beyond the newest along its velocity for at most kMaxExtrapolation. With
  // JoinOptions::predict, the own body and what it touches are ahead of that. Ascending by id.
  std::vector<ShownBody> Interpolated(TimePoint now);
  static constexpr std::chrono::milliseconds kMaxExtrapolation{250};

  // Inputs ask for this from now on, until the next call of this or Move: each tick's worth is sent with the Polls that
  // follow. The scene decides how it moves the body: by a force, or, in a scene of characters, by move vector, look and
  // buttons. Values that are not finite count as 0, a longer move vector as one of length 1. Returns the number that
  // the next input will have.
  std::uint32_t Steer(const Steering& steering);
  // Force and torque on the own body, world frame, N and N m, from now until the next Move: each tick's worth is sent
  // with the Polls that follow. The scene limits it. Returns the number that the next input will have.
  std::uint32_t Move(Vec3f force_n, Vec3f torque_nm);
  // The same, once, for any body: regions refuse what is not the player's own, and say so by an event. For tools and
  // tests.
  std::uint32_t MoveBody(BodyId body, Vec3f force_n, Vec3f torque_nm);

  // How the world's game moves the own body (tessera/movement.h), so that it can be predicted; null: no more. What it
  // points to outlives the client. Errors: INVALID_ARGUMENT naming the field, or a kind that the scene does not have;
  // then there is none. Without JoinOptions::predict it is for nothing.
  absl::Status SetMovement(const tessera_movement* movement);

  // Asks something of the game: at most 1 KiB, in whatever form the game reads. It is sent until the game's region has
  // taken it for good: exactly once, and in the order of calls. Errors: INVALID_ARGUMENT, RESOURCE_EXHAUSTED (64 wait
  // already), FAILED_PRECONDITION (it has ended, or is a recording).
  absl::Status Send(std::string_view bytes);
  // The same, by a command for which the game makes a body with `predicted`: that body is shown at once, under the id
  // that is returned, simulated as the own body is. kSpawnTaken says under which id it goes on, kSpawnLost that it does
  // not. The game gets the command when the next input has acted. Errors, with which nothing is sent: those of Send,
  // NOT_FOUND naming the prefab, INVALID_ARGUMENT naming the field (`position` is at most 20 m from the own body),
  // RESOURCE_EXHAUSTED (kMaxPredictedSpawns are shown already), FAILED_PRECONDITION (nothing is predicted, or not yet,
  // or the world is paused).
  absl::StatusOr<BodyId> PredictSpawn(const SpawnAsk& ask, std::string_view command);
  static constexpr std::size_t kMaxPredictedSpawns = 16;
  // The events that the game sent this player since the last call, each once and in order.
  std::vector<GameEvent> TakeGameEvents();
  // Where the player looks from while its body is out of the world; nothing while it plays.
  std::optional<Vec3d> spectator_view() const;
  // The name of a player whose body is in sight; empty for others, and for those without one.
  std::string NameOf(PlayerNumber player) const;

  // Leaves at the control plane, which has the body removed, and ends. Waits up to `deadline`. By a grant it ends and
  // calls GrantOptions::leave; without that, whoever gave the grant lets the player go.
  absl::Status Leave(std::chrono::milliseconds deadline = std::chrono::milliseconds(2000));

  // Records the present state of the world, and from now on everything that comes from the regions, into a file of at
  // most `max_bytes`; a file of that name is replaced. If the recording cannot go on, an event says why. Errors:
  // UNAVAILABLE (cannot be written), FAILED_PRECONDITION (there is a recording under way, or the client has ended or is
  // a recording itself).
  absl::Status Record(const std::string& file, std::uint64_t max_bytes = kDefaultRecording_bytes);
  // A file that is not ended, by this or with the client, cannot be played. OK if there is no recording.
  absl::Status StopRecording();
  bool recording() const;
  std::uint64_t recorded_bytes() const;  // so far; 0 without a recording
  // Writes a text beside the world into the recording, as of the last Poll; nothing without a recording.
  // INVALID_ARGUMENT: longer than 1 MiB.
  absl::Status Note(std::string text);
  // Hours of a busy world.
  static constexpr std::uint64_t kDefaultRecording_bytes = std::uint64_t{1} << 30;

  ClientStats Stats() const;
  // Simulates this network from now on.
  void SimulateNetwork(const NetworkConditions& conditions);

 private:
  struct Impl;
  struct Settings;
  // Binds the local socket.
  static absl::StatusOr<std::unique_ptr<Client>> Begin(Settings settings, Session session);
  explicit Client(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::client

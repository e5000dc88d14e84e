// Predictor: the own body, and the bodies that it touches, as they will be when the inputs already made act.
//
// Snapshots show the world as it was, but a player's input must be visible at once. So the own body and the bodies near
// it are simulated here by the same physics on the same ground: from the server's newest state, through every input
// that it had not applied by then, one tick each. When a later state comes, they are simulated anew from it, and the
// difference is blended away. All other bodies are shown as they were (WorldView).
//
//   predictor.Prepare(own.state, budget);                  // once a poll: the ground about the own body, in goes
//   predictor.Correct(tick, last_input, world.bodies());   // the own body's region sent its state
//   predictor.Add(input);                                  // the player's, one a tick
//   for (const PredictedBody& body : predictor.At(now, phase)) ...
//
// Where the ground is not known yet, nothing is predicted; a poll or two after the own body was put elsewhere, and
// while a large scene is looked at for the first time. Exact (but for what the wire rounds) while inputs reach the
// server in time and nothing else meets the own body.
//
// It has some 60 methods because what is foreseen has one physics world: the own body, what it holds and what it threw
// meet in it, and are put back and stepped anew together. Thread rule: one thread at a time; time comes in.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_sdk/client.h"
#include "client_sdk/correction.h"
#include "client_sdk/ground.h"
#include "client_sdk/work_budget.h"
#include "core/game/joint.h"
#include "core/physics/world.h"
#include "core/region/catalog.h"
#include "core/region/movement.h"
#include "core/replication/input.h"
#include "core/replication/movement_news.h"
#include "core/world/player_limits.h"

namespace tessera::client {

// The maker in ids of bodies that only this client shows. No worker has this incarnation, so none gives such an id.
inline constexpr std::uint32_t kMadeHere = 0;

struct PredictedBody {
  BodyId id;
  Pose pose;
  double weight = 1;    // 0: as the server showed it, 1: as predicted; glides between where contacts begin and end
  bool thrown = false;  // here alone: the server's is still to come
  Vec3f velocity_m_s{}, spin_rad_s{};
};

// Tells what became of a body that was thrown.
struct ThrownNews {
  BodyId thrown{};   // its id here
  BodyId body{};     // the server's, which it is from now on; 0: it is gone, `why`
  double off_m = 0;  // how far the server's was from it, at the same predicted tick
  const char* why = "";
};

class Predictor {
 public:
  // Ticks simulated anew at most: beyond a fifth of a second the own body is shown that much late instead.
  static constexpr std::size_t kMaxTicks = 12;
  // In which a body that was thrown, and is the server's, goes back to the time of all others: so slowly that it is not
  // seen to brake. So many do at most, beyond them at once.
  static constexpr double kLetGo_s = 1.5;
  static constexpr std::size_t kMaxLetGo = 24;

  // `index`: the tiles of the level; null: all of it is in the scene.
  Predictor(const std::shared_ptr<const Scene>& scene, PlayerNumber player,
            std::shared_ptr<const LevelIndex> index = nullptr);

  // Whether it could be the own body: the player's, or one of the scene that moves.
  bool Knows(BodyId id) const { return IsPlayerBody(id) ? id == player_def_.id : catalog_.Known(id); }
  // The inputs move this body from now on, within these limits. Requires Knows(own).
  void Follow(BodyId own, const PlayerLimits& limits);
  // The joints of the game about that body: what they hold is simulated along as far as it is in sight, and shown
  // ahead.
  void Connect(const std::vector<game::JointOfBody>& joints);
  // The program's own function of a movement that a game wrote; null: it has none. Its own body is predicted by it
  // where the region says that it is moved by it. INVALID_ARGUMENT where the scene has no such kind; then there is
  // none.
  absl::Status SetMovement(const tessera_movement* table);
  // The own body's region says by which movement of its game it moves the body, and with which private state. Where the
  // program does not have that one, nothing is predicted.
  void TakeMovement(const replication::MovementNews& news);
  // Why not, once for each movement that the program does not have; empty: nothing new.
  std::string TakeMissingMovement() { return std::exchange(missing_, {}); }
  // A tile has come, or goes.
  void AddTile(std::uint32_t number, std::shared_ptr<const Tile> tile) { ground_.AddTile(number, std::move(tile)); }
  void DropTile(std::uint32_t number) { ground_.DropTile(number); }
  // Goes on with building the ground about the own body, which is in this state.
  void Prepare(const BodyState& own, WorkBudget& budget);
  // `bodies` holds the own body's state at `tick`, after the input `last_input`. An older state is ignored.
  // Without ground there the prediction pauses.
  void Correct(Tick tick, std::uint32_t last_input, const std::map<BodyId, SeenBody>& bodies);
  // An input for the own body; numbers ascend.
  void Add(const PlayerInput& input);
  // The own body and what it touches, ascending; `phase`: share of a tick since the newest input.
  std::vector<PredictedBody> At(TimePoint now, double phase);
  void Forget();  // the own body is gone

  // --- What the player throws (predictor_thrown.cpp): there at once, and simulated with the own body until the body is
  // among the server's that the game makes for it by command `command`, or `until` has come.

  // It is there when `input`, the next one, is simulated. Requires running(), and a prefab of one body.
  BodyId Throw(const SpawnAsk& ask, std::size_t prefab, SpawnClaim claim, std::uint32_t input, TimePoint until);
  std::size_t thrown() const { return thrown_.size(); }
  // Once a poll. While the world is paused, nothing is waited for.
  void ExpireThrown(TimePoint now, bool paused);
  // Nothing is simulated any more, so nothing can be shown.
  void DropThrown();
  // Whether the server has a body that takes the place of one that is still shown here.
  bool Awaits(const BodyTuning& tuning) const;
  // Whether bodies are shown ahead that inputs have to move on, be there a reason for them or not.
  bool NeedsInputs() const;
  std::vector<ThrownNews> TakeThrown() { return std::exchange(thrown_news_, {}); }

  const Ground& ground() const { return ground_; }
  bool running() const { return base_tick_.has_value(); }
  // The tick of the newest predicted state.
  Tick tick() const;
  const BodyState& own() const { return own_now_; }
  // The private state of its movement there; none unless a game's function moves it.
  const MovementState& own_movement() const { return movement_now_; }
  std::uint64_t corrections() const { return corrections_; }       // those of more than kNotable_m
  double last_correction_m() const { return last_correction_m_; }  // how far the own body was off
  static constexpr double kNotable_m = 0.01;
  // Those since the last call, with their causes; the oldest 64.
  std::vector<Correction> TakeCorrections() { return std::exchange(untaken_, {}); }

 private:
  struct Body {
    BodyState before, now;  // at the tick before the newest, and at the newest
    Vec3d offset;           // the difference that is being blended away
    Quatd turn;
    double weight = 0;
    bool touched = false;  // by the own body, itself or through others, in the last simulation
    bool ahead = false;    // the same, or by one that was thrown: it is shown as predicted
    bool thrown = false;   // it was, and is shown as predicted still
    Tick taken{};          // when the server's took its place; 0: it has not, or is one of all others by now
  };
  // One that the server has not sent yet.
  struct Thrown {
    BodyDef def;  // with its id here
    SpawnMotion motion;
    bool from_own = false;
    SpawnClaim claim;
    std::uint32_t input = 0;  // it is there when this one has acted
    TimePoint until;
    // Its states as simulated last, ascending: at the end of a tick, after an input.
    struct At {
      Tick tick;
      std::uint32_t input = 0;
      BodyState state;
    };
    std::vector<At> path;
    bool made = false;  // the server has made it by the base, as far as can be known
  };

  void Begin(Vec3d near);
  void Pause();
  double GroundReach(const BodyState& own) const;
  bool HasGround(const BodyState& own);
  void AddAnchor(BodyId id);
  void Choose(const std::map<BodyId, SeenBody>& bodies);
  void Place(Tick tick, const std::map<BodyId, SeenBody>& bodies);
  void Simulate();
  void Step(const PlayerInput& input);
  const GameMovement* MovementInForce() const;
  bool LacksMovement() const;
  MovementState MovementAt(Tick tick, std::uint32_t last_input) const;
  physics::CharacterDrive DriveOf(BodyId id, const Body& body, const PlayerInput& input);
  physics::CharacterDrive DriveOfOther(BodyId id, const Body& body) const;
  void FollowPaths(Tick tick);
  void Tune(const BodyDef& def, const SeenBody& seen);
  void NoteTouched();
  void Spread(bool Body::*mark);
  bool SpreadOverJoints(bool Body::*mark);
  void PlaceJoints();
  const Thrown* FindThrown(BodyId id) const;
  BodyState MadeBy(const Thrown& thrown) const;
  void TakeOver(const std::map<BodyId, SeenBody>& bodies, std::map<BodyId, Pose>& shown);
  void PlaceThrown(Thrown& thrown);
  void NoteThrown(std::uint32_t input);
  void LetGo(Tick tick);
  void Unthrow(const Thrown& thrown);
  struct Centre {
    BodyState state;
    double radius_m = 0;
  };
  std::vector<Centre> Centres(const std::map<BodyId, SeenBody>& bodies) const;
  Pose Raw(const Body& body) const;
  const BodyDef* DefOf(BodyId id) const;
  BodyId Met() const;
  void NoteCorrection(Correction correction, BodyId met);
  bool IsOwn(const physics::Contact& contact) const {
    return contact.body_a == own_def_.id || contact.body_b == own_def_.id;
  }

  region::Catalog catalog_;
  BodyDef player_def_;  // defines the player's own body
  BodyDef own_def_;     // defines the body that the inputs move
  PlayerLimits limits_;
  std::vector<JointDef> joints_;  // the game's, about the own body
  Ground ground_;
  double tick_s_;
  std::unique_ptr<physics::World> world_;
  Vec3d origin_;
  double own_radius_m_ = 0;
  std::map<BodyId, Body> bodies_;         // in the world, but for static ones; ascending
  std::map<BodyId, Body> on_paths_;       // static ones with paths; without offsets
  std::map<BodyId, std::uint8_t> jumps_;  // jumps of bodies_, as the server counted them last
  std::vector<const BodyDef*> paths_;
  std::deque<PlayerInput> inputs_;  // not applied at the base
  std::size_t simulated_ = 0;       // so many of them have been simulated
  std::optional<Tick> base_tick_;
  BodyState own_now_;
  std::optional<GameMovement> movement_;               // the program's
  std::optional<replication::MovementNews> moved_by_;  // the newest news of the own body
  std::string missing_, known_missing_;
  // The private state that its movement left: at the newest predicted state, and after each input that has been
  // simulated.
  MovementState movement_now_;
  std::map<std::uint32_t, MovementState> movement_after_;
  double phase_ = 1;
  std::optional<TimePoint> shown_at_;
  std::uint64_t corrections_ = 0;
  double last_correction_m_ = 0;
  std::vector<Correction> untaken_;
  std::vector<Thrown> thrown_;
  std::uint32_t throws_ = 0;
  std::vector<ThrownNews> thrown_news_;
  std::optional<TimePoint> polled_at_;
  // The own body's region and the newest input, at the base.
  RegionId base_region_;
  std::uint32_t base_input_ = 0;
};

}  // namespace tessera::client

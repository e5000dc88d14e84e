// WorkerCore: what a worker decides. The life of one worker process: LOADING -> BOUND -> LINKED -> RUNNING -> STOPPING,
// by the orders of its agent.
//
// Pure: no socket, file, thread or clock. Events come in with the time, what is to be done goes out as actions, which
// the shell carries out and answers in order before it passes the next event. It compares what it is with the newest
// order and does the difference; what an order leaves open it waits for.
//
//   WorkerCore core({identity, pid, address});
//   core.TakeOrder(order, now);                         CarryOut(core.TakeActions());   // RequestScene -> SceneLoaded
//   core.Receive(from, message, now);                   CarryOut(core.TakeActions());
//   while (core.Advance(now)) { core.Step(now);         CarryOut(core.TakeActions());   core.StepEnded(end, work); }
//
// It has some 60 methods: one for each event and answer that may come in, one for each transition of its life. What a
// running region does is RegionRun's and its parts', which hold no phase.
//
// The simulator runs this very class (tests/simulation). Thread rule: one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/game/game_host.h"
#include "core/world/scene.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/admission.h"
#include "region_worker/core/checkpoint_follower.h"
#include "region_worker/core/identity.h"
#include "region_worker/core/link_message.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/order.h"
#include "region_worker/core/region_run.h"
#include "region_worker/core/report.h"

namespace tessera::worker {

// A worker without an agent.
struct StandaloneRules {
  std::uint32_t players = 0;        // wait for so many before the start
  std::optional<Duration> runtime;  // then run so long; absent: until it is stopped
  // A player that came by itself, as an order would name it.
  std::function<OrderedPlayer(PlayerNumber)> make_player;
};

struct WorkerSetup {
  Identity identity;
  std::int64_t pid = 0;
  v1::RegionAddress address;       // where its ports are
  region::RegionSettings borders;  // where orders leave them open
  std::optional<StandaloneRules> standalone;
  // A game that is no Lua file, in the place of an order's: its functions, which are there as long as the process, and
  // its name. Null: none.
  const tessera_game_module* game_module = nullptr;
  std::string game_module_name{};
  // How players' inputs move bodies where an order's game is a Lua file; it is there as long as the process. Null: as
  // the scene says.
  const tessera_movement* movement = nullptr;
  net::VerificationKey key{};  // this process' own, to be certified
};

class WorkerCore {
 public:
  explicit WorkerCore(WorkerSetup setup) : setup_(std::move(setup)), links_(setup_.identity.region) {}

  // --- Orders.
  void TakeOrder(const v1::WorkerOrder& order, TimePoint now);
  // Instead of an agent's orders.
  void StartStandalone(Order order, std::shared_ptr<const Scene> scene, TimePoint now);
  void TakeLease(const v1::LeaseRenewal& renewal);

  // --- Answers to actions.
  void SceneLoaded(absl::StatusOr<std::shared_ptr<const Scene>> scene, TimePoint now);
  // The file, as it is; the game in it is loaded before the region begins, and one that does not load is a failure. Of
  // a game that is to take its place, which comes while the region runs, a report says why.
  void GameLoaded(const absl::StatusOr<std::string>& bytes, TimePoint now);
  // The functions of the native game, which are there as long as the process; or why it cannot run here.
  void ModuleLoaded(const absl::StatusOr<const tessera_game_module*>& module, TimePoint now);
  // The movement beside the game's file, which is there as long as the process; or why it cannot move anybody here.
  void MovementLoaded(const absl::StatusOr<const tessera_movement*>& movement, TimePoint now);
  void StateLoaded(const absl::StatusOr<region::Bytes>& state, TimePoint now);
  void CheckpointWritten(Tick tick, const absl::Status& status) { checkpoints_.Written(tick, status, actions_); }

  // --- Other regions. Whom to dial and let in: links().
  void LinkUp(RegionId region, Incarnation incarnation, TimePoint now);
  void LinkDown(RegionId region) { links_.Down(region); }
  void Receive(RegionId from, const LinkMessage& message, TimePoint now);

  // --- Clients.
  Admission Admit(PlayerNumber player, net::Generation generation);
  // Queues a player's input. FAILED_PRECONDITION before the world is built; else as Region::QueueInput.
  absl::Status TakeInput(const PlayerInput& input);
  // As Region::TakeCommand and AcknowledgeEvents.
  absl::Status TakeCommand(PlayerNumber player, const region::PlayerCommand& command);
  void AcknowledgeEvents(PlayerNumber player, std::uint32_t event);
  // Why the game ended the session of a player that has left; empty: it did not.
  std::string EndedBecause(PlayerNumber player) const;
  // Those that are connected now, ascending.
  void SetConnected(std::vector<PlayerNumber> players) { connected_ = std::move(players); }

  // --- Time. True: the next tick is to be stepped, by Step and then StepEnded.
  bool Advance(TimePoint now);
  void Step(TimePoint now, const region::PhaseObserver& observer = {});
  // `work`: the time that the tick took, without waiting.
  void StepEnded(TimePoint end, Duration work);
  // When the next tick is due; nullopt while only an event can change anything.
  std::optional<TimePoint> wake_at(TimePoint now) const { return run_ ? run_->wake_at(now) : std::nullopt; }

  // --- The end. The last report is among the actions of the next Advance.
  void Stop(std::string reason);
  void StopHere(std::string reason);  // this worker alone
  void Fail(const absl::Status& status);
  bool stopping() const { return phase_ == v1::WORKER_PHASE_STOPPING; }
  const std::string& stop_reason() const { return stop_reason_; }
  // Whether this worker alone ends, and the world need not.
  bool goes_on() const { return goes_on_; }
  const std::string& failure() const { return failure_; }  // empty: it stops in order

  // In order; valid until the next call.
  Actions& TakeActions();

  v1::WorkerPhase phase() const { return phase_; }
  const Identity& identity() const { return setup_.identity; }
  const v1::RegionAddress& address() const { return setup_.address; }
  const Order& order() const { return order_; }
  const std::shared_ptr<const Scene>& scene() const { return scene_; }
  const LinkTable& links() const { return links_; }
  const RegionRun* run() const { return run_ ? &*run_ : nullptr; }  // null before the world is built

 private:
  bool CanLoad() const;
  bool CanOpen() const;
  void Load();
  absl::Status Build();
  absl::StatusOr<region::Config> MakeConfig() const;
  absl::StatusOr<std::shared_ptr<game::GameHost>> MakeGame(std::uint32_t number) const;
  absl::StatusOr<std::shared_ptr<game::GameHost>> LoadNext(const absl::StatusOr<std::string>& bytes) const;
  void FollowNextGame();
  bool MustRebuild() const;
  void Progress(TimePoint now);
  bool StartIsDue() const;
  void FollowOrder(TimePoint now);
  void FollowMaps();
  v1::RegionMap ClientMap() const;
  void ReportInventory(TimePoint now);
  void KeepLease(TimePoint now);
  void RemoveEnded();
  void Settle(TimePoint now);
  ReportedState State() const;
  void Report(TimePoint now);

  WorkerSetup setup_;
  LinkTable links_;
  std::shared_ptr<const Scene> scene_;
  std::optional<game::GameFile> game_;  // checked
  // The game that is to take its place, as far as it is known.
  struct NextGame {
    std::string hash, failure;
    bool asked = false;  // for its file
    bool known = false;  // whether it can run here
  };
  NextGame next_game_;
  std::shared_ptr<const region::RegionState> initial_;  // as the order names it
  bool loading_ = false;                                // a file is asked for
  std::optional<RegionRun> run_;
  Order order_;
  v1::WorkerPhase phase_ = v1::WORKER_PHASE_LOADING;
  TimePoint running_since_{};
  CheckpointFollower checkpoints_;
  std::vector<PlayerNumber> connected_;
  bool inventory_sent_ = false;
  ReportGate report_gate_;
  std::string stop_reason_, failure_;
  bool goes_on_ = false;
  Actions actions_, taken_;
};

}  // namespace tessera::worker

// Actions: everything that a worker's decisions ask of the world outside.
//
// The shell carries them out in order, before it passes the next event; those that have an answer name it.
// Thread rule: plain values.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/region/region.h"
#include "core/world/ids.h"
#include "region_worker/core/order.h"
#include "region_worker/core/world_clock.h"
#include "tessera/v1/game.pb.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

// --- To other regions ------------------------------------------------------------------------------------------------

// Reliably and in order; lost when there is no link.
struct SendMessage {
  RegionId to;
  std::shared_ptr<const region::Bytes> message;
};
// Messages so far may leave together now.
struct FlushLinks {};
struct CutLink {
  RegionId region;
  std::string why;
};

// --- Files -----------------------------------------------------------------------------------------------------------

struct RequestScene {  // answered by SceneLoaded
  std::string path, hash;
};
struct RequestGame {  // answered by GameLoaded
  std::string path, hash;
};
struct RequestModule {  // answered by ModuleLoaded
  std::string path, name, hash;
};
struct RequestMovement {  // answered by MovementLoaded
  std::string path, name, hash;
};
struct RequestState {  // answered by StateLoaded
  std::string path;
};
struct WriteCheckpoint {  // answered, some time, by CheckpointWritten
  Tick tick;
  std::string path;
  region::Bytes state;
};

// --- Clients ---------------------------------------------------------------------------------------------------------

// From now on regions and clients are let in, by these keys.
struct OpenPorts {
  Certified certified;
  std::uint64_t rules = 0;  // by which partners must compute too
  std::uint32_t snapshot_rate_hz = 0;
  v1::RegionMap map;
};
// The map in force, and where the regions' game ports are.
struct PublishMap {
  v1::RegionMap map;
};
// Ticks begin.
struct PublishStart {
  Tick tick;
};
// The world pauses, goes on, or goes at another pace.
struct PublishClock {
  ClockState clock;
  Tick tick;
};
// A step was made; the region is as that left it. The result's frames and log have been taken out.
struct PublishStep {
  region::StepResult result;
};
// The player has left: its connection ends.
struct ExpelPlayer {
  PlayerNumber player;
  std::string ended_because{};  // the game's reason; empty: it left by itself
};
// Another process has joined as the player: connections of a lower generation end.
struct ReplacePlayer {
  PlayerNumber player;
  net::Generation generation;
};

// --- The agent -------------------------------------------------------------------------------------------------------

struct SendReport {
  v1::WorkerReport report;
};
// Empty: the last one is settled.
struct SendInventory {
  std::optional<v1::InventoryReport> inventory;
};
struct AskForLease {  // answered, perhaps, by TakeLease
  v1::LeaseRequest request;
};
// The line to the agent ends, and the next one begins with a whole order.
struct AskWholeOrder {};

// --- The process -----------------------------------------------------------------------------------------------------

// Stepping on time goes before what can wait.
struct RaisePriority {};
enum class Severity : std::uint8_t { kInfo, kWarning, kError };
struct Log {
  Severity severity = Severity::kInfo;
  std::string line;
};
// One line on stderr.
struct PrintFailure {
  std::string reason;
};

using Action = std::variant<SendMessage, FlushLinks, CutLink, RequestScene, RequestGame, RequestModule, RequestMovement,
                            RequestState, WriteCheckpoint, OpenPorts, PublishMap, PublishStart, PublishClock,
                            PublishStep, ExpelPlayer, ReplacePlayer, SendReport, SendInventory, AskForLease,
                            RaisePriority, AskWholeOrder, Log, PrintFailure>;
using Actions = std::vector<Action>;

inline void LogInfo(Actions& actions, std::string line) { actions.emplace_back(Log{Severity::kInfo, std::move(line)}); }
inline void LogWarning(Actions& actions, std::string line) {
  actions.emplace_back(Log{Severity::kWarning, std::move(line)});
}
inline void LogError(Actions& actions, std::string line) {
  actions.emplace_back(Log{Severity::kError, std::move(line)});
}

}  // namespace tessera::worker

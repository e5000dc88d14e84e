// Life: the state machine of one instance. Pure: facts in, the next step out.
//
// PENDING -> PLACING -> STARTING -> WAITING_FOR_PLAYERS -> RUNNING -> STOPPING -> ENDED, or FAILED with a reason.
// Repeating `NextStep` with the same facts changes nothing more, so it is safe to ask after every event and after a
// restart. DEGRADED is not here: it is RUNNING with something that is not as it should be (Instances::NoteHealth), and
// passes by itself. Once an instance is RUNNING, Failovers deals with workers that die (cluster/failovers.h).
#pragma once

#include <string>
#include <vector>

#include "tessera/v1/instance.pb.h"

namespace tessera::control {

// The facts about one region's worker.
struct WorkerFacts {
  std::uint32_t region = 0;
  v1::WorkerPhase phase = v1::WORKER_PHASE_UNSPECIFIED;
  bool host_lost = false;
  std::string host_name;
  bool gone = false;   // has ended, or its host is lost and it is no longer wanted
  std::string ending;  // why it is gone, without its being asked to; empty otherwise
};

struct LifeFacts {
  std::vector<WorkerFacts> workers;  // by region, ascending
  bool players_ready = false;        // all expected players wait (PENDING) or are connected to all regions (WAITING)
  bool start_deadline_passed = false;
  bool start_timed_out = false;  // PLACING or STARTING has taken too long
};

struct LifeStep {
  v1::InstanceState state = v1::INSTANCE_STATE_UNSPECIFIED;
  bool run = false;    // the start goes out, or has gone out
  std::string reason;  // why it is FAILED
};

LifeStep NextStep(v1::InstanceState state, bool run, const LifeFacts& facts);

// True in the states in which workers are to run.
bool WantsWorkers(v1::InstanceState state);
// True in the states before the first tick.
bool IsStarting(v1::InstanceState state);
// True in the states after which nothing comes.
bool IsFinal(v1::InstanceState state);
// "RUNNING"
std::string NameOf(v1::InstanceState state);

// Why a RUNNING instance is degraded by its hosts and workers: "host alpha is silent: regions 1, 2"; empty in good
// health. A worker that has ended is one while nobody carries its region on.
std::string DegradedReason(const std::vector<WorkerFacts>& workers);

}  // namespace tessera::control

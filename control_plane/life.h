// Life: the state machine of one instance. Pure: facts in, the next step out.
//
// PENDING -> PLACING -> STARTING -> WAITING_FOR_PLAYERS -> RUNNING -> STOPPING -> ENDED, or FAILED with a reason.
// Repeating `NextStep` with the same facts changes nothing more, so it is safe to ask after every event and after a
// restart. DEGRADED is not here: it is RUNNING with a host that is silent or a failover under way, and passes by
// itself. Once RUNNING, workers that die are failover's business (failover.h).
#pragma once

#include <string>
#include <vector>

#include "tessera/v1/instance.pb.h"

namespace tessera::control {

// What is known about one region's worker.
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
  std::string reason;  // of FAILED
};

LifeStep NextStep(v1::InstanceState state, bool run, const LifeFacts& facts);

// States in which workers are wanted; in which they are still to be ended in order; after which nothing comes.
bool WantsWorkers(v1::InstanceState state);
bool IsFinal(v1::InstanceState state);

// "host alpha is silent: regions 1, 2" of a RUNNING instance; empty in good health.
std::string DegradedReason(const LifeFacts& facts);

}  // namespace tessera::control

// GoFirst: a thread that must step on time goes before what can wait.
//
// A worker asks for it when it begins to step, not before: while it starts, loads the scene and dials its neighbours,
// it yields to those that step. Threads that the caller makes later do not go first. A host that does not allow it (the
// worker needs CAP_SYS_NICE, or RLIMIT_NICE of 20 - kFirst) gets a worker that steps all the same, only later when
// others want the processors.
//
//   if (absl::Status status = GoFirst(); !status.ok()) spdlog::info(...);
//
// Thread rule: acts on the calling thread; where the process leads a session of its own, on that session's share too.
#pragma once

#include "absl/status/status.h"

namespace tessera::worker {

// As nice(2) counts: about three times the share of a process that asks for nothing. With more, players and tests on
// the same machine starve when it is short of processors.
constexpr int kFirst = -5;

// PERMISSION_DENIED where the host does not allow it; then nothing has changed.
absl::Status GoFirst();

}  // namespace tessera::worker

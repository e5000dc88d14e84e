// Bounds of a worker's report and of an agent's message: honest ones stay within them. A host is believed about
// its own workers, but not that there are sixteen million players in one, nor that it has a million workers. Pure.
#pragma once

#include "absl/status/status.h"
#include "tessera/v1/agent_link.pb.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// INVALID_ARGUMENT "report.connected_players: has 16000000 entries, at most 10000".
absl::Status CheckReport(const v1::WorkerReport& report);
// Checks the message around the reports: INVALID_ARGUMENT "heartbeat.workers: has 2001 entries, at most 2000". A report
// that is wrong in itself is its worker's fault, and not looked into here.
absl::Status CheckMessage(const v1::AgentMessage& message);
absl::Status CheckNamedWorkers(const char* message,
                               const google::protobuf::RepeatedPtrField<v1::WorkerReport>& workers);
// INVALID_ARGUMENT "hello.game_modules.hash: must be 64 hexadecimal digits". `message` begins the name of the field.
absl::Status CheckModules(const char* message, const v1::GameModuleList& list);

}  // namespace tessera::control

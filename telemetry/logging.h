// Logging: one line an event, on stderr, the same form in every process:
//
//   2025-03-01T12:00:00.123Z info region: handover out body=17 to=2
//   time (UTC), level, component: what happened, then key=value
//
//   if (absl::Status status = InitLogging("region", flags.log_level); !status.ok()) return Usage(status);
//   spdlog::info("worker exited pid={} last_line={}", pid, LogValue(line));
//
// Where the journal reads stderr, a line begins with its syslog priority, "<4>", which the journal takes off again:
// `journalctl -p warning` finds what to look at.
//
// Text from outside goes through `LogValue`, so that it cannot forge a line or a key. Tokens and keys are never logged.
// Thread rule: `InitLogging` once, before threads start; spdlog's functions from any thread.
#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "telemetry/log_value.h"

namespace tessera::telemetry {

inline constexpr char kLogEnvironment[] = "TESSERA_LOG";

// Sets spdlog's default logger. The level is `flag` if it is not empty, else the environment's TESSERA_LOG, else
// "info"; one of trace, debug, info, warning, error, off. An unknown level is kInvalidArgument and names where it came
// from.
//
// Where stderr is the file that the environment's TESSERA_LOG_FILE names, as for processes that host::Process started,
// the file is rotated when it has grown large (host/log_rotation.h): stderr, and stdout where it is the same file, go
// on into a new one.
absl::Status InitLogging(const std::string& component, std::string_view flag = {});

}  // namespace tessera::telemetry

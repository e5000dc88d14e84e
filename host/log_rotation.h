// Log rotation: a log file that has grown large makes room for a new one, and the eldest goes.
//
//   worker.log  ->  worker.log.1  ->  worker.log.2  ->  worker.log.3  ->  removed
//
// Whoever has the file open writes on into the one that was renamed, until it opens `path` again (telemetry/logging.h).
// Thread rule: any thread; one caller at a time for each path.
#pragma once

#include <cstdint>
#include <string>

namespace tessera::host {

// A day of ten lines a second of each kind that strangers cause is some 150 MB; so much is the last hour or two of it,
// and weeks of a quiet worker. A host with eight workers keeps at most 256 MB.
inline constexpr std::uint64_t kMaxLogBytes = std::uint64_t{8} << 20;
inline constexpr int kEarlierLogs = 3;

// Names its log file to a process that Process::Spawn starts, so that it can rotate it.
inline constexpr char kLogFileEnvironment[] = "TESSERA_LOG_FILE";

// "worker.log.1": the newest but the current one.
std::string EarlierLog(const std::string& path, int number);
// Whether `path` is an earlier log of `current`.
bool IsEarlierLogOf(const std::string& path, const std::string& current);
// Where the file at `path` has kMaxLogBytes. A failure leaves the log as it is, and it grows on. True: renamed.
bool RotateLogIfLarge(const std::string& path);

}  // namespace tessera::host

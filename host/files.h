// Files read and written whole, for programs that must survive what others put there and what a crash leaves.
//
//   absl::StatusOr<std::string> text = ReadFile("/var/lib/tessera/agent/host.json", kMaxStateBytes);
//   absl::Status status = WriteFile(path, json, Durability::kSurvivesMachine);
//
// Every error names the file. Thread rule: any thread; two that write one file at once leave the content of one.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace tessera::host {

// The content of a file that may be of any kind, one of /proc included. NOT_FOUND if it does not exist,
// RESOURCE_EXHAUSTED if it holds more than `max_bytes`, UNAVAILABLE if it cannot be read.
absl::StatusOr<std::string> ReadFile(const std::string& path, std::size_t max_bytes);

enum class Durability {
  kSurvivesProcess,  // written once the call returns, but lost with the power
  kSurvivesMachine,  // on the disk once the call returns
};

// Replaces the file at `path` by one with this content that only this user can read (mode 0600). Whoever opens `path`
// finds the old content or the new one, never a part. UNAVAILABLE if it cannot be written; then the old one is there.
absl::Status WriteFile(const std::string& path, std::string_view content, Durability durability);

// Makes the folder and those above it where they do not exist. Only this user can look into a folder that it made.
absl::Status MakePrivateFolder(const std::string& path);

// Returns once the names in this folder, such as one that a file was renamed to, are on the disk.
absl::Status SyncFolder(const std::string& path);

}  // namespace tessera::host

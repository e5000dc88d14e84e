// Checkpoints as files: out of one control plane, into another.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

class Connection;

// Writes a checkpoint of the instance to `path`, which appears whole or not at all. `tick` 0: the newest that is whole.
// CommandError.
void ExportCheckpoint(Connection& connection, const std::string& id, std::uint64_t tick, const std::string& path,
                      std::chrono::milliseconds timeout);

struct ImportOptions {
  std::string request_id = {};  // the same again gives the same instance
  bool validate_only = false;
  std::chrono::milliseconds timeout{60'000};
};
// A new instance out of such a file. CommandError.
v1::Instance ImportCheckpoint(Connection& connection, const std::string& path, const ImportOptions& options);

}  // namespace tessera::local

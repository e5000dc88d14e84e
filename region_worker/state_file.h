// State files: what a region was right after one tick, as checkpoints keep it.
//
//   absl::StatusOr<region::RegionState> state = LoadStateFile(path, hash, catalog);
//   StateWriter writer;                       // for one file at a time
//   writer.Begin(tick, path, region.SaveState());
//   if (auto done = writer.Take()) ...
//
// Writing waits for the disk, so a thread of the writer's own does it. Thread rule: one thread calls.
#pragma once

#include <future>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/region/catalog.h"
#include "core/region/log.h"

namespace tessera::worker {

// Errors: NOT_FOUND, DATA_LOSS and INVALID_ARGUMENT, naming the file. `hash`: SHA-256, hexadecimal; empty: not
// compared.
absl::StatusOr<region::RegionState> LoadStateFile(const std::string& path, const std::string& hash,
                                                  const region::Catalog& catalog);

// A whole file or none: written under another name, synced, renamed.
absl::Status WriteStateFile(const std::string& path, const region::Bytes& bytes);

class StateWriter {
 public:
  struct Written {
    Tick tick;
    absl::Status status;
  };

  bool busy() const { return writing_.valid(); }
  // Requires !busy().
  void Begin(Tick tick, std::string path, region::Bytes bytes);
  std::optional<Written> Take();  // once it is done

 private:
  std::future<Written> writing_;
};

}  // namespace tessera::worker

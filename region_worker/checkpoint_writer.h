// CheckpointWriter: writes a region's state to a file, on a thread of its own, because that waits for the disk.
//
//   CheckpointWriter writer;                  // for one file at a time
//   writer.Begin(tick, path, state);
//   if (auto written = writer.Take()) ...
//
// Thread rule: one thread calls.
#pragma once

#include <future>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "core/region/region.h"
#include "core/world/ids.h"

namespace tessera::worker {

class CheckpointWriter {
 public:
  struct Written {
    Tick tick;
    absl::Status status;
  };

  // Requires that none is being written. The file is whole or there is none: it is written under another name, synced
  // and renamed.
  void Begin(Tick tick, std::string path, region::Bytes state);
  std::optional<Written> Take();  // once it is done

 private:
  std::future<Written> writing_;
};

}  // namespace tessera::worker

#include "region_worker/checkpoint_writer.h"

#include <chrono>
#include <utility>

#include "core/world/byte_view.h"
#include "host/files.h"

namespace tessera::worker {

void CheckpointWriter::Begin(Tick tick, std::string path, region::Bytes state) {
  writing_ = std::async(std::launch::async, [tick, path = std::move(path), state = std::move(state)] {
    return Written{tick, host::WriteFile(path, AsText(state), host::Durability::kSurvivesMachine)};
  });
}

std::optional<CheckpointWriter::Written> CheckpointWriter::Take() {
  if (!writing_.valid() || writing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  return writing_.get();
}

}  // namespace tessera::worker

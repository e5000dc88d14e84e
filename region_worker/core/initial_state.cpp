#include "region_worker/core/initial_state.h"

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "core/world/sha256.h"

namespace tessera::worker {

absl::StatusOr<region::RegionState> ReadInitialState(const StateFile& file, std::span<const std::uint8_t> bytes,
                                                     const region::Catalog& catalog) {
  if (!file.hash.empty() && Sha256Hex(AsText(bytes)) != absl::AsciiStrToLower(file.hash)) {
    return absl::DataLossError(absl::StrCat(file.path, ": its hash is not the order's"));
  }
  absl::StatusOr<region::RegionState> state = region::DecodeState(bytes, catalog);
  if (!state.ok()) return absl::Status(state.status().code(), absl::StrCat(file.path, ": ", state.status().message()));
  if (state->tick != file.tick) {
    return absl::DataLossError(absl::StrCat(file.path, ": it is of tick ", state->tick.value()));
  }
  return state;
}

}  // namespace tessera::worker

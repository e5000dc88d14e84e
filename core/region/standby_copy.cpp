#include "core/region/standby_copy.h"

#include "absl/strings/str_cat.h"

namespace tessera::region {

absl::Status StandbyCopy::Receive(std::span<const std::uint8_t> message) {
  const absl::StatusOr<LogHeader> header = DecodeLogHeader(message);
  if (!header.ok()) return header.status();
  if (header->region != state_.region) {
    return absl::PermissionDeniedError(
        absl::StrCat("a log of region ", header->region.value(), ", here it is ", state_.region.value()));
  }
  if (header->incarnation < state_.incarnation) return absl::PermissionDeniedError("a log of a life that has ended");
  const bool same_life = whole_ && header->incarnation == state_.incarnation;
  if (same_life && header->tick <= state_.tick) return absl::OkStatus();
  if (!header->whole) {
    if (!same_life) return absl::FailedPreconditionError("changes before a whole state");
    return ApplyChanges(message, *catalog_, state_);
  }
  absl::StatusOr<RegionState> state = DecodeState(message, *catalog_);
  if (!state.ok()) return state.status();
  state_ = *std::move(state);
  whole_ = true;
  return absl::OkStatus();
}

}  // namespace tessera::region

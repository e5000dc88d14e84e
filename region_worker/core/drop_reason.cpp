#include "region_worker/core/drop_reason.h"

#include "absl/strings/match.h"

namespace tessera::worker {

DropReason ReasonOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kPermissionDenied:
      return DropReason::kNotNeighbor;
    case absl::StatusCode::kFailedPrecondition:
      return DropReason::kMapVersion;
    case absl::StatusCode::kOutOfRange:
      return absl::StartsWith(status.message(), "old tick") ? DropReason::kOldTick : DropReason::kOutOfOrder;
    case absl::StatusCode::kInvalidArgument:
      return absl::StartsWith(status.message(), "body ") ? DropReason::kBadBody : DropReason::kMalformed;
    default:
      return DropReason::kOther;
  }
}

}  // namespace tessera::worker

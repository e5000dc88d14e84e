// DropLog: counts messages of other regions that were not used, and logs one a second at most.
//
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/world/ids.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/drop_reason.h"
#include "region_worker/core/reason.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

class DropLog {
 public:
  static constexpr Duration kLogDistance = std::chrono::seconds(1);

  // `kind` as the log names it: "frame".
  void Dropped(const char* kind, RegionId from, const absl::Status& status, TimePoint now, Actions& actions) {
    ++counts_[static_cast<std::size_t>(ReasonOf(status))];
    ++unlogged_;
    if (now < may_log_at_) return;
    may_log_at_ = now + kLogDistance;
    LogWarning(actions, absl::StrCat(kind, " dropped from=", from.value(), Reason(status),
                                     " since_last_line=", std::exchange(unlogged_, 0)));
  }
  const DropCounts& counts() const { return counts_; }

 private:
  DropCounts counts_{};
  std::uint64_t unlogged_ = 0;
  TimePoint may_log_at_{};
};

}  // namespace tessera::worker

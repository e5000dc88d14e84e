// The end of a log line that says why.
#pragma once

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "telemetry/log_value.h"

namespace tessera::worker {

inline std::string Reason(const std::string& text) { return absl::StrCat(" reason=", telemetry::LogValue(text)); }
inline std::string Reason(const absl::Status& status) { return Reason(std::string(status.message())); }

}  // namespace tessera::worker

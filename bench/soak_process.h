// SoakProcess: what the kernel says that a process holds. Any thread.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string_view>

#include "bench/soak_series.h"

namespace tessera::bench {

// /proc/PID/status: VmSwap and RssAnon, which is memory that is its own alone, not pages of files that the kernel keeps
// as it likes; and Threads. Nothing if a line is missing, as of a process that has ended and was not reaped.
std::optional<SoakSample> ParseStatus(std::string_view status);
// The same of a live process, with its open descriptors; nothing once it has ended. `at_s` and `load` are left out.
std::optional<SoakSample> ReadSoakProcess(pid_t pid);

}  // namespace tessera::bench

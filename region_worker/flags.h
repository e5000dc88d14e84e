// The command line of tessera-region.
//
// Two forms: under an agent (--agent-socket) and standalone (--scene). Mistakes come back as one line that names the
// flag.
#pragma once

#include <string>
#include <variant>

#include "region_worker/worker_options.h"

namespace tessera::worker {

// Nothing to run: print `text` (help to stdout, a usage error to stderr) and exit with `status`.
struct ExitNow {
  int status = 0;
  std::string text;
};

std::variant<WorkerOptions, ExitNow> ParseFlags(int argc, const char* const* argv);

}  // namespace tessera::worker

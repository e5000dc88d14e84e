// tessera-agent: one on each host; --help says how it is run.
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "agent/agent.h"
#include "agent/options.h"
#include "host/end_signals.h"
#include "telemetry/logging.h"

namespace {

constexpr int kExitError = 1, kExitUsage = 2;

int Usage(const absl::Status& status) {
  std::fprintf(stderr, "tessera-agent: %s\n", std::string(status.message()).c_str());
  return kExitUsage;
}

int Main(int argc, char** argv) {
  const pid_t parent = getppid();
  absl::StatusOr<tessera::agent::AgentOptions> options = tessera::agent::ParseOptions(argc, argv);
  if (!options.ok()) return Usage(options.status());
  if (absl::Status status = tessera::telemetry::InitLogging("agent", options->log_level); !status.ok()) {
    return Usage(status);
  }
  unsetenv("TESSERA_JOIN_TOKEN");  // not for workers
  umask(0077);
  tessera::host::BlockSignals({SIGTERM, SIGINT, SIGHUP});  // before any thread; they are read from a descriptor
  std::signal(SIGPIPE, SIG_IGN);
  if (options->die_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) raise(SIGTERM);  // died before the line above; pending until the agent reads it
  }
  auto agent = tessera::agent::Agent::Create(*options);
  if (!agent.ok()) {
    if (absl::IsInvalidArgument(agent.status())) return Usage(agent.status());
    spdlog::error("{}", std::string(agent.status().message()));
    return kExitError;
  }
  const int exit_code = (*agent)->Run();
  agent->reset();
  // Not by return: gRPC 1.51's threads may still be busy with the last connection, and abort if they find the library's
  // static objects destroyed. All that must be written has been.
  spdlog::shutdown();
  _exit(exit_code);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return Main(argc, argv);
  } catch (const std::exception& error) {  // out of memory or descriptors at the start
    std::fprintf(stderr, "tessera-agent: %s\n", error.what());
    return kExitError;
  }
}

// The command line of tessera-agent, read and checked.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "agent/ports.h"
#include "telemetry/metrics_tls.h"

namespace tessera::agent {

struct AgentOptions {
  std::string control;     // as trust::ParseControlAddresses takes it
  std::string join_token;  // secret
  std::string join_token_file;
  std::string state_dir = "/var/lib/tessera/agent";
  std::string advertise_address = "127.0.0.1";
  std::string bind_address;  // workers listen on it
  std::string metrics_host = "127.0.0.1";
  std::uint16_t metrics_port = 7702;
  std::string metrics_token_file;          // for this program and its workers; empty: none
  telemetry::MetricsTlsFiles metrics_tls;  // likewise
  std::string region_binary;
  bool region_binary_given = false;  // else it is the one beside this program
  std::string release_programs;      // folder of workers' programs by release; need not be there
  std::string ready_file;
  std::string game_modules;  // folder of native games; empty: none
  std::string log_level;
  PortRange ports{7800, 8799};
  std::uint32_t capacity = 0;
  bool worker_sandbox = true;
  std::uint64_t worker_memory_mb = 0;  // each one's address space; 0: no limit
  bool worker_cgroups = false;         // each has a control group of its own
  std::uint32_t worker_tasks = 0;      // in that group; 0: no limit
  double certificate_life_s = 90 * 86'400.0;
  bool stop_workers = false;
  bool die_with_parent = false;
};

// INVALID_ARGUMENT in one line for what cannot be read. Exits by itself, with 0, after --help and --version.
absl::StatusOr<AgentOptions> ParseOptions(int argc, char** argv);

// The token that admits a new host: the file's content if there is one, else the flag's or the environment's; "" if
// none was given. INVALID_ARGUMENT if the file cannot be read or holds nothing. Apart from the rest, since a host that
// has been admitted needs neither token nor file.
absl::StatusOr<std::string> ReadJoinToken(const AgentOptions& options);

// "127.0.0.1" if only this machine reaches `address`, else "0.0.0.0".
std::string DefaultBindAddress(const std::string& address);

// The address at which others find metrics that are served at `metrics_host`; empty: the advertised one. An address
// that listens everywhere is none to connect to, and loopback is each machine's own.
std::string MetricsAddressOfHost(const std::string& metrics_host);

}  // namespace tessera::agent

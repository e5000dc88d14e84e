// The options of a worker: who it is, where it listens, and who gives its orders: an agent, or the flags alone.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/region/settings.h"
#include "core/world/limits.h"
#include "region_worker/core/identity.h"
#include "telemetry/metrics_tls.h"

namespace tessera::worker {

inline constexpr std::uint16_t kDefaultBasePort = 7900;

// A worker without a control plane: one of `regions` workers that were all started with the same flags but --region.
struct Standalone {
  std::string scene_path;
  std::string game_path;         // empty: none
  std::string game_module_path;  // a shared library instead; empty: none
  std::string movement_path;     // a shared library with a movement beside the Lua file; empty: none
  std::uint32_t regions = 1;
  // Region r listens on base_port + 3 * (r - 1) + {0 game, 1 link, 2 metrics}.
  std::uint16_t base_port = kDefaultBasePort;
  std::uint32_t players = 0;      // wait for so many before the start
  std::optional<double> seconds;  // run so long; absent: until a signal
  std::uint32_t snapshot_rate_hz = 30;
  region::RegionSettings borders;
};

struct WorkerOptions {
  Identity identity;
  std::string bind_address = "127.0.0.1";
  std::string advertise_address;                                 // reported to others
  std::uint16_t game_port = 0, link_port = 0, metrics_port = 0;  // 0: any
  std::uint32_t max_players = kUsualPlayers;                     // so many play in the world at one time
  std::string metrics_token;                                     // secret; empty: everybody may ask for metrics
  telemetry::MetricsTls metrics_tls;                             // unused: they are served as plain HTTP
  std::string metrics_host = "127.0.0.1";                        // not where players come, unless told so
  std::string agent_socket;                                      // empty: standalone
  std::optional<Standalone> standalone;
  std::string describe_game_module;             // path of a library to be described, and nothing else; empty: none
  std::string log_level;                        // empty: as telemetry/logging.h says
  std::string log_file;                         // empty: stderr
  bool sandbox = false;                         // give up what sandbox.h says
  std::vector<std::string> readable, writable;  // with it
  std::uint64_t memory_mb = 0;                  // with it; 0: no limit
};

// How the process ends.
inline constexpr int kExitOk = 0, kExitFailure = 1, kExitUsage = 2;
inline constexpr int kExitPortInUse = 98;  // EADDRINUSE; an agent then tries other ports

}  // namespace tessera::worker

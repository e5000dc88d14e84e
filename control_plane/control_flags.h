// ControlFlags: the options of tessera-control, and the settings that they come to.
//
//   AddControlOptions(app, flags);
//   app.parse(argc, argv);
//   if (absl::Status status = CheckControlFlags(flags); !status.ok()) return status;
//   auto reign = Reign::Begin(store, SettingsOf(flags), metrics, pages);
//
// Thread rule: free functions on values.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "control_plane/reign.h"
#include "control_plane/store_flags.h"
#include "telemetry/metrics_tls.h"

namespace tessera::control {

struct ControlFlags {
  std::string listen, players_listen, socket;
  ConnectionLimits connections;
  HttpsFlags https;
  std::string metrics_listen = "127.0.0.1:7701", metrics_token_file;
  telemetry::MetricsTlsFiles metrics_tls;
  std::string state_dir, checkpoints;
  std::string s3_endpoint, s3_region;
  std::optional<S3Settings> s3;  // where `checkpoints` names a bucket
  std::uint64_t checkpoint_reserve_mb = 256, checkpoint_quota_mb = 0, visual_quota_mb = 1000;
  StoreFlags store;
  std::string ready_file;
  std::string restore;
  std::string log_level;
  ControlSettings settings;
};

void AddControlOptions(CLI::App& app, ControlFlags& flags);
// Checks that options go together, and reads who asks an object store from the environment. INVALID_ARGUMENT names the
// option or the variable.
absl::Status CheckControlFlags(ControlFlags& flags);
// Requires that they were checked.
ReignSettings SettingsOf(const ControlFlags& flags);

}  // namespace tessera::control

// The options of tessera-control that say where the store is, and how others reach this control plane: --store,
// --store-authority, --store-certificate, --store-key, --advertise-address.
//
// Thread rule: free functions on values.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_election.h"

namespace tessera::control {

struct StoreFlags {
  std::string store, authority, certificate, key;  // addresses, and files
  std::string advertise_host;
  // By CheckStoreFlags. Without an address of etcd the store is a file, and this control plane is the only one.
  std::optional<EtcdAddress> etcd;
  LeaderAddress self;
};

void AddStoreOptions(CLI::App& app, StoreFlags& flags);
// Checks that the options go together. INVALID_ARGUMENT names the option. `listen`, `players_listen`: the doors;
// `checkpoints`: their folder, empty: none was named.
absl::Status CheckStoreFlags(StoreFlags& flags, const std::string& listen, const std::string& players_listen,
                             const std::string& checkpoints);
// Reads the files. Errors name the option.
absl::StatusOr<std::unique_ptr<EtcdClient>> ConnectStore(const StoreFlags& flags);

}  // namespace tessera::control

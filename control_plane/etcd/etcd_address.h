// EtcdAddress: which etcd, and under which keys: "etcd://10.0.0.1:2379,10.0.0.2:2379,10.0.0.3:2379/PREFIX".
//
// Clusters that share one etcd have different prefixes; without one it is "tessera".
// Thread rule: a value.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::control {

struct EtcdAddress {
  std::vector<std::string> endpoints;  // HOST:PORT, at least one
  std::string prefix;                  // begins all keys; letters, digits, '-', '_' and '.', parted by single '/'
  // Whether all endpoints are on this machine, so that nothing crosses a network.
  bool is_local = false;
};

// INVALID_ARGUMENT says what is wrong, without the option's name.
absl::StatusOr<EtcdAddress> ParseEtcdAddress(const std::string& text);

}  // namespace tessera::control

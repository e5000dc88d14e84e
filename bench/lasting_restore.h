// Worlds that are set back, taken up or begun anew, and their players: without etcd, on one machine.
//
// Thread rule: free functions; one at a time.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "bench/report.h"

namespace tessera::bench {

struct RestoreSize {
  unsigned runs;
  std::uint32_t bodies, players;
};

// All workers of a world die at once, and it begins again from its checkpoint.
absl::Status RunRestored(const RestoreSize& size, Report& report);
// `instance upgrade` of a match; then the control plane and every agent of three hosts are restarted under one. Where
// TESSERA_OTHER_RELEASE names a folder with programs of the release before, that is an upgrade from these.
absl::Status RunUpgrades(const RestoreSize& size, Report& report);
// The control plane's machine is lost with its store under three worlds, and another one begins from an old backup.
absl::Status RunTakeover(const RestoreSize& size, Report& report);

}  // namespace tessera::bench

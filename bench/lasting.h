// The suite lasting: what is lost, doubled or misstated by a cluster of three control planes, three members of etcd and
// three hosts under faults (lasting_faults.h), and how long each takes. Hosts are network namespaces.
//
// `--runs N`: how many faults strike, each kind once before any comes again; `--only` takes one kind alone. All are
// drawn from one seed, so every run of the suite is the same but for time.
#pragma once

#include "absl/status/status.h"
#include "bench/report.h"
#include "bench/suite.h"

namespace tessera::bench {

// UNAVAILABLE where network namespaces cannot be had.
absl::Status RunLastingSuite(const SuiteOptions& options, Report& report);

}  // namespace tessera::bench

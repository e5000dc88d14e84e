#include "bench/failover.h"

#include <exception>
#include <functional>
#include <iostream>
#include <utility>
#include <vector>

#include "bench/failover_faults.h"
#include "bench/failover_growth.h"

namespace tessera::bench {
namespace {

constexpr FailoverSize kFull{20, 2000, 8, 30, 5, 5000}, kQuick{2, 300, 2, 4, 1, 1000};
constexpr std::uint32_t kHosts = 2;

using Part = std::pair<std::string, std::function<absl::Status()>>;

// The longest part comes last.
std::vector<Part> Parts(const FailoverSize& size, local::HostNetwork* network, Report& report) {
  std::vector<Part> parts{{"standby", [&] { return RunStandby(size, report); }},
                          {"restore", [&] { return RunRestore(size, report); }},
                          {"scale", [&] { return RunScale(size, report); }},
                          {"hot-spot", [&] { return RunHotSpot(size, report); }}};
  for (Fault& fault : AllFaults(size, network)) {
    std::string name = fault.name;
    parts.emplace_back(std::move(name),
                       [&size, &report, fault = std::move(fault)] { return RunFault(fault, size, report); });
  }
  return parts;
}

// An exception, as where a program cannot be started, is an error of this part alone.
absl::Status RunPart(const Part& part) {
  try {
    return part.second();
  } catch (const std::exception& error) {
    return absl::InternalError(error.what());
  }
}

}  // namespace

absl::Status RunFailover(const SuiteOptions& options, Report& report) {
  FailoverSize size = options.quick ? kQuick : kFull;
  if (options.runs > 0) size.runs = options.runs;
  // Before gRPC makes threads, which would stay in the old one.
  const absl::Status own = local::EnterOwnNetwork();
  absl::StatusOr<std::unique_ptr<local::HostNetwork>> network =
      own.ok() ? local::HostNetwork::Create(kHosts) : absl::StatusOr<std::unique_ptr<local::HostNetwork>>(own);
  if (!network.ok()) std::cerr << "failover: no fault=link here: " << network.status().message() << "\n";
  absl::Status worst = absl::OkStatus();
  for (const Part& part : Parts(size, network.ok() ? network->get() : nullptr, report)) {
    if (part.first.find(options.only) == std::string::npos) continue;
    // A part that fails is reported, and leaves the others their turn.
    const absl::Status status = RunPart(part);
    if (!status.ok()) {
      std::cerr << "failover: " << part.first << ": " << status.message() << "\n";
      worst = status;
    }
    if (absl::Status saved = report.Save(); !saved.ok()) return saved;
  }
  return worst;
}

}  // namespace tessera::bench

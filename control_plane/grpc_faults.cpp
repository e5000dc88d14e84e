#include "control_plane/grpc_faults.h"

#include <array>
#include <cstddef>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"

namespace tessera::control {
namespace {

using Version = std::array<int, 3>;

struct GrpcFault {
  const char* name;
  Version fixed;
};

constexpr GrpcFault kGrpcFaults[] = {{"CVE-2023-1428", {1, 53, 0}},
                                     {"CVE-2023-4785", {1, 53, 2}},
                                     {"CVE-2023-33953", {1, 53, 2}},
                                     {"CVE-2023-44487", {1, 60, 0}}};

// "1.60.0-pre1" is 1.60.0; what is not a number is 0.
Version VersionOf(const std::string& text) {
  Version version{};
  const std::vector<std::string> parts = absl::StrSplit(text, absl::ByAnyChar(".-"));
  for (std::size_t i = 0; i < version.size() && i < parts.size(); ++i) {
    if (!absl::SimpleAtoi(parts[i], &version.at(i))) return version;
  }
  return version;
}

}  // namespace

std::string KnownGrpcFaults(const std::string& version) {
  std::vector<std::string> faults;
  for (const GrpcFault& fault : kGrpcFaults) {
    if (VersionOf(version) < fault.fixed) faults.emplace_back(fault.name);
  }
  return absl::StrJoin(faults, ", ");
}

}  // namespace tessera::control

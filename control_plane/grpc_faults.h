// Faults of gRPC that a stranger can use before any proof (docs/security.md, "Versions of libraries").
//
//   KnownGrpcFaults("1.51.1")   // "CVE-2023-1428, CVE-2023-4785, CVE-2023-33953, CVE-2023-44487"
//
// Thread rule: free functions.
#pragma once

#include <string>

namespace tessera::control {

// Those of a version as gRPC names itself, parted by commas; empty: none is known. A version that cannot be read has
// all.
std::string KnownGrpcFaults(const std::string& version);

}  // namespace tessera::control

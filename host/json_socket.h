// Where a control plane's players' door in JSON is, beside its own socket.
//
// Thread rule: free functions on values.
#pragma once

#include <cstddef>
#include <string>

namespace tessera::host {

// Beside a control plane's socket, which speaks gRPC: the one of its players' door in JSON.
inline std::string JsonSocket(const std::string& control_socket) { return control_socket + ".json"; }

// The longest path of a Unix socket that the kernel takes.
inline constexpr std::size_t kLongestSocketPath = 107;

}  // namespace tessera::host

// Makes a world of a scene of any size: one that is too large for a request is sent before it, and named by its hash.
//
//   const v1::Instance made = CreateInstance(connection, request).instance();
//
// A scene that the control plane has, from another world or from a try before, is not sent again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

class Connection;

// A scene of more bytes is sent before its request. A request has at most 64 MiB; below this, one call is quicker.
inline constexpr std::size_t kMaxSceneInRequest_bytes = std::size_t{16} << 20;

// `request` has its scene inside. `on_sent` is called with its bytes if it was sent before. CommandError: what the
// control plane says; one of an earlier release takes the scene in the request alone.
v1::CreateInstanceResponse CreateInstance(Connection& connection, v1::CreateInstanceRequest request,
                                          const std::function<void(std::size_t bytes)>& on_sent = nullptr,
                                          std::size_t most_in_request = kMaxSceneInRequest_bytes);

}  // namespace tessera::local

// GrpcServer: the control plane's gRPC port: HostService, InstanceService, SessionService and AgentLinkService of
// tessera.v1, with health and reflection.
//
// Thread rule: start and end it from one thread; it serves on threads of gRPC, one for each open stream. No gRPC header
// is needed to use it.
#pragma once

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"

namespace tessera::control {

class GrpcServer {
 public:
  // `address`: "127.0.0.1:7700"; port 0 takes a free one. kUnavailable "address 127.0.0.1:7700 is in use (grpc)";
  // kInvalidArgument for an address that is none.
  static absl::StatusOr<std::unique_ptr<GrpcServer>> Start(const std::string& address, ControlPlane& plane,
                                                           ControlMetrics& metrics);
  // Ends calls under way within half a second. Call ControlPlane::Stop first, so that waiting calls end by
  // themselves.
  ~GrpcServer();

  const std::string& address() const { return address_; }  // with the port that was bound

 private:
  struct Impl;
  GrpcServer();
  std::unique_ptr<Impl> impl_;
  std::string address_;
};

}  // namespace tessera::control

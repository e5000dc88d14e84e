// FollowerServer: the doors of a control plane that follows another.
//
// It answers every call with UNAVAILABLE and the leader's address: "this control plane does not lead; the leader is
// 10.0.0.1:7700", which stands in the trailing metadata kLeaderHeader, too. Its TLS doors show a certificate of the
// cluster's authority, so that whoever is redirected knows by whom. Health says NOT_SERVING. Nobody needs a token: the
// answer holds nothing that is not given to everybody who has an address of the cluster.
//
// Thread rule: start and end it from one thread; `leader` is called from threads of gRPC.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/authority.h"
#include "control_plane/control_metrics.h"
#include "control_plane/etcd/etcd_election.h"
#include "control_plane/grpc_server.h"

namespace tessera::control {

class FollowerServer {
 public:
  // The leader as far as it is known.
  using Leader = std::function<std::optional<LeaderAddress>()>;

  // Errors as GrpcServer::Start's. With a TCP door an authority is needed. `metrics` outlives it.
  static absl::StatusOr<std::unique_ptr<FollowerServer>> Start(const GrpcDoors& doors,
                                                               const std::optional<Authority>& authority,
                                                               ControlMetrics& metrics, const Leader& leader);
  ~FollowerServer();

 private:
  struct Impl;
  FollowerServer();
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::control

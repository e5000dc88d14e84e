// The doors of the control plane's gRPC server, and who a call comes from.
//
// Each door is an address with credentials of its own. At those that speak TLS a Doorkeeper judges every call before
// its method sees it: it knows the caller by a bearer token or a certificate, and asks CheckAccess. At the socket the
// file's mode lets in whom the kernel lets open it, but for processes that have given up rights (socket_listener.h).
//
// Thread rule: any thread; gRPC calls a Doorkeeper from threads of its own.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "control_plane/access.h"
#include "control_plane/authority.h"
#include "control_plane/control_metrics.h"
#include "control_plane/control_plane.h"
#include "control_plane/tcp_listener.h"

namespace tessera::control {

// The name of a door in metrics and logs: "operators", "players", "socket".
std::string DoorName(Door door);

// A door that speaks TLS: a server gets its connections from a TcpListener, which bounds how many there are.
//
//   ServerBuilder builder;
//   TcpDoor tcp(builder, credentials);  // before the server is built
//   server = builder.BuildAndStart();
//   auto listener = tcp.Listen(address, Door::kPlayers, limits, metrics);  // it ends before the server
class TcpDoor {
 public:
  TcpDoor(grpc::ServerBuilder& builder, std::shared_ptr<grpc::ServerCredentials> credentials);
  // Errors as TcpListener's.
  absl::StatusOr<std::unique_ptr<TcpListener>> Listen(const host::SocketAddress& address, Door door,
                                                      ConnectionLimits limits, ControlMetrics& metrics) const;

 private:
  std::shared_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor_;
};

// TLS with a new certificate of the authority, every call judged. `authority` and `plane` outlive the server.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> TlsCredentials(Door door, const Authority& authority,
                                                                        ControlPlane& plane);
// The same, and no call is judged: for a server that answers none.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> UnjudgedTlsCredentials(Door door, const Authority& authority);
// gRPC's own log lines are for those who debug it, so they go out at debug level.
void ForwardGrpcLog();
// Message sizes and keepalive, as clients rely on them.
void SetServerLimits(grpc::ServerBuilder& builder, Door door);
// The caller, now: nobody, where its token or certificate counts no more since the Doorkeeper let the call in.
Caller CallerOf(const grpc::ServerContext& context, Door door, ControlPlane& plane);
// The serial number of the certificate that the caller's connection shows; empty: none.
std::string ShownSerial(const grpc::ServerContext& context);

// Binds nothing; makes the socket's folder if it is not there, private, and removes the socket that an earlier process
// left. UNAVAILABLE: somebody listens there still.
absl::Status PrepareSocket(const std::string& path);
// Lets in this user alone, and root.
absl::Status CloseToOthers(const std::string& path);

}  // namespace tessera::control

#include "control_plane/follower_server.h"

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>

#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/door_limits.h"
#include "control_plane/doors.h"
#include "control_plane/tcp_listener.h"
#include "host/socket_address.h"
#include "trust/leader_hint.h"

namespace tessera::control {
namespace {

// Ends itself.
class RefusedCall final : public grpc::ServerGenericBidiReactor {
 public:
  explicit RefusedCall(grpc::Status status) { Finish(std::move(status)); }
  void OnDone() override { delete this; }
};

class RedirectService final : public grpc::CallbackGenericService {
 public:
  RedirectService(Door door, FollowerServer::Leader leader) : door_(door), leader_(std::move(leader)) {}

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    const std::optional<LeaderAddress> leader = leader_();
    const std::string address = !leader ? "" : door_ == Door::kPlayers ? leader->players : leader->operators;
    if (!address.empty()) context->AddTrailingMetadata(trust::kLeaderHeader, address);
    return new RefusedCall({grpc::StatusCode::UNAVAILABLE,
                            absl::StrCat("this control plane does not lead; ",
                                         address.empty() ? "the leader is not known" : "the leader is ", address)});
  }

 private:
  const Door door_;
  const FollowerServer::Leader leader_;
};

struct FollowerDoor {
  FollowerDoor(Door door, const FollowerServer::Leader& leader) : service(door, leader) {}
  RedirectService service;
  std::unique_ptr<grpc::Server> server;   // ends before what it serves
  std::unique_ptr<TcpListener> listener;  // a TCP door has one; it ends before the server
};

}  // namespace

struct FollowerServer::Impl {
  // `prepare` lets the server take connections.
  absl::StatusOr<FollowerDoor*> Open(Door door, const char* name, const std::string& address, const Leader& leader,
                                     const std::function<void(grpc::ServerBuilder&)>& prepare) {
    FollowerDoor& opened = *doors.emplace_back(std::make_unique<FollowerDoor>(door, leader));
    grpc::ServerBuilder builder;
    SetServerLimits(builder, door);
    // Nobody is judged here, and health is asked by a few bytes.
    builder.SetMaxReceiveMessageSize(kPlayersMessageBytes);
    prepare(builder);
    builder.RegisterCallbackGenericService(&opened.service);
    opened.server = builder.BuildAndStart();
    if (!opened.server) {
      return absl::UnavailableError(absl::StrCat("address ", address, " cannot be bound (", name, ")"));
    }
    opened.server->GetHealthCheckService()->SetServingStatus(false);
    return &opened;
  }

  absl::Status OpenTcp(Door door, const char* name, const std::string& text, const Leader& leader,
                       const std::optional<Authority>& authority, ConnectionLimits limits) {
    if (text.empty()) return absl::OkStatus();
    const auto address = host::ParseSocketAddress(text, host::PortRule::kFrom1);
    if (!address.ok()) return address.status();
    if (!authority) return absl::InternalError("a door that speaks TLS needs an authority");
    if (absl::Status status = host::CheckBindable(*address, name); !status.ok()) return status;
    const auto credentials = UnjudgedTlsCredentials(door, *authority);
    if (!credentials.ok()) return credentials.status();
    std::optional<TcpDoor> tcp;
    const auto opened =
        Open(door, name, text, leader, [&](grpc::ServerBuilder& builder) { tcp.emplace(builder, *credentials); });
    if (!opened.ok()) return opened.status();
    auto listener = tcp->Listen(*address, door, limits, *metrics);
    if (!listener.ok()) return listener.status();
    (*opened)->listener = *std::move(listener);
    return absl::OkStatus();
  }

  absl::Status OpenSocket(const std::string& path, const Leader& leader) {
    if (absl::Status status = PrepareSocket(path); !status.ok()) return status;
    const std::string address = "unix:" + path;
    const auto opened = Open(Door::kSocket, "grpc", address, leader, [&](grpc::ServerBuilder& builder) {
      builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    });
    return opened.ok() ? CloseToOthers(path) : opened.status();
  }

  ControlMetrics* metrics = nullptr;
  std::vector<std::unique_ptr<FollowerDoor>> doors;
};

FollowerServer::FollowerServer() : impl_(std::make_unique<Impl>()) {}

absl::StatusOr<std::unique_ptr<FollowerServer>> FollowerServer::Start(const GrpcDoors& doors,
                                                                      const std::optional<Authority>& authority,
                                                                      ControlMetrics& metrics, const Leader& leader) {
  ForwardGrpcLog();
  grpc::EnableDefaultHealthCheckService(true);
  std::unique_ptr<FollowerServer> result(new FollowerServer());
  Impl& impl = *result->impl_;
  impl.metrics = &metrics;
  absl::Status status = impl.OpenTcp(Door::kOperators, "grpc", doors.operators, leader, authority, doors.limits);
  if (status.ok()) status = impl.OpenTcp(Door::kPlayers, "players", doors.players, leader, authority, doors.limits);
  if (status.ok()) status = impl.OpenSocket(doors.socket, leader);
  if (!status.ok()) return status;
  return result;
}

FollowerServer::~FollowerServer() {
  for (const auto& door : impl_->doors) {
    door->listener.reset();
    if (door->server) door->server->Shutdown(std::chrono::system_clock::now());
  }
}

}  // namespace tessera::control

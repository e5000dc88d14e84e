#include "control_plane/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/server_posix.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <deque>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/bounded_service.h"
#include "control_plane/doors.h"
#include "control_plane/services/access_service.h"
#include "control_plane/services/agent_link_service.h"
#include "control_plane/services/host_service.h"
#include "control_plane/services/instance_service.h"
#include "control_plane/services/session_service.h"
#include "control_plane/services/visual_service.h"
#include "control_plane/socket_listener.h"
#include "control_plane/tcp_listener.h"
#include "host/socket_address.h"
#include "telemetry/log_throttle.h"
#include "telemetry/log_value.h"

namespace tessera::control {
namespace {

// How long calls under way, and clients that do not close, may delay the end.
constexpr std::chrono::milliseconds kShutdownPatience{500};
constexpr char kSocketPrefix[] = "unix:";

// One door: a server of its own, since a call does not say at which address it came in.
struct DoorServer {
  DoorServer(Door door, ControlPlane& plane, ControlMetrics& metrics, const Authority* authority)
      : access(plane, metrics, door, authority),
        hosts(plane, metrics, door, authority),
        instances(plane, metrics, door, authority),
        sessions(plane, metrics, door, authority),
        visuals(plane, metrics, door, authority),
        agents(plane, metrics, door, authority) {
    const auto log = [this, door, &plane](const grpc::ServerContext& context, const std::string& method,
                                          const grpc::Status& status) {
      const auto left_out = refusals.Take(telemetry::LogThrottle::Clock::now());
      if (!left_out) return;
      spdlog::warn("refused method={} who={} from={} reason={} more={}", method, CallerOf(context, door, plane).Name(),
                   context.peer(), telemetry::LogValue(status.error_message()), *left_out);
    };
    bounded.emplace_back(access, v1::AccessService::service_full_name(), log);
    bounded.emplace_back(hosts, v1::HostService::service_full_name(), log);
    bounded.emplace_back(instances, v1::InstanceService::service_full_name(), log, instances.Streams());
    bounded.emplace_back(sessions, v1::SessionService::service_full_name(), log);
    bounded.emplace_back(visuals, v1::VisualService::service_full_name(), log, visuals.Streams());
    bounded.emplace_back(agents, v1::AgentLinkService::service_full_name(), log, agents.Streams());
  }
  DoorServer(const DoorServer&) = delete;
  DoorServer& operator=(const DoorServer&) = delete;

  AccessServiceImpl access;
  HostServiceImpl hosts;
  InstanceFilesImpl instances;
  SessionServiceImpl sessions;
  VisualServiceImpl visuals;
  AgentLinkServiceImpl agents;
  telemetry::LogThrottle refusals;
  std::deque<BoundedService> bounded;    // the same, as the server has them
  std::unique_ptr<grpc::Server> server;  // ends before what it serves
  // The socket's door has the one, the others have the other. They end before the server.
  std::unique_ptr<SocketListener> listener;
  std::unique_ptr<TcpListener> tcp_listener;
};

}  // namespace

struct GrpcServer::Impl {
  // `prepare` lets the server take connections; `name` and `address` are for errors.
  absl::StatusOr<DoorServer*> Open(Door door, const std::string& name, const std::string& address,
                                   const std::function<void(grpc::ServerBuilder&)>& prepare) {
    DoorServer& opened =
        *doors.emplace_back(std::make_unique<DoorServer>(door, *plane, *metrics, authority ? &*authority : nullptr));
    grpc::ServerBuilder builder;
    SetServerLimits(builder, door);
    prepare(builder);
    for (BoundedService& service : opened.bounded) builder.RegisterService(&service);
    opened.server = builder.BuildAndStart();
    if (!opened.server)
      return absl::UnavailableError(absl::StrCat("address ", address, " cannot be served (", name, ")"));
    for (const char* service : {v1::AccessService::service_full_name(), v1::HostService::service_full_name(),
                                v1::InstanceService::service_full_name(), v1::SessionService::service_full_name(),
                                v1::VisualService::service_full_name(), v1::AgentLinkService::service_full_name()}) {
      opened.server->GetHealthCheckService()->SetServingStatus(service, true);
    }
    return &opened;
  }
  // gRPC gets connections of those alone who are let in.
  absl::Status OpenSocket(const std::string& path) {
    if (absl::Status status = PrepareSocket(path); !status.ok()) return status;
    const auto opened = Open(Door::kSocket, "grpc", path, [](grpc::ServerBuilder&) {});
    if (!opened.ok()) return opened.status();
    grpc::Server* server = (*opened)->server.get();
    auto listener = SocketListener::Listen(path, [server](int fd) { grpc::AddInsecureChannelFromFd(server, fd); });
    if (!listener.ok()) return listener.status();
    (*opened)->listener = *std::move(listener);
    return absl::OkStatus();
  }
  // The address as bound; empty: there is to be none.
  absl::StatusOr<std::string> OpenTcp(Door door, const std::string& name, const std::string& text,
                                      ConnectionLimits limits) {
    if (text.empty()) return "";
    auto address = host::ParseSocketAddress(text, host::PortRule::kFrom0);
    if (!address.ok()) return address.status();
    if (!authority) return absl::InternalError("a door that speaks TLS needs an authority");
    if (absl::Status status = host::CheckBindable(*address, name); !status.ok()) return status;
    const auto credentials = TlsCredentials(door, *authority, *plane);
    if (!credentials.ok()) return credentials.status();
    std::optional<TcpDoor> tcp;
    const auto opened =
        Open(door, name, ToString(*address), [&](grpc::ServerBuilder& builder) { tcp.emplace(builder, *credentials); });
    if (!opened.ok()) return opened.status();
    auto listener = tcp->Listen(*address, door, limits, *metrics);
    if (!listener.ok()) return listener.status();
    (*opened)->tcp_listener = *std::move(listener);
    return ToString((*opened)->tcp_listener->address());
  }

  std::optional<Authority> authority;
  ControlPlane* plane;
  ControlMetrics* metrics;
  std::vector<std::unique_ptr<DoorServer>> doors;
};

GrpcServer::GrpcServer() = default;

absl::StatusOr<std::unique_ptr<GrpcServer>> GrpcServer::Start(const GrpcDoors& doors,
                                                              std::optional<Authority> authority, ControlPlane& plane,
                                                              ControlMetrics& metrics) {
  ForwardGrpcLog();
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  std::unique_ptr<GrpcServer> result(new GrpcServer());
  result->impl_ = std::make_unique<Impl>(Impl{std::move(authority), &plane, &metrics, {}});
  Impl& impl = *result->impl_;

  auto operators = impl.OpenTcp(Door::kOperators, "grpc", doors.operators, doors.limits);
  if (!operators.ok()) return operators.status();
  auto players = impl.OpenTcp(Door::kPlayers, "players", doors.players, doors.limits);
  if (!players.ok()) return players.status();
  if (absl::Status status = impl.OpenSocket(doors.socket); !status.ok()) return status;
  result->socket_ = kSocketPrefix + doors.socket;
  result->operators_ = *std::move(operators);
  result->players_ = *std::move(players);
  return result;
}

GrpcServer::~GrpcServer() {
  if (!impl_) return;
  const auto deadline = std::chrono::system_clock::now() + kShutdownPatience;
  for (const auto& door : impl_->doors) {
    door->listener.reset();
    door->tcp_listener.reset();
    if (!door->server) continue;
    door->server->GetHealthCheckService()->SetServingStatus(false);
    door->server->Shutdown(deadline);
  }
}

}  // namespace tessera::control

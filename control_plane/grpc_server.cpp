#include "control_plane/grpc_server.h"

#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <spdlog/spdlog.h>

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/host_rights.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/control_settings.h"
#include "control_plane/door_limits.h"
#include "control_plane/doors.h"
#include "control_plane/hello_deadlines.h"
#include "control_plane/one_line.h"
#include "control_plane/stored_records.h"
#include "host/socket_address.h"
#include "telemetry/log_throttle.h"
#include "telemetry/logging.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"

namespace tessera::control {
namespace {

using telemetry::LogValue;

// How long calls under way, and clients that do not close, may delay the end.
constexpr std::chrono::milliseconds kShutdownPatience{500};
constexpr char kSocketPrefix[] = "unix:";
// An agent says who it is at once; whoever says nothing holds a thread.
constexpr std::chrono::seconds kHelloPatience{10};
constexpr std::size_t kMaxSilentStreams = 64;

grpc::Status ToGrpc(const absl::Status& status) {
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message())};
}

enum class CallKind { kRead, kWatch, kCommand };

// The subject of a call: a name or an id for the log, never a secret; and, where it names one, the instance that its
// caller's token must be for.
struct Subject {
  Subject(std::string subject) : text(std::move(subject)) {}  // NOLINT(google-explicit-constructor)
  Subject(const char* subject) : text(subject) {}             // NOLINT(google-explicit-constructor)

  std::string text;
  std::optional<std::string> instance;
};
Subject Instance(const std::string& id, const std::string& more = "") {
  Subject subject(id + more);
  subject.instance = id;
  return subject;
}

// Answers calls: it times them, logs a line and converts the status.
class Answerer {
 public:
  Answerer(ControlPlane& plane, ControlMetrics& metrics, Door door, const Authority* authority)
      : plane_(plane), metrics_(metrics), door_(door), authority_(authority) {}

 protected:
  // `call() -> absl::Status`.
  template <class Call>
  grpc::Status Answer(grpc::ServerContext* context, const char* method, CallKind kind, const Subject& subject,
                      Call&& call) {
    const Caller caller = CallerOf(*context);  // before the call, which may revoke its own token
    const auto begun = std::chrono::steady_clock::now();
    absl::Status status = subject.instance ? CheckInstance(caller, *subject.instance) : absl::OkStatus();
    const auto slot = slots_.Take(caller, context->peer(), method);
    if (!slot) status = absl::ResourceExhaustedError("too many calls of this caller are under way; try again");
    const bool changes = kind == CallKind::kCommand && !std::string_view(method).starts_with("AccessService/");
    if (status.ok() && changes) status = plane_.CheckRecovered();
    if (status.ok()) status = call();
    const auto took = std::chrono::steady_clock::now() - begun;
    // How long somebody watched is no time to answer.
    if (kind != CallKind::kWatch) metrics_.ObserveRpc(method, took);
    Log(*context, {method, kind, caller.Name(), subject.text, took}, status);
    return ToGrpc(status);
  }
  // Puts the value of a StatusOr into `out`.
  template <class Result, class Out>
  static absl::Status Take(absl::StatusOr<Result> result, Out* out) {
    if (!result.ok()) return result.status();
    *out = *std::move(result);
    return absl::OkStatus();
  }

  Caller CallerOf(const grpc::ServerContext& context) const { return control::CallerOf(context, door_, plane_); }

  ControlPlane& plane_;
  ControlMetrics& metrics_;
  const Door door_;
  const Authority* authority_;  // null: no door needs one
  // For lines that strangers can cause as often as they like: failed calls of players, and hellos.
  telemetry::LogThrottle strangers_;

 private:
  CallSlots slots_;
  struct Answered {
    const char* method;
    CallKind kind;
    std::string who;
    const std::string& subject;
    std::chrono::steady_clock::duration took;
  };
  void Log(const grpc::ServerContext& context, const Answered& call, const absl::Status& status) {
    std::uint64_t left_out = 0;
    if (door_ == Door::kPlayers && !status.ok()) {
      const auto passes = strangers_.Take(telemetry::LogThrottle::Clock::now());
      if (!passes) return;
      left_out = *passes;
    }
    const auto level = call.kind == CallKind::kCommand ? spdlog::level::info : spdlog::level::debug;
    spdlog::log(level, "rpc method={} who={} from={} subject={} result={} ms={:.1f}{}{}", call.method, call.who,
                context.peer(), LogValue(OneLine(call.subject, kMaxNameBytes)), absl::StatusCodeToString(status.code()),
                std::chrono::duration<double, std::milli>(call.took).count(),
                status.ok() ? "" : " error=" + LogValue(OneLine(std::string(status.message()), kMaxReasonBytes)),
                left_out == 0 ? "" : absl::StrCat(" more=", left_out));
  }
};

template <class Response>
absl::Status SendPieces(const std::string& bytes, grpc::ServerWriter<Response>& writer) {
  for (std::size_t at = 0; at < bytes.size(); at += kPieceBytes) {
    Response piece;
    piece.set_data(bytes.substr(at, kPieceBytes));
    if (!writer.Write(piece)) return absl::CancelledError("the caller has gone");
  }
  return absl::OkStatus();
}

// Reads `first`, without its piece, and all pieces; nothing more is read unless `check` accepts it.
template <class Request, class Check>
absl::Status ReadPieces(grpc::ServerReader<Request>& reader, Request& first, std::string& bytes, Check&& check) {
  if (!reader.Read(&first)) return absl::InvalidArgumentError("data: nothing came");
  if (absl::Status status = check(first); !status.ok()) return status;
  bytes = std::move(*first.mutable_data());
  first.clear_data();
  Request more;
  while (reader.Read(&more)) {
    bytes += more.data();
    if (bytes.size() > kMaxStateBytes) {
      return absl::InvalidArgumentError(absl::StrCat("data: more than ", kMaxStateBytes, " bytes"));
    }
  }
  return absl::OkStatus();
}

class AccessServiceImpl final : public v1::AccessService::Service, Answerer {
 public:
  using Answerer::Answerer;

  grpc::Status CreateToken(grpc::ServerContext* context, const v1::CreateTokenRequest* request,
                           v1::CreateTokenResponse* response) override {
    const std::string subject = absl::StrCat(request->name(), " as ", v1::Role_Name(request->role()));
    return Answer(context, "AccessService/CreateToken", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.CreateToken(now, *request); }), response);
    });
  }
  grpc::Status ListTokens(grpc::ServerContext* context, const v1::ListTokensRequest*,
                          v1::ListTokensResponse* response) override {
    return Answer(context, "AccessService/ListTokens", CallKind::kRead, "", [&] {
      *response = plane_.Call([](Cluster& cluster, Now) { return cluster.tokens().List(); });
      return absl::OkStatus();
    });
  }
  grpc::Status RevokeToken(grpc::ServerContext* context, const v1::RevokeTokenRequest* request,
                           v1::RevokeTokenResponse*) override {
    return Answer(context, "AccessService/RevokeToken", CallKind::kCommand, request->name(),
                  [&] { return plane_.Call([&](Cluster& cluster, Now) { return cluster.RevokeToken(*request); }); });
  }
  grpc::Status AddIssuer(grpc::ServerContext* context, const v1::AddIssuerRequest* request,
                         v1::AddIssuerResponse* response) override {
    const std::string subject = absl::StrCat(request->name(), " for ", request->instances());
    return Answer(context, "AccessService/AddIssuer", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.AddIssuer(now, *request); }), response);
    });
  }
  grpc::Status ListIssuers(grpc::ServerContext* context, const v1::ListIssuersRequest*,
                           v1::ListIssuersResponse* response) override {
    return Answer(context, "AccessService/ListIssuers", CallKind::kRead, "", [&] {
      *response = plane_.Call([](Cluster& cluster, Now) { return cluster.issuers().List(); });
      return absl::OkStatus();
    });
  }
  grpc::Status RemoveIssuer(grpc::ServerContext* context, const v1::RemoveIssuerRequest* request,
                            v1::RemoveIssuerResponse*) override {
    return Answer(context, "AccessService/RemoveIssuer", CallKind::kCommand, request->name(),
                  [&] { return plane_.Call([&](Cluster& cluster, Now) { return cluster.RemoveIssuer(*request); }); });
  }
  grpc::Status InitCluster(grpc::ServerContext* context, const v1::InitClusterRequest* request,
                           v1::InitClusterResponse* response) override {
    return Answer(context, "AccessService/InitCluster", CallKind::kCommand, request->name(), [&]() -> absl::Status {
      // The doors that speak TLS have refused it before; this holds also for one that is added some day.
      if (door_ != Door::kSocket) return absl::PermissionDeniedError("at the control plane's socket alone");
      if (authority_ == nullptr) return NoAuthority();
      v1::CreateTokenRequest create;
      create.set_name(request->name());
      create.set_role(v1::ROLE_ADMINISTRATOR);
      auto created = plane_.Call([&](Cluster& cluster, Now now) { return cluster.CreateToken(now, create); });
      if (!created.ok()) return created.status();
      response->mutable_token()->Swap(created->mutable_token());
      response->set_secret(created->secret());
      response->set_certificate(authority_->signer.certificate);
      response->set_fingerprint(authority_->fingerprint);
      return absl::OkStatus();
    });
  }
  grpc::Status BackupCluster(grpc::ServerContext* context, const v1::BackupClusterRequest*,
                             grpc::ServerWriter<v1::BackupClusterResponse>* writer) override {
    return Answer(context, "AccessService/BackupCluster", CallKind::kCommand, "", [&] {
      return plane_.Backup([&](std::string_view bytes) { return SendPieces(std::string(bytes), *writer); });
    });
  }
  grpc::Status GetAuthority(grpc::ServerContext* context, const v1::GetAuthorityRequest*,
                            v1::GetAuthorityResponse* response) override {
    return Answer(context, "AccessService/GetAuthority", CallKind::kRead, "", [&]() -> absl::Status {
      if (authority_ == nullptr) return NoAuthority();
      response->set_certificate(authority_->signer.certificate);
      response->set_fingerprint(authority_->fingerprint);
      return absl::OkStatus();
    });
  }

 private:
  static absl::Status NoAuthority() {
    return absl::FailedPreconditionError(
        "this control plane listens on a socket of its machine alone, and has no authority; give it --listen");
  }
};

class HostServiceImpl final : public v1::HostService::Service, Answerer {
 public:
  using Answerer::Answerer;

  grpc::Status AddHost(grpc::ServerContext* context, const v1::AddHostRequest* request,
                       v1::AddHostResponse* response) override {
    return Answer(context, "HostService/AddHost", CallKind::kCommand, request->name(), [&] {
      const absl::Status status =
          Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.AddHost(now, *request); }), response);
      // With it, the agent knows whom to give the token to.
      if (authority_ != nullptr && !response->join_token().empty()) {
        absl::StrAppend(response->mutable_join_token(), ".", authority_->fingerprint);
      }
      return status;
    });
  }
  grpc::Status ListHosts(grpc::ServerContext* context, const v1::ListHostsRequest* request,
                         v1::ListHostsResponse* response) override {
    return Answer(context, "HostService/ListHosts", CallKind::kRead, "", [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return control::ListHosts(cluster.state(), *request); }),
                  response);
    });
  }
  grpc::Status GetHost(grpc::ServerContext* context, const v1::GetHostRequest* request,
                       v1::GetHostResponse* response) override {
    return Answer(context, "HostService/GetHost", CallKind::kRead, request->name(), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return control::GetHost(cluster.state(), *request); }),
                  response);
    });
  }
  grpc::Status DrainHost(grpc::ServerContext* context, const v1::DrainHostRequest* request,
                         v1::DrainHostResponse* response) override {
    return Answer(context, "HostService/DrainHost", CallKind::kCommand, request->name(), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return cluster.DrainHost(*request); }), response);
    });
  }
  grpc::Status RemoveHost(grpc::ServerContext* context, const v1::RemoveHostRequest* request,
                          v1::RemoveHostResponse*) override {
    return Answer(context, "HostService/RemoveHost", CallKind::kCommand, request->name(), [&] {
      return plane_.Call([&](Cluster& cluster, Now now) { return cluster.RemoveHost(now, *request); });
    });
  }
};

// Strangers see who plays by name, as everybody in the world does, and not as whom they log in elsewhere.
void HideAccounts(v1::Instance& instance) {
  for (v1::Player& player : *instance.mutable_player_list()) {
    player.clear_player_id();
    player.clear_properties();
  }
}

// "player 7" or the id of its ticket.
template <class Request>
std::string PlayerNamed(const Request& request) {
  return request.player_case() == Request::kNumber ? absl::StrCat("player ", request.number()) : request.player_id();
}

class InstanceServiceImpl : public v1::InstanceService::Service, protected Answerer {
 public:
  using Answerer::Answerer;

  // Whoever may open the socket plays alone or with friends; elsewhere players prove who they are unless told.
  bool GuestsByDefault() const { return door_ == Door::kSocket; }

  grpc::Status CreateInstance(grpc::ServerContext* context, const v1::CreateInstanceRequest* request,
                              v1::CreateInstanceResponse* response) override {
    const std::string subject = absl::StrCat(request->spec().scene().name(), " x ", request->spec().regions());
    return Answer(context, "InstanceService/CreateInstance", CallKind::kCommand, subject, [&] {
      const absl::Status status =
          Take(plane_.CreateInstance(*request, GuestsByDefault()), response->mutable_instance());
      if (!request->validate_only() && !absl::IsInvalidArgument(status)) metrics_.CountPlacement(status);
      return status;
    });
  }
  grpc::Status GetInstance(grpc::ServerContext* context, const v1::GetInstanceRequest* request,
                           v1::GetInstanceResponse* response) override {
    return Answer(context, "InstanceService/GetInstance", CallKind::kRead, Instance(request->id()), [&] {
      const absl::Status status =
          Take(plane_.Call([&](Cluster& cluster, Now) { return control::GetInstance(cluster.state(), request->id()); }),
               response->mutable_instance());
      if (door_ == Door::kPlayers) HideAccounts(*response->mutable_instance());
      return status;
    });
  }
  grpc::Status ListInstances(grpc::ServerContext* context, const v1::ListInstancesRequest* request,
                             v1::ListInstancesResponse* response) override {
    return Answer(context, "InstanceService/ListInstances", CallKind::kRead, "", [&] {
      const Caller caller = CallerOf(*context);
      const auto shown = [&](const std::string& id) { return CheckInstance(caller, id).ok(); };
      return Take(
          plane_.Call([&](Cluster& cluster, Now) { return control::ListInstances(cluster.state(), *request, shown); }),
          response);
    });
  }
  grpc::Status WatchInstance(grpc::ServerContext* context, const v1::WatchInstanceRequest* request,
                             grpc::ServerWriter<v1::WatchInstanceResponse>* writer) override {
    const auto sink = [writer](const v1::Instance& instance) {
      v1::WatchInstanceResponse response;
      *response.mutable_instance() = instance;
      return writer->Write(response);
    };
    return Answer(context, "InstanceService/WatchInstance", CallKind::kWatch, Instance(request->id()), [&] {
      return plane_.WatchInstance(request->id(), sink, [context] { return context->IsCancelled(); });
    });
  }
  grpc::Status ScaleInstance(grpc::ServerContext* context, const v1::ScaleInstanceRequest* request,
                             v1::ScaleInstanceResponse* response) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" to ", request->regions()));
    return Answer(context, "InstanceService/ScaleInstance", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.ScaleInstance(now, *request); }),
                  response->mutable_instance());
    });
  }
  grpc::Status RestartWorkers(grpc::ServerContext* context, const v1::RestartWorkersRequest* request,
                              v1::RestartWorkersResponse* response) override {
    return Answer(context, "InstanceService/RestartWorkers", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.RestartWorkers(now, *request); }),
                  response->mutable_instance());
    });
  }
  grpc::Status PauseInstance(grpc::ServerContext* context, const v1::PauseInstanceRequest* request,
                             v1::PauseInstanceResponse* response) override {
    return Answer(context, "InstanceService/PauseInstance", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.PauseInstance(now, *request); }),
                  response->mutable_instance());
    });
  }
  grpc::Status ResumeInstance(grpc::ServerContext* context, const v1::ResumeInstanceRequest* request,
                              v1::ResumeInstanceResponse* response) override {
    return Answer(context, "InstanceService/ResumeInstance", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.ResumeInstance(now, *request); }),
                  response->mutable_instance());
    });
  }
  grpc::Status SetPace(grpc::ServerContext* context, const v1::SetPaceRequest* request,
                       v1::SetPaceResponse* response) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" to ", request->ticks_per_second()));
    return Answer(context, "InstanceService/SetPace", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.SetPace(now, *request); }),
                  response->mutable_instance());
    });
  }
  grpc::Status SetGame(grpc::ServerContext* context, const v1::SetGameRequest* request,
                       v1::SetGameResponse* response) override {
    return Answer(context, "InstanceService/SetGame", CallKind::kCommand, Instance(request->id()),
                  [&] { return Take(plane_.SetGame(*request), response); });
  }
  grpc::Status SetProperty(grpc::ServerContext* context, const v1::SetPropertyRequest* request,
                           v1::SetPropertyResponse*) override {
    const Subject subject =
        Instance(request->id(), absl::StrCat(" body ", request->body(), " ", request->property().name()));
    return Answer(context, "InstanceService/SetProperty", CallKind::kCommand, subject,
                  [&] { return plane_.SetProperty(*request, [context] { return context->IsCancelled(); }); });
  }
  grpc::Status ListGameLines(grpc::ServerContext* context, const v1::ListGameLinesRequest* request,
                             v1::ListGameLinesResponse* response) override {
    return Answer(context, "InstanceService/ListGameLines", CallKind::kRead, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return cluster.ListGameLines(*request); }), response);
    });
  }
  grpc::Status WatchGameEvents(grpc::ServerContext* context, const v1::WatchGameEventsRequest* request,
                               grpc::ServerWriter<v1::WatchGameEventsResponse>* writer) override {
    const auto sink = [writer](const v1::PublishedEvent& event) {
      v1::WatchGameEventsResponse response;
      *response.mutable_event() = event;
      return writer->Write(response);
    };
    return Answer(context, "InstanceService/WatchGameEvents", CallKind::kWatch, Instance(request->id()),
                  [&] { return plane_.WatchGameEvents(*request, sink, [context] { return context->IsCancelled(); }); });
  }
  grpc::Status SendToGame(grpc::ServerContext* context, const v1::SendToGameRequest* request,
                          v1::SendToGameResponse*) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" ", request->name()));
    return Answer(context, "InstanceService/SendToGame", CallKind::kCommand, subject,
                  [&] { return plane_.SendToGame(*request, [context] { return context->IsCancelled(); }); });
  }
  grpc::Status KickPlayer(grpc::ServerContext* context, const v1::KickPlayerRequest* request,
                          v1::KickPlayerResponse* response) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" ", PlayerNamed(*request)));
    return Answer(context, "InstanceService/KickPlayer", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.KickPlayer(now, *request); }), response);
    });
  }
  grpc::Status BanPlayer(grpc::ServerContext* context, const v1::BanPlayerRequest* request,
                         v1::BanPlayerResponse* response) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" ", PlayerNamed(*request)));
    return Answer(context, "InstanceService/BanPlayer", CallKind::kCommand, subject, [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.BanPlayer(now, *request); }), response);
    });
  }
  grpc::Status UnbanPlayer(grpc::ServerContext* context, const v1::UnbanPlayerRequest* request,
                           v1::UnbanPlayerResponse*) override {
    const Subject subject = Instance(request->id(), absl::StrCat(" ", request->player_id()));
    return Answer(context, "InstanceService/UnbanPlayer", CallKind::kCommand, subject,
                  [&] { return plane_.Call([&](Cluster& cluster, Now) { return cluster.UnbanPlayer(*request); }); });
  }
  grpc::Status ListBans(grpc::ServerContext* context, const v1::ListBansRequest* request,
                        v1::ListBansResponse* response) override {
    return Answer(context, "InstanceService/ListBans", CallKind::kRead, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now) { return cluster.ListBans(*request); }), response);
    });
  }
  grpc::Status DeleteInstance(grpc::ServerContext* context, const v1::DeleteInstanceRequest* request,
                              v1::DeleteInstanceResponse* response) override {
    return Answer(context, "InstanceService/DeleteInstance", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.Call([&](Cluster& cluster, Now now) { return cluster.DeleteInstance(now, *request); }),
                  response->mutable_instance());
    });
  }
};

// The methods of InstanceService that send and take files in pieces.
class InstanceFilesImpl : public InstanceServiceImpl {
 public:
  using InstanceServiceImpl::InstanceServiceImpl;

  grpc::Status CheckpointInstance(grpc::ServerContext* context, const v1::CheckpointInstanceRequest* request,
                                  v1::CheckpointInstanceResponse* response) override {
    return Answer(context, "InstanceService/CheckpointInstance", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.CheckpointInstance(*request, [context] { return context->IsCancelled(); }),
                  response->mutable_checkpoint());
    });
  }
  grpc::Status ListCheckpoints(grpc::ServerContext* context, const v1::ListCheckpointsRequest* request,
                               v1::ListCheckpointsResponse* response) override {
    return Answer(context, "InstanceService/ListCheckpoints", CallKind::kRead, Instance(request->id()), [&] {
      return Take(
          plane_.Call([&](Cluster& cluster, Now) { return control::ListCheckpoints(cluster.state(), *request); }),
          response);
    });
  }
  grpc::Status RestoreInstance(grpc::ServerContext* context, const v1::RestoreInstanceRequest* request,
                               v1::RestoreInstanceResponse* response) override {
    return Answer(context, "InstanceService/RestoreInstance", CallKind::kCommand, Instance(request->id()),
                  [&] { return Take(plane_.RestoreInstance(*request), response); });
  }
  grpc::Status ExportCheckpoint(grpc::ServerContext* context, const v1::ExportCheckpointRequest* request,
                                grpc::ServerWriter<v1::ExportCheckpointResponse>* writer) override {
    return Answer(context, "InstanceService/ExportCheckpoint", CallKind::kCommand, Instance(request->id()),
                  [&]() -> absl::Status {
                    const auto bytes = plane_.ExportCheckpoint(*request);
                    if (!bytes.ok()) return bytes.status();
                    return SendPieces(*bytes, *writer);
                  });
  }
  grpc::Status ImportCheckpoint(grpc::ServerContext* context, grpc::ServerReader<v1::ImportCheckpointRequest>* reader,
                                v1::ImportCheckpointResponse* response) override {
    return Answer(context, "InstanceService/ImportCheckpoint", CallKind::kCommand, "", [&]() -> absl::Status {
      v1::ImportCheckpointRequest first;
      std::string bytes;
      const auto any = [](const v1::ImportCheckpointRequest&) { return absl::OkStatus(); };
      if (absl::Status status = ReadPieces(*reader, first, bytes, any); !status.ok()) return status;
      return Take(plane_.ImportCheckpoint(first, bytes, GuestsByDefault()), response->mutable_instance());
    });
  }
};

class SessionServiceImpl final : public v1::SessionService::Service, Answerer {
 public:
  using Answerer::Answerer;

  grpc::Status JoinInstance(grpc::ServerContext* context, const v1::JoinInstanceRequest* request,
                            v1::JoinInstanceResponse* response) override {
    return Answer(context, "SessionService/JoinInstance", CallKind::kCommand, Instance(request->instance_id()), [&] {
      const Caller caller = CallerOf(*context);
      if (caller.door == Door::kOperators && caller.role < v1::ROLE_OPERATOR && !request->viewer()) {
        return absl::PermissionDeniedError(
            absl::StrCat("viewer: token ", caller.token, " is a viewer's, which joins to watch and not to play"));
      }
      const absl::Status status =
          Take(plane_.Join(
                   *request, [context] { return context->IsCancelled(); }, caller.door == Door::kPlayers),
               response);
      metrics_.CountSession(status);
      return status;
    });
  }
  grpc::Status GetScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                        v1::GetSceneResponse* response) override {
    return Answer(context, "SessionService/GetScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
      const Caller caller = CallerOf(*context);
      const auto shown = [&](const std::string& id) { return CheckInstance(caller, id).ok(); };
      const std::string& hash = request->scene_hash();
      const bool may = HasAllInstances(caller) ||
                       plane_.Call([&](Cluster& cluster, Now) { return ShowsScene(cluster.state(), hash, shown); });
      if (!may) {
        return absl::NotFoundError(
            absl::StrCat("scene_hash: no instance that token ", caller.token, " is for uses it"));
      }
      return Take(plane_.SceneBytes(hash), response->mutable_scene());
    });
  }
  grpc::Status LeaveInstance(grpc::ServerContext* context, const v1::LeaveInstanceRequest* request,
                             v1::LeaveInstanceResponse*) override {
    return Answer(context, "SessionService/LeaveInstance", CallKind::kCommand, Instance(request->instance_id()),
                  [&] { return plane_.Call([&](Cluster& cluster, Now now) { return cluster.Leave(now, *request); }); });
  }
};

class AgentLinkServiceImpl final : public v1::AgentLinkService::Service, Answerer {
 public:
  using Answerer::Answerer;
  using Stream = grpc::ServerReaderWriter<v1::ControlMessage, v1::AgentMessage>;

  grpc::Status Attach(grpc::ServerContext* context, Stream* stream) override {
    v1::AgentMessage first;
    if (absl::Status status = ReadHello(context, stream, first); !status.ok()) return ToGrpc(status);
    bool is_attached = false;
    const absl::Status status = Serve(context, stream, first, is_attached);
    if (is_attached) {
      spdlog::info("agent gone from={} result={}{}", context->peer(), absl::StatusCodeToString(status.code()),
                   status.ok() ? "" : " error=" + LogValue(std::string(status.message())));
    } else if (const auto left_out = strangers_.Take(telemetry::LogThrottle::Clock::now())) {
      spdlog::warn("agent refused from={} result={} error={} more={}", context->peer(),
                   absl::StatusCodeToString(status.code()), LogValue(std::string(status.message())), *left_out);
    }
    return ToGrpc(status);
  }
  grpc::Status FetchScene(grpc::ServerContext* context, const v1::FetchSceneRequest* request,
                          v1::FetchSceneResponse* response) override {
    return Answer(
        context, "AgentLinkService/FetchScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
          const absl::Status may = CheckMayFetch(*context, *request, SceneKey(request->scene_hash()), "scene_hash");
          return may.ok() ? Take(plane_.SceneBytes(request->scene_hash()), response->mutable_scene()) : may;
        });
  }
  grpc::Status FetchGame(grpc::ServerContext* context, const v1::FetchGameRequest* request,
                         v1::FetchGameResponse* response) override {
    return Answer(context, "AgentLinkService/FetchGame", CallKind::kRead, request->game_hash(), [&]() -> absl::Status {
      const absl::Status may = CheckMayFetch(*context, *request, GameKey(request->game_hash()), "game_hash");
      return may.ok() ? Take(plane_.GameBytes(request->game_hash()), response->mutable_game()) : may;
    });
  }
  grpc::Status FetchState(grpc::ServerContext* context, const v1::FetchStateRequest* request,
                          grpc::ServerWriter<v1::FetchStateResponse>* writer) override {
    const std::string subject = absl::StrCat(request->instance_id(), "/", request->region(), " tick ", request->tick());
    return Answer(context, "AgentLinkService/FetchState", CallKind::kRead, subject, [&]() -> absl::Status {
      if (absl::Status status = CheckHostOf(*context, request->host_id()); !status.ok()) return status;
      const auto bytes = plane_.StateFile(*request);
      if (!bytes.ok()) return bytes.status();
      return SendPieces(*bytes, *writer);
    });
  }
  grpc::Status UploadCheckpoint(grpc::ServerContext* context, grpc::ServerReader<v1::UploadCheckpointRequest>* reader,
                                v1::UploadCheckpointResponse*) override {
    return Answer(context, "AgentLinkService/UploadCheckpoint", CallKind::kRead, "", [&]() -> absl::Status {
      v1::UploadCheckpointRequest first;
      std::string bytes;
      const auto wanted = [&](const v1::UploadCheckpointRequest& request) {
        if (absl::Status status = CheckHostOf(*context, request.host_id()); !status.ok()) return status;
        return plane_.Call([&](Cluster& cluster, Now) { return cluster.CheckUpload(request); });
      };
      if (absl::Status status = ReadPieces(*reader, first, bytes, wanted); !status.ok()) return status;
      return plane_.TakeUpload(first, bytes);
    });
  }

 private:
  // The certificate that a call shows must be of the host in whose name it is made; at the socket its secret suffices.
  absl::Status CheckHostOf(const grpc::ServerContext& context, const std::string& host_id) const {
    if (door_ == Door::kSocket || (!host_id.empty() && CallerOf(context).host_id == host_id)) return absl::OkStatus();
    return absl::UnauthenticatedError(absl::StrCat("host_id: the call shows no certificate of ",
                                                   host_id.empty() ? "a host" : OneLine(host_id, kMaxNameBytes)));
  }
  template <class Request>
  absl::Status CheckMayFetch(const grpc::ServerContext& context, const Request& request, const std::string& key,
                             const char* field) {
    if (absl::Status status = CheckHostOf(context, request.host_id()); !status.ok()) return status;
    return plane_.Call([&](Cluster& cluster, Now) {
      const ClusterState& state = cluster.state();
      const absl::Status known = CheckHostSecret(state, request.host_id(), request.host_secret());
      return known.ok() ? CheckMayFetchContent(state, request.host_id(), key, field) : known;
    });
  }

  // Those who have proved nothing yet are few at a time, and do not keep out who has.
  absl::Status ReadHello(grpc::ServerContext* context, Stream* stream, v1::AgentMessage& first) {
    std::unique_ptr<HelloDeadlines::Waiting> waiting;
    if (door_ != Door::kSocket && CallerOf(*context).host_id.empty()) {
      waiting = hellos_.Begin([context] { context->TryCancel(); });
      if (!waiting) return absl::ResourceExhaustedError("too many streams have not said who they are; try again");
    }
    const bool came = stream->Read(&first);
    if (waiting && !waiting->End()) return absl::DeadlineExceededError("no hello came in time");
    return came ? absl::OkStatus() : absl::CancelledError("no hello came");
  }

  // A host that joins by TLS asks for its certificate with the token; one that has joined shows it.
  absl::Status CheckProof(const grpc::ServerContext& context, const v1::AgentHello& hello) const {
    if (door_ == Door::kSocket) {
      return hello.certificate_request().empty()
                 ? absl::OkStatus()
                 : absl::InvalidArgumentError("hello.certificate_request: over a socket there are no certificates");
    }
    if (hello.join_token().empty()) return CheckHostOf(context, hello.host_id());
    if (hello.certificate_request().empty()) {
      return absl::InvalidArgumentError("hello.certificate_request: a host that joins by TLS needs a certificate");
    }
    return trust::CheckRequest(hello.certificate_request());
  }

  absl::Status AddCertificate(const v1::AgentHello& hello, const ControlPlane::AgentStream& agent,
                              v1::Admitted& admitted) const {
    if (agent.certificate_serial.empty()) return absl::OkStatus();
    auto certificate = trust::IssueClient(authority_->signer, hello.certificate_request(), admitted.host_id(),
                                          agent.certificate_serial);
    if (!certificate.ok()) return certificate.status();
    admitted.set_certificate(*std::move(certificate));
    admitted.set_authority(authority_->signer.certificate);
    return absl::OkStatus();
  }

  absl::Status Serve(grpc::ServerContext* context, Stream* stream, const v1::AgentMessage& first, bool& is_attached) {
    if (!first.has_hello()) return absl::InvalidArgumentError("hello: must be the first message of a stream");
    if (absl::Status status = CheckHello(first.hello()); !status.ok()) return status;
    if (absl::Status status = CheckProof(*context, first.hello()); !status.ok()) return status;
    const auto attached = plane_.Attach(first.hello(), [context] { context->TryCancel(); });
    if (!attached.ok()) return attached.status();
    is_attached = true;
    ControlPlane::AgentStream& agent = **attached;
    spdlog::info("agent attached host={} id={} from={} address={} workers={}", agent.admitted.host_name(),
                 agent.admitted.host_id(), context->peer(), LogValue(first.hello().advertise_address()),
                 first.hello().workers_size());
    v1::ControlMessage admitted;
    *admitted.mutable_admitted() = agent.admitted;
    absl::Status status = AddCertificate(first.hello(), agent, *admitted.mutable_admitted());
    if (status.ok() && stream->Write(admitted)) {
      std::thread writer([&] { WriteDesired(stream, agent); });
      status = ReadMessages(stream, agent);
      plane_.Detach(agent);
      writer.join();
    } else {
      plane_.Detach(agent);
    }
    return status;
  }
  void WriteDesired(Stream* stream, ControlPlane::AgentStream& agent) {
    while (const std::optional<v1::ControlMessage> message = plane_.NextMessage(agent)) {
      if (message->has_desired()) {
        spdlog::debug("desired set host={} revision={} workers={}", agent.admitted.host_name(),
                      message->desired().revision(), message->desired().workers_size());
      }
      if (!stream->Write(*message)) return;
    }
  }
  absl::Status ReadMessages(Stream* stream, ControlPlane::AgentStream& agent) {
    v1::AgentMessage message;
    while (stream->Read(&message)) {
      if (absl::Status status = plane_.HandleAgentMessage(agent, message); !status.ok()) return status;
    }
    return absl::OkStatus();
  }

  HelloDeadlines hellos_{kHelloPatience, kMaxSilentStreams};
};

}  // namespace

namespace {

// One door: a server of its own, since a call does not say at which address it came in.
struct DoorServer {
  DoorServer(Door door, ControlPlane& plane, ControlMetrics& metrics, const Authority* authority)
      : access(plane, metrics, door, authority),
        hosts(plane, metrics, door, authority),
        instances(plane, metrics, door, authority),
        sessions(plane, metrics, door, authority),
        agents(plane, metrics, door, authority) {}
  AccessServiceImpl access;
  HostServiceImpl hosts;
  InstanceFilesImpl instances;
  SessionServiceImpl sessions;
  AgentLinkServiceImpl agents;
  std::unique_ptr<grpc::Server> server;  // ends before what it serves
};

}  // namespace

struct GrpcServer::Impl {
  // `name`: in errors.
  absl::Status Open(Door door, const std::string& name, const std::string& address,
                    const std::shared_ptr<grpc::ServerCredentials>& credentials, int& port) {
    DoorServer& opened =
        *doors.emplace_back(std::make_unique<DoorServer>(door, *plane, *metrics, authority ? &*authority : nullptr));
    grpc::ServerBuilder builder;
    SetServerLimits(builder, door);
    builder.AddListeningPort(address, credentials, &port);
    for (grpc::Service* service : std::initializer_list<grpc::Service*>{
             &opened.access, &opened.hosts, &opened.instances, &opened.sessions, &opened.agents}) {
      builder.RegisterService(service);
    }
    opened.server = builder.BuildAndStart();
    if (!opened.server)
      return absl::UnavailableError(absl::StrCat("address ", address, " cannot be bound (", name, ")"));
    for (const char* service : {v1::AccessService::service_full_name(), v1::HostService::service_full_name(),
                                v1::InstanceService::service_full_name(), v1::SessionService::service_full_name(),
                                v1::AgentLinkService::service_full_name()}) {
      opened.server->GetHealthCheckService()->SetServingStatus(service, true);
    }
    return absl::OkStatus();
  }
  // The address as bound; empty: there is to be none.
  absl::StatusOr<std::string> OpenTcp(Door door, const std::string& name, const std::string& text) {
    if (text.empty()) return "";
    auto address = host::ParseSocketAddress(text, host::PortRule::kFrom0);
    if (!address.ok()) return address.status();
    if (!authority) return absl::InternalError("a door that speaks TLS needs an authority");
    if (absl::Status status = host::CheckBindable(*address, name); !status.ok()) return status;
    const auto credentials = TlsCredentials(door, *authority, *plane);
    if (!credentials.ok()) return credentials.status();
    int port = 0;
    if (absl::Status status = Open(door, name, ToString(*address), *credentials, port); !status.ok()) return status;
    address->port = static_cast<std::uint16_t>(port);
    return ToString(*address);
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

  auto operators = impl.OpenTcp(Door::kOperators, "grpc", doors.operators);
  if (!operators.ok()) return operators.status();
  auto players = impl.OpenTcp(Door::kPlayers, "players", doors.players);
  if (!players.ok()) return players.status();
  if (absl::Status status = PrepareSocket(doors.socket); !status.ok()) return status;
  result->socket_ = kSocketPrefix + doors.socket;
  int ignored = 0;
  absl::Status status = impl.Open(Door::kSocket, "grpc", result->socket_, grpc::InsecureServerCredentials(), ignored);
  if (status.ok()) status = CloseToOthers(doors.socket);
  if (!status.ok()) return status;
  result->operators_ = *std::move(operators);
  result->players_ = *std::move(players);
  return result;
}

GrpcServer::~GrpcServer() {
  if (!impl_) return;
  const auto deadline = std::chrono::system_clock::now() + kShutdownPatience;
  for (const auto& door : impl_->doors) {
    if (!door->server) continue;
    door->server->GetHealthCheckService()->SetServingStatus(false);
    door->server->Shutdown(deadline);
  }
}

}  // namespace tessera::control

// InstanceFilesImpl: InstanceService at one door; the methods that send and take files in pieces are in the derived
// class. Thread rule: as Answerer.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/services/answerer.h"
#include "tessera/v1/instance.grpc.pb.h"

namespace tessera::control {

// Strangers see who plays by name, as everybody in the world does, and not as whom they log in elsewhere.
inline void HideAccounts(v1::Instance& instance) {
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

  // Whoever may open the socket plays alone or with friends; elsewhere players prove who they are unless the request
  // lets guests in.
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
          Take(plane_.Ask([&](const ClusterState& state) { return control::GetInstance(state, request->id()); }),
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
      return Take(plane_.Ask([&](const ClusterState& state) { return control::ListInstances(state, *request, shown); }),
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
      return Take(plane_.Ask([&](const ClusterState& state) { return control::ListCheckpoints(state, *request); }),
                  response);
    });
  }
  grpc::Status RestoreInstance(grpc::ServerContext* context, const v1::RestoreInstanceRequest* request,
                               v1::RestoreInstanceResponse* response) override {
    return Answer(context, "InstanceService/RestoreInstance", CallKind::kCommand, Instance(request->id()),
                  [&] { return Take(plane_.RestoreInstance(*request), response); });
  }
  grpc::Status UpgradeInstance(grpc::ServerContext* context, const v1::UpgradeInstanceRequest* request,
                               v1::UpgradeInstanceResponse* response) override {
    return Answer(context, "InstanceService/UpgradeInstance", CallKind::kCommand, Instance(request->id()), [&] {
      return Take(plane_.UpgradeInstance(*request, [context] { return context->IsCancelled(); }), response);
    });
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
  // For ImportCheckpoint.
  grpc::Status ReceiveImport(grpc::ServerContext* context, grpc::ServerReader<grpc::ByteBuffer>* stream,
                             v1::ImportCheckpointResponse* response) {
    static constexpr char kMethod[] = "InstanceService/ImportCheckpoint";
    return Answer(context, kMethod, CallKind::kCommand, "", [&]() -> absl::Status {
      auto reader = PiecesOf<v1::ImportCheckpointRequest>(*context, *stream, kMethod);
      v1::ImportCheckpointRequest first;
      const auto any = [](const v1::ImportCheckpointRequest&) { return absl::StatusOr<std::uint64_t>(kMaxStateBytes); };
      const auto draft = ReadPieces(reader, plane_, first, any);
      if (!draft.ok()) return draft.status();
      return Take(plane_.ImportCheckpoint(first, *draft, GuestsByDefault()), response->mutable_instance());
    });
  }
  // For PutScene.
  grpc::Status ReceiveScene(grpc::ServerContext* context, grpc::ServerReader<grpc::ByteBuffer>* stream,
                            v1::PutSceneResponse*) {
    static constexpr char kMethod[] = "InstanceService/PutScene";
    return Answer(context, kMethod, CallKind::kCommand, "", [&]() -> absl::Status {
      auto reader = PiecesOf<v1::PutSceneRequest>(*context, *stream, kMethod);
      v1::PutSceneRequest first;
      std::optional<WaitingScenes::Place> place;
      const auto wanted = [&](const v1::PutSceneRequest& request) -> absl::StatusOr<std::uint64_t> {
        auto begun = plane_.BeginScene(request.scene_hash(), request.size());
        if (!begun.ok()) return begun.status();
        place.emplace(*std::move(begun));
        return request.size();
      };
      auto draft = ReadPieces(reader, plane_, first, wanted);
      if (absl::IsAlreadyExists(draft.status())) return absl::OkStatus();
      if (!draft.ok()) return draft.status();
      return plane_.KeepScene(*place, *std::move(draft));
    });
  }
  StreamHandlers Streams() {
    StreamHandlers streams;
    streams["ImportCheckpoint"] = ClientStream(this, &InstanceFilesImpl::ReceiveImport);
    streams["PutScene"] = ClientStream(this, &InstanceFilesImpl::ReceiveScene);
    return streams;
  }
};

}  // namespace tessera::control

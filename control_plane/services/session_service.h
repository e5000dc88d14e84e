// SessionServiceImpl: SessionService at one door. Thread rule: as Answerer.
#pragma once

#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/counted_address.h"
#include "control_plane/retry_after.h"
#include "control_plane/services/answerer.h"
#include "tessera/v1/session.grpc.pb.h"

namespace tessera::control {

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
      std::optional<std::string> stranger;
      if (caller.door == Door::kPlayers) stranger = CountedPeer(context->peer());
      const absl::Status status = Take(plane_.Join(
                                           *request, [context] { return context->IsCancelled(); }, stranger),
                                       response);
      if (const auto wait = RetryAfterOf(status)) {
        context->AddTrailingMetadata(kRetryAfterHeader, std::to_string(wait->count()));
      }
      metrics_.CountSession(status);
      return status;
    });
  }
  grpc::Status GetScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                        v1::GetSceneResponse* response) override {
    return Answer(context, "SessionService/GetScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
      const absl::Status may = CheckMayGet(CallerOf(*context), request->scene_hash());
      return may.ok() ? Take(plane_.SceneBytes(request->scene_hash()), response->mutable_scene()) : may;
    });
  }
  grpc::Status StreamScene(grpc::ServerContext* context, const v1::GetSceneRequest* request,
                           grpc::ServerWriter<v1::GetSceneResponse>* writer) override {
    return Answer(context, "SessionService/StreamScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
      if (absl::Status may = CheckMayGet(CallerOf(*context), request->scene_hash()); !may.ok()) return may;
      const auto bytes = plane_.SceneBytes(request->scene_hash());
      return bytes.ok() ? SendScene(*bytes, *writer) : bytes.status();
    });
  }
  grpc::Status LeaveInstance(grpc::ServerContext* context, const v1::LeaveInstanceRequest* request,
                             v1::LeaveInstanceResponse*) override {
    return Answer(context, "SessionService/LeaveInstance", CallKind::kCommand, Instance(request->instance_id()), [&] {
      return plane_.CallOfPlayer([&](Cluster& cluster, Now now) { return cluster.Leave(now, *request); });
    });
  }

 private:
  absl::Status CheckMayGet(const Caller& caller, const std::string& hash) {
    const auto shown = [&](const std::string& id) { return CheckInstance(caller, id).ok(); };
    const bool may = HasAllInstances(caller) ||
                     plane_.Call([&](Cluster& cluster, Now) { return ShowsScene(cluster.state(), hash, shown); });
    if (may) return absl::OkStatus();
    return absl::NotFoundError(absl::StrCat("scene_hash: no instance that token ", caller.token, " is for uses it"));
  }
};

}  // namespace tessera::control

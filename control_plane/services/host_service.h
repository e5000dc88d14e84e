// HostServiceImpl: HostService at one door. Thread rule: as Answerer.
#pragma once

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/queries.h"
#include "control_plane/services/answerer.h"
#include "tessera/v1/host.grpc.pb.h"

namespace tessera::control {

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
      return Take(plane_.Ask([&](const ClusterState& state) { return control::ListHosts(state, *request); }), response);
    });
  }
  grpc::Status GetHost(grpc::ServerContext* context, const v1::GetHostRequest* request,
                       v1::GetHostResponse* response) override {
    return Answer(context, "HostService/GetHost", CallKind::kRead, request->name(), [&] {
      return Take(plane_.Ask([&](const ClusterState& state) { return control::GetHost(state, *request); }), response);
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

}  // namespace tessera::control

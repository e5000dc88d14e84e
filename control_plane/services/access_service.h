// AccessServiceImpl: AccessService at one door. Thread rule: as Answerer.
#pragma once

#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "control_plane/services/answerer.h"
#include "tessera/v1/access.grpc.pb.h"

namespace tessera::control {

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
    return Answer(context, "AccessService/RevokeToken", CallKind::kCommand, request->name(), [&] {
      return plane_.Call([&](Cluster& cluster, Now now) { return cluster.RevokeToken(now, *request); });
    });
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

}  // namespace tessera::control

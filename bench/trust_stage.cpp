#include "bench/trust_stage.h"

#include "local_cluster/instance_state.h"
#include "local_cluster/scene_file.h"

namespace tessera::bench {
namespace {

constexpr std::chrono::seconds kStagePatience{60};

}  // namespace

TrustStage::TrustStage()
    : cluster_(std::make_unique<local::LocalCluster>(local::LocalClusterOptions{
          .state_dir = folder_.path(), .listen = "127.0.0.1:0", .players_listen = "127.0.0.1:0", .capacity = 8})),
      connection_(std::make_unique<local::Connection>(cluster_->control_address())) {
  const auto authority = connection_->Call("cluster authority", connection_->access(),
                                           &v1::AccessService::Stub::GetAuthority, v1::GetAuthorityRequest());
  target_ = {.socket = cluster_->control_address(),
             .operators = cluster_->operators_address() + "#" + authority.fingerprint(),
             .players = cluster_->players_address() + "#" + authority.fingerprint()};
}

std::string TrustStage::OperatorsToken() {
  v1::CreateTokenRequest request;
  request.set_name("bench");
  request.set_role(v1::ROLE_OPERATOR);
  return connection_->Call("token create", connection_->access(), &v1::AccessService::Stub::CreateToken, request)
      .secret();
}

std::string TrustStage::CreateWorld(bool lazy) {
  v1::CreateInstanceRequest request;
  constexpr std::uint32_t kBodies = 20, kNeverAll = 1000;
  *request.mutable_spec()->mutable_scene() = local::LoadScene(local::FindScene("plaza"), kBodies).message;
  request.mutable_spec()->set_regions(2);
  request.mutable_spec()->set_lazy(lazy);
  if (lazy) request.mutable_spec()->set_expected_players(kNeverAll);
  const std::string id = connection_
                             ->Call("instance create", connection_->instances(),
                                    &v1::InstanceService::Stub::CreateInstance, request, kStagePatience)
                             .instance()
                             .id();
  if (!lazy) local::WaitUntilSettled(*connection_, id, kStagePatience);
  return id;
}

void TrustStage::DeleteWorld(const std::string& id) {
  v1::DeleteInstanceRequest request;
  request.set_id(id);
  connection_->Call("instance delete", connection_->instances(), &v1::InstanceService::Stub::DeleteInstance, request,
                    kStagePatience);
  local::WaitUntilEnded(*connection_, id, kStagePatience);
}

}  // namespace tessera::bench

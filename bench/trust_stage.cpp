#include "bench/trust_stage.h"

#include <cmath>
#include <utility>

#include "bench/scrape.h"
#include "core/world/scene_io.h"
#include "local_cluster/command_error.h"
#include "local_cluster/instance_state.h"
#include "local_cluster/scene_file.h"
#include "telemetry/http_get.h"

namespace tessera::bench {
namespace {

constexpr std::chrono::seconds kStagePatience{60};
constexpr double kPlace_m = 2;  // between two players

constexpr char kSquare[] = R"(
name: "square" view { radius: 40 }
bodies { id: 1 motion: MOTION_STATIC shape { plane { normal { y: 1 } } } }
player { body { mass: 20 shape { sphere { radius: 0.5 } } } max_force: 300 max_speed: 12 }
)";

// A floor on which as many players have a place of their own.
v1::Scene SquareFor(std::uint32_t players) {
  v1::Scene scene = *ParseScene(kSquare, "square");
  const auto side = static_cast<std::uint32_t>(std::ceil(std::sqrt(players)));
  const double half_m = kPlace_m * side / 2;
  for (std::uint32_t i = 0; i < players; ++i) {
    v1::Vec3& place = *scene.mutable_player()->add_spawn_points();
    place.set_x(kPlace_m * (i % side + 0.5) - half_m);
    place.set_y(0.5);
    place.set_z(kPlace_m * (i / side + 0.5) - half_m);
  }
  const auto set = [](v1::Vec3& corner, double horizontal, double y) {
    corner.set_x(horizontal);
    corner.set_y(y);
    corner.set_z(horizontal);
  };
  set(*scene.mutable_bounds()->mutable_min(), -half_m, -10);
  set(*scene.mutable_bounds()->mutable_max(), half_m, 50);
  return scene;
}

}  // namespace

TrustStage::TrustStage(std::vector<std::string> control_arguments)
    : cluster_(std::make_unique<local::LocalCluster>(
          local::LocalClusterOptions{.state_dir = folder_.path(),
                                     .listen = "127.0.0.1:0",
                                     .players_listen = "127.0.0.1:0",
                                     .capacity = 8,
                                     .control_arguments = std::move(control_arguments)})),
      connection_(std::make_unique<local::Connection>(cluster_->control_address())) {
  const auto authority = connection_->Call("cluster authority", connection_->access(),
                                           &v1::AccessService::Stub::GetAuthority, v1::GetAuthorityRequest());
  target_ = {.socket = cluster_->control_address(),
             .operators = cluster_->operators_address() + "#" + authority.fingerprint(),
             .players = cluster_->players_address() + "#" + authority.fingerprint()};
}

double TrustStage::HeapMegabytes() const {
  const telemetry::HttpAnswer answer = local::OrThrow(telemetry::HttpGet(cluster_->http_address(), "/metrics"));
  return ParseMetrics(answer.body).at("tessera_control_heap_bytes") / 1e6;
}

std::string TrustStage::OperatorsToken() {
  v1::CreateTokenRequest request;
  request.set_name("bench");
  request.set_role(v1::ROLE_OPERATOR);
  return connection_->Call("token create", connection_->access(), &v1::AccessService::Stub::CreateToken, request)
      .secret();
}

std::string TrustStage::CreateWorld(bool lazy) {
  v1::InstanceSpec spec;
  constexpr std::uint32_t kBodies = 20, kNeverAll = 1000;
  *spec.mutable_scene() = local::LoadScene(local::FindScene("plaza"), kBodies).message;
  spec.set_regions(2);
  spec.set_lazy(lazy);
  if (lazy) spec.set_expected_players(kNeverAll);
  return Create(spec);
}

std::string TrustStage::CreateWorldFor(std::uint32_t players) {
  v1::InstanceSpec spec;
  *spec.mutable_scene() = SquareFor(players);
  spec.set_regions(4);
  spec.set_max_players(players);
  spec.mutable_leaver_grace()->set_seconds(3600);
  return Create(spec);
}

std::string TrustStage::Create(const v1::InstanceSpec& spec) {
  v1::CreateInstanceRequest request;
  *request.mutable_spec() = spec;
  const std::string id = connection_
                             ->Call("instance create", connection_->instances(),
                                    &v1::InstanceService::Stub::CreateInstance, request, kStagePatience)
                             .instance()
                             .id();
  if (!spec.lazy()) local::WaitUntilSettled(*connection_, id, kStagePatience);
  return id;
}

v1::Instance TrustStage::World(const std::string& id) {
  v1::GetInstanceRequest request;
  request.set_id(id);
  return connection_
      ->Call("instance get", connection_->instances(), &v1::InstanceService::Stub::GetInstance, request, kStagePatience)
      .instance();
}

void TrustStage::DeleteWorld(const std::string& id) {
  v1::DeleteInstanceRequest request;
  request.set_id(id);
  connection_->Call("instance delete", connection_->instances(), &v1::InstanceService::Stub::DeleteInstance, request,
                    kStagePatience);
  local::WaitUntilEnded(*connection_, id, kStagePatience);
}

}  // namespace tessera::bench

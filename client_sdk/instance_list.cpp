#include "client_sdk/instance_list.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::client {
namespace {

// The longest text that is shown: ids and names of scenes and games are shorter.
constexpr std::size_t kMostTextBytes = 63;
constexpr std::size_t kMostAsked = 16;  // worlds whose players are asked for, one call each

std::string Shortened(const std::string& text) { return text.substr(0, kMostTextBytes); }

ListedInstance ListedFrom(const v1::Instance& instance) {
  ListedInstance listed{.id = Shortened(instance.id()),
                        .scene = Shortened(instance.scene_name()),
                        .game = Shortened(instance.game_name()),
                        .state = static_cast<std::uint8_t>(instance.state()),
                        .regions = instance.regions(),
                        .players = instance.players(),
                        .expected_players = instance.expected_players()};
  for (const v1::Player& player : instance.player_list()) {
    if (player.left() || listed.names.size() == kMostListedNames) continue;
    listed.names.push_back(player.name().empty() ? absl::StrCat("player ", player.number()) : Shortened(player.name()));
  }
  return listed;
}

// A list leaves out who is in; somebody who waits wants to know. An instance that has gone meanwhile keeps none.
void AddNames(v1::InstanceService::Stub& stub, std::chrono::system_clock::time_point until, v1::Instance& instance) {
  grpc::ClientContext context;
  context.set_deadline(until);
  v1::GetInstanceRequest request;
  request.set_id(instance.id());
  v1::GetInstanceResponse response;
  if (!stub.GetInstance(&context, request, &response).ok()) return;
  instance.mutable_player_list()->Swap(response.mutable_instance()->mutable_player_list());
}

}  // namespace

absl::StatusOr<std::vector<ListedInstance>> ListInstances(const std::string& control_address,
                                                          std::chrono::milliseconds deadline) {
  const auto channel = trust::Dial(control_address);
  if (!channel.ok()) return channel.status();
  const auto stub = v1::InstanceService::NewStub(*channel);
  const auto until = std::chrono::system_clock::now() + deadline;
  std::vector<ListedInstance> listed;
  std::string page;
  std::size_t asked = 0;
  do {
    grpc::ClientContext context;
    context.set_deadline(until);
    v1::ListInstancesRequest request;
    request.set_page_token(page);
    v1::ListInstancesResponse response;
    if (const grpc::Status status = stub->ListInstances(&context, request, &response); !status.ok()) {
      return absl::Status(static_cast<absl::StatusCode>(status.error_code()),
                          absl::StrCat("control plane at ", control_address, ": ", status.error_message()));
    }
    for (v1::Instance& instance : *response.mutable_instances()) {
      if (listed.size() == kMostListed) break;
      if (instance.state() == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS && asked < kMostAsked) {
        ++asked;
        AddNames(*stub, until, instance);
      }
      listed.push_back(ListedFrom(instance));
    }
    if (response.instances().empty()) break;
    page = response.next_page_token();
  } while (!page.empty() && listed.size() < kMostListed);
  return listed;
}

}  // namespace tessera::client

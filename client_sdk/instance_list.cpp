#include "client_sdk/instance_list.h"

#include <grpcpp/grpcpp.h>

#include "absl/strings/str_cat.h"
#include "tessera/v1/instance.grpc.pb.h"

namespace tessera::client {
namespace {

// What a shown text may have: ids and names of scenes and games are shorter.
constexpr std::size_t kMostTextBytes = 63;

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

}  // namespace

absl::StatusOr<std::vector<ListedInstance>> ListInstances(const std::string& control_address,
                                                          std::chrono::milliseconds deadline) {
  const auto stub =
      v1::InstanceService::NewStub(grpc::CreateChannel(control_address, grpc::InsecureChannelCredentials()));
  const auto until = std::chrono::system_clock::now() + deadline;
  std::vector<ListedInstance> listed;
  std::string page;
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
    for (const v1::Instance& instance : response.instances()) {
      if (listed.size() < kMostListed) listed.push_back(ListedFrom(instance));
    }
    if (response.instances().empty()) break;
    page = response.next_page_token();
  } while (!page.empty() && listed.size() < kMostListed);
  return listed;
}

}  // namespace tessera::client

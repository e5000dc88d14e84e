// GameMessages: messages of games' backends, on their way to the regions. They are in the orders of all workers of an
// instance until one of them answers.
//
// A message is stored with the request id that its caller gave before any order names it, and its outcome before
// anybody hears of it; so a request that is made again, to this control plane or the next one, is the same message. The
// newest kMaxGameRequestsKept requests of an instance are known. Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/now.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class GameMessages {
 public:
  explicit GameMessages(ClusterState& state) : state_(state) {}
  // Reads what is stored. DATA_LOSS names the key that cannot be read.
  absl::Status Load();

  // The number of the message with this request id; 0: there is none yet.
  std::uint64_t Find(const InstanceEntry& instance, const std::string& request_id) const;
  // The number of a new message, which the workers are asked to take until one answers; 0: only checked. Errors name
  // the field. The instance runs a game.
  absl::StatusOr<std::uint64_t> Add(InstanceEntry& instance, const v1::SendToGameRequest& request, Now now);
  // Nothing until a worker has answered. ABORTED: the instance does not run any more.
  std::optional<absl::Status> Outcome(const std::string& id, std::uint64_t number) const;

  void TakeAnswers(InstanceEntry& instance, const v1::WorkerReport& report);
  // Gives up what no region has taken for kGameMessagePatience.
  void Expire(InstanceEntry& instance, Now now);
  // Those without an answer, ascending by number.
  std::vector<v1::BackendMessage> Unanswered(const InstanceEntry& instance) const;
  void Forget(std::uint64_t instance);

 private:
  struct Sent {
    records::GameMessage record;
    Revision revision = kAbsent;
  };
  struct Box {
    std::map<std::uint64_t, Sent> sent;               // by number
    std::map<std::string, std::uint64_t> by_request;  // every one in `sent`
    std::size_t waiting = 0;                          // without an answer
  };
  void Answer(InstanceEntry& instance, Box& box, Sent& sent, const std::string& refused);

  ClusterState& state_;
  std::map<std::uint64_t, Box> boxes_;  // by the instance's number
};

}  // namespace tessera::control

// InstancePlayers: who may play in an instance: joining, coming back, leaving, and vanishing without having left.
//
// A join first waits (`BeginWait`), which is what starts a lazy instance, until `CanJoin`; then `Join` and `EndWait`,
// in one go. A player who has left is in the orders until all workers know, and a while longer.
//
// A joining player is a guest, where instances take them, or shows a ticket, which the caller has checked (tickets.h),
// or comes back by a credential. Players with tickets are known by id: one who is there comes back as the same.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
#include "control_plane/guest_rates.h"
#include "control_plane/now.h"
#include "net/token_bucket.h"
#include "tessera/v1/session.pb.h"
#include "trust/ticket.h"

namespace tessera::control {

struct Joined {
  v1::JoinInstanceResponse response;
  std::uint64_t mark = 0;  // for AllKnow
};

class InstancePlayers {
 public:
  InstancePlayers(ClusterState& state, const ControlSettings& settings)
      : state_(state), settings_(settings), guests_(settings.guests) {}
  void Forget(std::uint64_t number) {
    known_.erase(number);
    guests_.Forget(number);
  }

  // Counts a stranger who is to join without a ticket; see GuestRates for errors. One too many for a full world is not
  // counted: it is refused later.
  absl::Status TakeGuest(const InstanceEntry& instance, bool viewer, const std::string& address, Now now);

  // The instance that the join waits for; it may start because of it, but for a viewer's, which is not counted. Errors
  // name the field.
  absl::StatusOr<InstanceEntry*> BeginWait(const v1::JoinInstanceRequest& request);
  // Null: the instance is not there any more.
  InstanceEntry* EndWait(const std::string& instance_id);
  int Waiting(const InstanceEntry& instance) const;

  // A player with a credential of its own comes back as the one it was, of the next generation. A viewer is given a
  // number, and not kept; a stranger's is of those that regions serve fewer of. `ticket`: the one of the request,
  // checked and used; null: it has none.
  absl::StatusOr<Joined> Join(const v1::JoinInstanceRequest& request, const trust::Ticket* ticket, Now now,
                              bool stranger = false);
  // Repeating it is fine.
  absl::Status Leave(const v1::LeaveInstanceRequest& request, Now now);

  // The player has left, and its client is sent the reason. NOT_FOUND: it is not there.
  absl::StatusOr<std::uint32_t> Kick(InstanceEntry& instance, std::uint32_t number, const std::string& reason, Now now);

  // A worker reports whom the game has refused or kicked: they have left. Repeating it is fine.
  void TakeEnded(InstanceEntry& instance, const v1::WorkerReport& report, Now now);

  // The next players of a RUNNING instance of which some vanished or came back, by its policy; nothing if nobody did.
  // A player who never was connected has left after the grace whatever the policy. A grace counts from when the last
  // connection was seen; in a new life of the control plane, from its beginning. All players are looked at when others
  // are connected, and every kVanishedInterval: not for each that joins.
  std::optional<Players> NextVanished(const InstanceEntry& instance, Now now);
  // Time passes: forgets players who left, so that a world with much coming and going stays small.
  void Prune(InstanceEntry& instance, Now now);

 private:
  struct Left {
    std::uint64_t mark = 0;  // orders after this revision say so
    Steady since{0};
  };
  // Not stored: counted anew by a new life of the control plane.
  struct Known {
    int waiting = 0;                         // joins that wait for the workers
    std::map<std::uint32_t, Steady> unseen;  // players without a connection, and since when
    std::map<std::uint32_t, Left> left;
    std::map<std::uint32_t, net::TokenBucket> returns;  // players who came back lately
    std::optional<Steady> looked_at{};                  // for who vanished; none: never, or nobody could say
    std::uint64_t connections = 0;                      // InstanceEntry::connections of then
  };

  using Fates = std::map<std::string, std::vector<std::uint32_t>>;  // by what became of them: players' numbers

  absl::StatusOr<v1::Player> Add(InstanceEntry& instance, const std::string& name, const trust::Ticket* ticket,
                                 Now now);
  absl::StatusOr<v1::Player> Return(InstanceEntry& instance, std::uint32_t number, Now now);
  absl::Status TakeReturn(const InstanceEntry& instance, std::uint32_t number, Now now);
  void LogFates(const InstanceEntry& instance, const Fates& fates);
  absl::Status StoreJoined(InstanceEntry& instance, std::uint32_t number, const Players& players);
  absl::Status Store(InstanceEntry& instance, const Players& players);

  ClusterState& state_;
  ControlSettings settings_;
  std::map<std::uint64_t, Known> known_;  // by instance number
  GuestRates guests_;
};

// UNAUTHENTICATED unless the request may be made without a ticket: the instance takes guests, or it shows a credential,
// or it is a viewer's and not a stranger's. INVALID_ARGUMENT: it shows a ticket, and what does not go with one.
absl::Status CheckGuest(const records::Instance& record, const v1::JoinInstanceRequest& request, bool stranger);
// RESOURCE_EXHAUSTED unless there is room for one more. Who comes back has a place.
absl::Status CheckRoom(const InstanceEntry& instance);
// The id of the player with this number. NOT_FOUND: it is not there; FAILED_PRECONDITION: it is a guest, and has none.
absl::StatusOr<std::string> PlayerIdOf(const InstanceEntry& instance, std::uint32_t number);

// False: not all workers are bound yet. An error: it will never be.
absl::StatusOr<bool> CanJoin(const ClusterState& state, const std::string& instance_id, bool viewer = false);
// True once every worker of the instance has acted on an order made after `mark`.
bool AllKnow(const ClusterState& state, const std::string& instance_id, std::uint64_t mark);
// How many players every worker has a connection of.
int ConnectedEverywhere(const InstanceEntry& instance);

}  // namespace tessera::control

// Requests to a control plane's players' door in JSON: to let a player in, to let it go, and which worlds there are
// (docs/tickets.md). For development and for programs that are no game; with libcurl and without gRPC.
//
// Nothing that a door answers is taken unread: lengths and forms are checked, and an error names the field.
//
// One of several control planes leads. They are asked in order, the next one where a door is not reached or says that
// it cannot serve, all within one deadline; each but the last has a share of the time to be reached in, and none longer
// than kReachPatience. A request that may have been carried out is not made again. When none serves, the error says why
// of each, with the code of the last: "no control plane of one:7704, two:7704 serves: one:7704: ...; two:7704: ...".
//
// Thread rule: any thread; calls wait for the answer, up to their deadline.
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/connect/door_address.h"

namespace tessera::client {

// `ticket`: from a game's backend, in place of a name and of `returning`; empty: a guest. `returning`: a return token,
// to come back as the same player. `watch`: as a viewer.
struct DoorJoin {
  std::string instance_id, player_name, ticket;
  std::span<const std::uint8_t> returning;
  bool watch = false;
  std::chrono::milliseconds deadline{};
};

// The join grant. INVALID_ARGUMENT names what a ticket excludes; NOT_FOUND: "instance inst-7: no such instance"; what
// else the door says, with its code; INTERNAL "the control plane's answer: ..."; and AskDoor's errors.
absl::StatusOr<std::vector<std::uint8_t>> JoinByDoor(const std::vector<DoorAddress>& doors, const DoorJoin& join);
absl::Status LeaveByDoor(const std::vector<DoorAddress>& doors, const std::string& instance_id,
                         std::span<const std::uint8_t> token, std::chrono::milliseconds deadline);

struct DoorInstance {
  std::string id, scene, game;  // at most kMostDoorText bytes each
  std::uint8_t state = 0;       // tessera.v1.InstanceState
  std::uint32_t regions = 0, players = 0, expected_players = 0;
  std::vector<std::string> names{};  // players who are in, at most kMostDoorNames; for the first worlds that wait
};
inline constexpr std::size_t kMostDoorInstances = 256, kMostDoorNames = 16, kMostDoorText = 63;

// In the control plane's order, those that have ended too; at most kMostDoorInstances.
absl::StatusOr<std::vector<DoorInstance>> ListByDoor(const std::vector<DoorAddress>& doors,
                                                     std::chrono::milliseconds deadline);

// Long enough for a connection by TLS over a bad network.
inline constexpr std::chrono::milliseconds kReachPatience{2000};

}  // namespace tessera::client

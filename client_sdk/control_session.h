// A client's requests to the control plane: for programs of this repository and for development, over gRPC. What a game
// ships joins by a grant and has none of it.
//
// Calls wait, up to their deadline. Thread rule: any thread; no state but the cache of scenes, which is locked.
#pragma once

#include <chrono>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client_sdk/session.h"
#include "trust/credentials.h"

namespace tessera::client {

// A scene that this process has had before, by its hash, is not fetched again. `returning`: a return token that the
// player had before, to come back as the same one; empty for a new one. `watch`: as a viewer. `ticket`: from a game's
// backend, instead of a name and of `returning`; empty: a guest. INVALID_ARGUMENT names what a ticket excludes.
struct JoinCall {
  std::string instance_id, player_name, ticket;
  std::span<const std::uint8_t> returning;
  bool watch = false;
  std::chrono::milliseconds deadline{};
};
absl::StatusOr<Session> JoinInstance(const trust::ControlPoint& control, const JoinCall& call);
absl::Status LeaveInstance(const trust::ControlPoint& control, const std::string& instance_id,
                           const net::Credentials& credentials, std::chrono::milliseconds deadline);

}  // namespace tessera::client

// Joining through the control plane, over gRPC: for programs that have both.
#include "client_sdk/client_impl.h"
#include "client_sdk/control_session.h"
#include "net/join_grant.h"

namespace tessera::client {
namespace {

JoinCall CallOf(const JoinOptions& options) {
  return {.instance_id = options.instance_id,
          .player_name = options.player_name,
          .ticket = options.ticket,
          .returning = options.returning,
          .watch = options.watch,
          .deadline = options.deadline};
}

}  // namespace

absl::StatusOr<std::unique_ptr<Client>> Client::Join(const JoinOptions& options) {
  const trust::ControlPoint control(options.control_address, options.credentials);
  absl::StatusOr<Session> session = JoinInstance(control, CallOf(options));
  if (!session.ok()) return session.status();
  const auto leave = [control, id = options.instance_id](const net::Credentials& credentials,
                                                         std::chrono::milliseconds deadline) {
    return LeaveInstance(control, id, credentials, deadline);
  };
  return Begin({.instance_id = options.instance_id,
                .deadline = options.deadline,
                .bind_address = options.bind_address,
                .network = options.network,
                .predict = options.predict,
                .returning = !options.returning.empty(),
                .by_grant = false,
                .scene_cache_dir = {},
                .leave = leave},
               *std::move(session));
}

absl::StatusOr<std::vector<std::uint8_t>> Client::GetGrant(const JoinOptions& options) {
  const trust::ControlPoint control(options.control_address, options.credentials);
  const absl::StatusOr<Session> session = JoinInstance(control, CallOf(options));
  if (!session.ok()) return session.status();
  return net::EncodeJoinGrant(GrantFrom(*session));
}

}  // namespace tessera::client

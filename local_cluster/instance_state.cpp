#include "local_cluster/instance_state.h"

#include <fmt/format.h>

#include <functional>

#include "local_cluster/connection.h"

namespace tessera::local {
namespace {

using Predicate = std::function<bool(v1::InstanceState)>;

bool Over(v1::InstanceState state) { return state == v1::INSTANCE_STATE_ENDED || state == v1::INSTANCE_STATE_FAILED; }

v1::Instance WatchUntil(Connection& connection, const std::string& id, std::chrono::milliseconds timeout,
                        const Predicate& done) {
  v1::WatchInstanceRequest request;
  request.set_id(id);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  const auto stream = connection.instances().WatchInstance(&context, request);
  v1::WatchInstanceResponse response;
  while (stream->Read(&response)) {
    if (!done(response.instance().state())) continue;
    context.TryCancel();
    while (stream->Read(&response)) {
    }
    stream->Finish();
    return response.instance();
  }
  const grpc::Status status = stream->Finish();
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) {
    throw CommandError(fmt::format("instance/{} is still {} after {:.1f} s; 'tessera instance describe {}' shows why",
                                   id, InstanceStateName(response.instance()),
                                   static_cast<double>(timeout.count()) / 1e3, id));
  }
  connection.Check(status, "instance watch");
  return response.instance();
}

}  // namespace

std::vector<v1::Instance> ListInstances(Connection& connection) {
  std::vector<v1::Instance> all;
  v1::ListInstancesRequest request;
  do {
    const auto page =
        connection.Call("instance list", connection.instances(), &v1::InstanceService::Stub::ListInstances, request);
    all.insert(all.end(), page.instances().begin(), page.instances().end());
    request.set_page_token(page.next_page_token());
  } while (!request.page_token().empty());
  return all;
}

std::string InstanceStateName(const v1::Instance& instance) {
  return v1::InstanceState_Name(instance.state()).substr(std::string("INSTANCE_STATE_").size());
}

v1::Instance WaitUntilSettled(Connection& connection, const std::string& id, std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout, [](v1::InstanceState state) {
    return Over(state) || state == v1::INSTANCE_STATE_RUNNING || state == v1::INSTANCE_STATE_PAUSED ||
           state == v1::INSTANCE_STATE_WAITING_FOR_PLAYERS;
  });
}

v1::Instance WaitFor(Connection& connection, const std::string& id, v1::InstanceState wanted,
                     std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout,
                    [wanted](v1::InstanceState state) { return Over(state) || state == wanted; });
}

v1::Instance WaitUntilEnded(Connection& connection, const std::string& id, std::chrono::milliseconds timeout) {
  return WatchUntil(connection, id, timeout, Over);
}

}  // namespace tessera::local

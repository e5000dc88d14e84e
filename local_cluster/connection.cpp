#include "local_cluster/connection.h"

#include <fmt/format.h>

#include "trust/dial.h"

namespace tessera::local {

Connection::Connection(const trust::ControlPoint& control) : address_(control.address) {
  auto channel = trust::Dial(control.address, control.credentials);
  if (!channel.ok()) {
    const std::string why(channel.status().message());
    // Whoever is not there, or not the right one, is no fault of the option.
    const bool reached = absl::IsUnavailable(channel.status()) || absl::IsUnauthenticated(channel.status());
    throw CommandError(reached ? why : fmt::format("--control {}", why));
  }
  channel_ = *std::move(channel);
  access_ = v1::AccessService::NewStub(channel_);
  hosts_ = v1::HostService::NewStub(channel_);
  instances_ = v1::InstanceService::NewStub(channel_);
  visuals_ = v1::VisualService::NewStub(channel_);
}

void Connection::Check(const grpc::Status& status, const std::string& what) const {
  if (status.ok()) return;
  // With a connection that stands it is the control plane that says so: its store cannot be written, perhaps.
  const bool reached = channel_->GetState(false) == GRPC_CHANNEL_READY;
  if (status.error_code() == grpc::StatusCode::UNAVAILABLE && !reached) {
    throw CommandError(fmt::format(
        "{}: no control plane answers at {}; start one with 'tessera up' or name it with --control", what, address_));
  }
  throw CommandError(fmt::format("{}: {} ({})", what, status.error_message(), CodeName(status.error_code())));
}

const char* CodeName(grpc::StatusCode code) {
  switch (code) {
    case grpc::StatusCode::OK:
      return "OK";
    case grpc::StatusCode::CANCELLED:
      return "CANCELLED";
    case grpc::StatusCode::INVALID_ARGUMENT:
      return "INVALID_ARGUMENT";
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return "DEADLINE_EXCEEDED";
    case grpc::StatusCode::NOT_FOUND:
      return "NOT_FOUND";
    case grpc::StatusCode::ALREADY_EXISTS:
      return "ALREADY_EXISTS";
    case grpc::StatusCode::PERMISSION_DENIED:
      return "PERMISSION_DENIED";
    case grpc::StatusCode::UNAUTHENTICATED:
      return "UNAUTHENTICATED";
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return "RESOURCE_EXHAUSTED";
    case grpc::StatusCode::FAILED_PRECONDITION:
      return "FAILED_PRECONDITION";
    case grpc::StatusCode::ABORTED:
      return "ABORTED";
    case grpc::StatusCode::OUT_OF_RANGE:
      return "OUT_OF_RANGE";
    case grpc::StatusCode::UNIMPLEMENTED:
      return "UNIMPLEMENTED";
    case grpc::StatusCode::INTERNAL:
      return "INTERNAL";
    case grpc::StatusCode::UNAVAILABLE:
      return "UNAVAILABLE";
    case grpc::StatusCode::DATA_LOSS:
      return "DATA_LOSS";
    default:
      return "UNKNOWN";
  }
}

}  // namespace tessera::local

#include "gateway/orders.h"

#include <grpcpp/grpcpp.h>
#include <signal.h>

#include <chrono>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "host/files.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"

namespace tessera::gateway {
namespace {

using nlohmann::json;

constexpr std::chrono::seconds kOrderDeadline{10};
// A checkpoint is answered when it is on disk, and a property when the standby has it.
constexpr std::chrono::seconds kSlowOrderDeadline{60};

template <class Stub, class Request, class Response>
absl::StatusOr<Response> Ask(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                             const Request& request, Response response,
                             std::chrono::seconds deadline = kOrderDeadline) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + deadline);
  const grpc::Status status = (stub.*method)(&context, request, &response);
  if (!status.ok()) return absl::Status(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  return response;
}

// Repeats what is the same in most orders: ask, and say in a line that it was taken.
template <class Stub, class Request, class Response>
absl::StatusOr<std::string> Accepted(Stub& stub,
                                     grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                     const Request& request, std::string text) {
  const auto answer = Ask(stub, method, request, Response());
  if (!answer.ok()) return answer.status();
  return text;
}

absl::StatusOr<std::string> Checkpoint(v1::InstanceService::Stub& stub, const std::string& instance) {
  v1::CheckpointInstanceRequest request;
  request.set_id(instance);
  const auto answer = Ask(stub, &v1::InstanceService::Stub::CheckpointInstance, request,
                          v1::CheckpointInstanceResponse(), kSlowOrderDeadline);
  if (!answer.ok()) return answer.status();
  return absl::StrCat("checkpoint of tick ", answer->checkpoint().tick());
}

absl::StatusOr<std::string> Restore(v1::InstanceService::Stub& stub, const std::string& instance, std::uint64_t tick) {
  v1::RestoreInstanceRequest request;
  request.set_id(instance);
  request.set_tick(tick);
  const auto answer = Ask(stub, &v1::InstanceService::Stub::RestoreInstance, request, v1::RestoreInstanceResponse(),
                          kSlowOrderDeadline);
  if (!answer.ok()) return answer.status();
  return absl::StrCat("goes on from tick ", answer->checkpoint().tick());
}

absl::StatusOr<std::string> SetProperty(v1::InstanceService::Stub& stub, const Order& order,
                                        const OrderContext& context) {
  if (!context.declared) {
    return absl::InvalidArgumentError(absl::StrCat("name: the scene declares no property \"", order.property, "\""));
  }
  absl::StatusOr<v1::Property> property = PropertyFrom(order.property, order.value, *context.declared);
  if (!property.ok()) return property.status();
  v1::SetPropertyRequest request;
  request.set_id(context.instance);
  request.set_body(order.body.value());
  *request.mutable_property() = *std::move(property);
  const auto answer =
      Ask(stub, &v1::InstanceService::Stub::SetProperty, request, v1::SetPropertyResponse(), kSlowOrderDeadline);
  if (!answer.ok()) return answer.status();
  return absl::StrCat(order.property, " is set");
}

// The control plane has no order for it: a worker that is killed is a fault, which is what is to be watched.
absl::StatusOr<std::string> EndWorker(const Order& order, const OrderContext& context) {
  if (!context.workers_are_here) {
    return absl::UnimplementedError(
        "end_worker: only in a cluster on this machine, with --local; elsewhere end the worker on its host");
  }
  const auto comm = host::ReadFile(absl::StrCat("/proc/", context.worker_pid, "/comm"), 64);
  if (context.worker_pid <= 1 || !comm.ok() || absl::StripSuffix(*comm, "\n") != "tessera-region") {
    return absl::NotFoundError(absl::StrCat("region: ", order.region, " has no worker on this machine"));
  }
  if (kill(static_cast<pid_t>(context.worker_pid), SIGKILL) != 0) {
    return absl::PermissionDeniedError(
        absl::StrCat("region: its worker, process ", context.worker_pid, ": ", std::strerror(errno)));
  }
  return absl::StrCat("worker of region ", order.region, ", process ", context.worker_pid, ", is killed");
}

}  // namespace

absl::StatusOr<v1::Property> PropertyFrom(const std::string& name, const json& value, const PropertyValue& declared) {
  v1::Property property;
  property.set_name(name);
  const auto wrong = [](const char* what) { return absl::InvalidArgumentError(absl::StrCat("value: must be ", what)); };
  if (std::holds_alternative<bool>(declared)) {
    if (!value.is_boolean()) return wrong("true or false");
    property.set_flag(value.get<bool>());
  } else if (std::holds_alternative<std::int64_t>(declared)) {
    if (!value.is_number_integer()) return wrong("a whole number");
    property.set_number(value.get<std::int64_t>());
  } else if (std::holds_alternative<double>(declared)) {
    if (!value.is_number()) return wrong("a number");
    property.set_real(value.get<double>());
  } else if (std::holds_alternative<std::string>(declared)) {
    if (!value.is_string()) return wrong("a text");
    property.set_text(value.get<std::string>());
  } else if (std::holds_alternative<Vec3d>(declared)) {
    if (!value.is_array() || value.size() != 3 || !value[0].is_number() || !value[1].is_number() ||
        !value[2].is_number()) {
      return wrong("3 numbers");
    }
    property.mutable_vector()->set_x(value[0].get<double>());
    property.mutable_vector()->set_y(value[1].get<double>());
    property.mutable_vector()->set_z(value[2].get<double>());
  } else if (std::holds_alternative<BodyId>(declared)) {
    const std::optional<BodyId> body = BodyIdFrom(value);
    if (!body) return wrong("the id of a body, as a text");
    property.set_body(body->value());
  } else {
    return absl::UnimplementedError("value: bytes are set by `tessera instance set-property` alone");
  }
  return property;
}

absl::StatusOr<std::string> CarryOut(const Order& order, const OrderContext& context,
                                     const std::shared_ptr<grpc::Channel>& channel) {
  using Instances = v1::InstanceService::Stub;
  const auto instances = v1::InstanceService::NewStub(channel);
  switch (order.kind) {
    case OrderKind::kScale: {
      v1::ScaleInstanceRequest request;
      request.set_id(context.instance);
      request.set_regions(order.regions);
      return Accepted(*instances, &Instances::ScaleInstance, request,
                      absl::StrCat("scales to ", order.regions, " regions"));
    }
    case OrderKind::kCheckpoint:
      return Checkpoint(*instances, context.instance);
    case OrderKind::kRestore:
      return Restore(*instances, context.instance, order.tick);
    case OrderKind::kPause: {
      v1::PauseInstanceRequest request;
      request.set_id(context.instance);
      return Accepted(*instances, &Instances::PauseInstance, request, "pauses");
    }
    case OrderKind::kResume: {
      v1::ResumeInstanceRequest request;
      request.set_id(context.instance);
      return Accepted(*instances, &Instances::ResumeInstance, request, "goes on");
    }
    case OrderKind::kPace: {
      v1::SetPaceRequest request;
      request.set_id(context.instance);
      request.set_ticks_per_second(order.ticks_per_second);
      return Accepted(*instances, &Instances::SetPace, request,
                      absl::StrCat("goes at ", order.ticks_per_second, " ticks a second"));
    }
    case OrderKind::kStep: {
      v1::ResumeInstanceRequest request;
      request.set_id(context.instance);
      request.set_ticks(order.ticks);
      return Accepted(*instances, &Instances::ResumeInstance, request,
                      absl::StrCat("makes ", order.ticks, order.ticks == 1 ? " tick" : " ticks"));
    }
    case OrderKind::kDrain: {
      const auto hosts = v1::HostService::NewStub(channel);
      v1::DrainHostRequest request;
      request.set_name(order.host);
      return Accepted(*hosts, &v1::HostService::Stub::DrainHost, request, absl::StrCat("drains ", order.host));
    }
    case OrderKind::kSetProperty:
      return SetProperty(*instances, order, context);
    case OrderKind::kEndWorker:
      return EndWorker(order, context);
    case OrderKind::kRecord:
      break;  // the gateway's own
  }
  return absl::InternalError("order: not known");
}

}  // namespace tessera::gateway

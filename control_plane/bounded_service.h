// BoundedService: a service whose requests have a size limit each, by their method.
//
//   BoundedService bounded(instances, v1::InstanceService::service_full_name(), on_refused);
//   builder.RegisterService(&bounded);   // in place of `instances`
//
// gRPC has one limit for a whole server, and some requests carry scenes. Parsing is what costs: 64 MiB of empty fields
// take gigabytes, whatever the method. So a request is measured before anything of it is parsed, and one that is larger
// than RequestLimit (door_limits.h) is answered with RESOURCE_EXHAUSTED, "InstanceService/KickPlayer: the request has
// 70000000 bytes, at most 262144". So is one that would take too much memory (message_cost.h). Methods that clients
// stream to are given by the service as handlers that take bytes, and measure each message (bounded_reader.h).
//
// Thread rule: as the service; it lives as long as this.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/support/method_handler.h>

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>

namespace tessera::control {

// By the method's name.
using StreamHandlers = std::map<std::string, std::unique_ptr<grpc::internal::MethodHandler>>;

// The handler of a method of `service` that takes a stream of bytes and answers once.
template <class Service, class Response>
std::unique_ptr<grpc::internal::MethodHandler> ClientStream(
    Service* service,
    grpc::Status (Service::*method)(grpc::ServerContext*, grpc::ServerReader<grpc::ByteBuffer>*, Response*)) {
  return std::make_unique<grpc::internal::ClientStreamingHandler<Service, grpc::ByteBuffer, Response>>(
      std::mem_fn(method), service);
}

class BoundedService final : public grpc::Service {
 public:
  // `method`: "InstanceService/KickPlayer".
  using Refused =
      std::function<void(const grpc::ServerContext& context, const std::string& method, const grpc::Status& status)>;

  // `service` keeps its handlers, and is not registered itself. `full_name`: "tessera.v1.InstanceService". `streams`:
  // one for each method that clients stream to.
  BoundedService(grpc::Service& service, const std::string& full_name, Refused on_refused, StreamHandlers streams = {});

 private:
  const Refused on_refused_;
  std::deque<std::string> paths_;  // gRPC keeps pointers to them
};

}  // namespace tessera::control

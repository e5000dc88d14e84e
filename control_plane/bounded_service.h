// BoundedService: a service whose requests have a size limit each, by their method.
//
//   BoundedService bounded(instances, v1::InstanceService::service_full_name(), on_refused);
//   builder.RegisterService(&bounded);   // in place of `instances`
//
// gRPC has one limit for a whole server, and some requests carry scenes. Parsing is what costs: 64 MiB of empty fields
// take gigabytes, whatever the method. So a request is measured before anything of it is parsed, and one that is larger
// than RequestLimit (door_limits.h) is answered with RESOURCE_EXHAUSTED, "InstanceService/KickPlayer: the request has
// 70000000 bytes, at most 262144". Messages of a client's stream are not measured here: their methods read them.
//
// Thread rule: as the service; it lives as long as this.
#pragma once

#include <grpcpp/grpcpp.h>
#include <grpcpp/impl/rpc_service_method.h>
#include <grpcpp/impl/service_type.h>

#include <deque>
#include <functional>
#include <string>

namespace tessera::control {

class BoundedService final : public grpc::Service {
 public:
  // `method`: "InstanceService/KickPlayer".
  using Refused =
      std::function<void(const grpc::ServerContext& context, const std::string& method, const grpc::Status& status)>;

  // `service` keeps its handlers, and is not registered itself. `full_name`: "tessera.v1.InstanceService".
  BoundedService(grpc::Service& service, const std::string& full_name, Refused on_refused);

 private:
  const Refused on_refused_;
  std::deque<std::string> paths_;  // gRPC keeps pointers to them
};

}  // namespace tessera::control

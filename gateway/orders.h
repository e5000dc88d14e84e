// Orders: what operators ask for through a viewer, carried out at the control plane.
//
// Thread rule: free functions that wait; off the event loop.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "core/world/properties.h"
#include "gateway/viewer_message.h"
#include "tessera/v1/instance.pb.h"

namespace grpc {
class Channel;
}

namespace tessera::gateway {

// Facts that an order needs to know beside its own fields.
struct OrderContext {
  std::string instance;
  // The property to set, as the scene declares it; nothing: it does not.
  std::optional<PropertyValue> declared{};
  std::int64_t worker_pid = 0;    // for the region whose worker is to end; 0: not known
  bool workers_are_here = false;  // all hosts of the cluster are this machine
};

// A line for people about what was done. Errors: the control plane's, or INVALID_ARGUMENT naming the field.
absl::StatusOr<std::string> CarryOut(const Order& order, const OrderContext& context,
                                     const std::shared_ptr<grpc::Channel>& channel);

// The value of a property of the type of `declared`. INVALID_ARGUMENT: it is of another type.
absl::StatusOr<v1::Property> PropertyFrom(const std::string& name, const nlohmann::json& value,
                                          const PropertyValue& declared);

}  // namespace tessera::gateway

// Requests of a worker for a lease, for tests.
#pragma once

#include <cstdint>

#include "tessera/v1/worker_link.pb.h"

namespace tessera::control {

// The worker is the one of region 1 of inst-1 with this incarnation.
inline v1::LeaseRequest AskFor(std::uint64_t incarnation, std::uint64_t number) {
  v1::LeaseRequest request;
  request.mutable_identity()->set_instance_id("inst-1");
  request.mutable_identity()->set_region(1);
  request.mutable_identity()->set_incarnation(incarnation);
  request.set_number(number);
  return request;
}

}  // namespace tessera::control

// Identity: which life of which region of which instance a worker is.
#pragma once

#include <string>

#include "core/world/ids.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

struct Identity {
  std::string instance_id;
  RegionId region;
  Incarnation incarnation;
};

inline v1::WorkerIdentity ToProto(const Identity& self) {
  v1::WorkerIdentity identity;
  identity.set_instance_id(self.instance_id);
  identity.set_region(self.region.value());
  identity.set_incarnation(self.incarnation.value());
  return identity;
}

}  // namespace tessera::worker

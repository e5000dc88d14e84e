// Workers of instances whose keys a test has made.
#pragma once

#include <string>
#include <utility>

#include "net/acceptor.h"

namespace tessera::net {

// A life of a region, with a key pair of its own.
inline EndpointIdentity TestWorker(const SigningKey& instance_key, std::string instance_id, RegionId region,
                                   Incarnation incarnation, bool for_regions = false) {
  EndpointIdentity self{.instance_id = std::move(instance_id),
                        .region = region,
                        .incarnation = incarnation,
                        .instance_key = instance_key.verification_key(),
                        .certificate = {},
                        .key = SigningKey::Make(),
                        .for_regions = for_regions};
  self.certificate = Sign(WorkerCertificate{.instance_id = self.instance_id,
                                            .region = region,
                                            .incarnation = incarnation,
                                            .key = self.key.verification_key()},
                          instance_key);
  return self;
}

}  // namespace tessera::net

// For tests: what the control plane signs for a worker that has reported its key.
#pragma once

#include "net/credential.h"
#include "tessera/v1/worker_link.pb.h"

namespace tessera::worker {

inline void Certify(v1::WorkerOrder& order, const net::SigningKey& instance_key, const net::VerificationKey& worker) {
  const std::vector<std::uint8_t> certificate =
      net::Sign(net::WorkerCertificate{.instance_id = order.instance_id(),
                                       .region = RegionId(order.region()),
                                       .incarnation = Incarnation(order.incarnation()),
                                       .key = worker},
                instance_key);
  order.set_instance_key(instance_key.verification_key().data(), net::kKeyBytes);
  order.set_certificate(certificate.data(), certificate.size());
}

}  // namespace tessera::worker

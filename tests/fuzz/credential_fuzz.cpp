// A credential or a certificate is taken only if the instance's key signed it.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "net/credential.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const tessera::net::VerificationKey key = tessera::net::SigningKey::Make().verification_key();
  if (tessera::net::ReadPlayerCredential({data, size}, "plaza-1", key).ok()) std::abort();
  if (tessera::net::ReadWorkerCertificate({data, size}, "plaza-1", key).ok()) std::abort();
  return 0;
}

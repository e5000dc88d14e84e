// KeptSum: the sum of a scene that a client keeps on its disk: BLAKE2b with 256 bits. It finds what a disk has damaged,
// and takes a quarter of the time of the SHA-256 by which regions name what they send.
//
//   KeptSum sum;
//   sum.Add(first_part);
//   sum.Add(second_part);
//   const replication::Digest digest = sum.Finish();
//
// Thread rule: one thread at a time.
#pragma once

#include <sodium.h>

#include <cstdint>
#include <span>

#include "core/replication/scene_transfer.h"

namespace tessera::client {

class KeptSum {
 public:
  KeptSum() { Begin(); }
  void Add(std::span<const std::uint8_t> bytes) { crypto_generichash_update(&state_, bytes.data(), bytes.size()); }
  // The sum of all that was added; then it begins anew.
  replication::Digest Finish() {
    replication::Digest digest;
    crypto_generichash_final(&state_, digest.data(), digest.size());
    Begin();
    return digest;
  }

 private:
  void Begin() { crypto_generichash_init(&state_, nullptr, 0, sizeof(replication::Digest)); }

  crypto_generichash_state state_;
};

}  // namespace tessera::client

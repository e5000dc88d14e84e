// Acknowledger: a client that acknowledges the snapshots that come without reading what they hold: the far side of what
// is measured on the near one. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>

#include "core/replication/record_codec.h"
#include "core/replication/snapshot.h"

namespace tessera::bench {

class Acknowledger {
 public:
  void Take(std::span<const std::uint8_t> datagram) {
    replication::BitReader reader(datagram);
    replication::SnapshotHeader header;
    if (!ReadHeader(reader, header).ok() || header.sequence <= newest_) return;
    const std::uint32_t shift = header.sequence - newest_;
    mask_ = shift >= 64 ? 0 : mask_ << shift;
    if (newest_ != 0 && shift <= 64) mask_ |= std::uint64_t{1} << (shift - 1);
    newest_ = header.sequence;
  }
  // As SnapshotReceiver::WriteAck gives it.
  replication::Bytes Answer() const {
    if (newest_ == 0) return {};
    replication::BitWriter writer;
    writer.Write(newest_, 32);
    writer.Write(mask_, 64);
    return writer.Finish();
  }

 private:
  std::uint32_t newest_ = 0;
  std::uint64_t mask_ = 0;
};

}  // namespace tessera::bench

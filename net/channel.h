// Channel: datagrams between two that share a key for each direction: sealed by ChaCha20-Poly1305, each sequence number
// used once, each accepted once.
//
//   sealed datagram: kind u8 (sealed or direct) | receiver's session number u24 | low half of the sequence number u32 |
//   ciphertext | tag 16
//
// Promises: the other end of this very channel sealed the payload that `Open` gives, and no payload is given twice;
// nothing is promised about order. The header is associated data. A datagram more than kReplayBits behind the newest is
// refused like a repeated one. Sequence numbers have 64 bits and begin at 1 (0 seals the Accept), so none comes twice
// in the life of a key. Thread rule: one thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "net/datagram_kind.h"
#include "net/secret.h"

namespace tessera::net {

using Key = Secret<32>;

inline constexpr std::size_t kSealHeaderBytes = 8, kSealTagBytes = 16;
inline constexpr std::uint32_t kMaxSessionNumber = 0xffffff;

// The newest sequence number, and which of the numbers just below it have come.
class ReplayWindow {
 public:
  // Far more than the network reorders within a burst; a 4 MB frame is some 3500 datagrams.
  static constexpr std::size_t kReplayBits = 1024;

  bool Fresh(std::uint64_t sequence) const;
  void Take(std::uint64_t sequence);  // requires Fresh
  // The number that ends in `low` and is nearest to the one expected next.
  std::uint64_t Complete(std::uint32_t low) const;
  std::uint64_t newest() const { return newest_; }

 private:
  std::uint64_t newest_ = 0;
  std::array<std::uint64_t, kReplayBits / 64> seen_{};  // bit of n: n mod kReplayBits
};

class Channel {
 public:
  Channel(const Key& send, const Key& receive) : send_(send), receive_(receive) {}

  // Seals in place. `datagram` has room for header and tag around the payload, which begins at kSealHeaderBytes.
  // Returns the number of bytes to send.
  std::size_t Seal(DatagramKind kind, std::uint32_t receiver, std::span<std::uint8_t> datagram,
                   std::size_t payload_bytes);

  enum class Fault : std::uint8_t { kNone, kReplayed, kForged };
  // Opens in place; the payload lies within `datagram`, which has at least header and tag. Nothing if not genuine.
  std::optional<std::span<std::uint8_t>> Open(std::span<std::uint8_t> datagram, Fault* fault);

  std::uint64_t sealed() const { return sequence_; }

 private:
  Key send_, receive_;
  std::uint64_t sequence_ = 0;
  ReplayWindow window_;
};

// The receiver's session number in the header of a sealed datagram. Requires kSealHeaderBytes.
std::uint32_t SessionNumberOf(std::span<const std::uint8_t> sealed);

}  // namespace tessera::net

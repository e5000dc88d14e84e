#include "net/channel.h"

#include <sodium.h>

#include <cassert>

namespace tessera::net {
namespace {

static_assert(kSealTagBytes == crypto_aead_chacha20poly1305_ietf_ABYTES);
static_assert(Key::size() == crypto_aead_chacha20poly1305_ietf_KEYBYTES);

using AeadNonce = std::array<std::uint8_t, crypto_aead_chacha20poly1305_ietf_NPUBBYTES>;

AeadNonce NonceOf(std::uint64_t sequence) {
  AeadNonce nonce{};
  for (std::size_t i = 0; i < 8; ++i) nonce[4 + i] = static_cast<std::uint8_t>(sequence >> (8 * i));
  return nonce;
}

std::uint32_t Read32(const std::uint8_t* from) {
  return std::uint32_t{from[0]} | std::uint32_t{from[1]} << 8 | std::uint32_t{from[2]} << 16 |
         std::uint32_t{from[3]} << 24;
}

void Write32(std::uint8_t* to, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) to[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

}  // namespace

bool ReplayWindow::Fresh(std::uint64_t sequence) const {
  if (sequence == 0 || sequence + kReplayBits <= newest_) return false;
  if (sequence > newest_) return true;
  const std::uint64_t bit = sequence % kReplayBits;
  return (seen_[bit / 64] >> (bit % 64) & 1) == 0;
}

void ReplayWindow::Take(std::uint64_t sequence) {
  assert(Fresh(sequence));
  if (sequence > newest_) {
    if (sequence - newest_ >= kReplayBits) {
      seen_.fill(0);
    } else {
      for (std::uint64_t skipped = newest_ + 1; skipped < sequence; ++skipped) {
        const std::uint64_t bit = skipped % kReplayBits;
        seen_[bit / 64] &= ~(std::uint64_t{1} << (bit % 64));
      }
    }
    newest_ = sequence;
  }
  const std::uint64_t bit = sequence % kReplayBits;
  seen_[bit / 64] |= std::uint64_t{1} << (bit % 64);
}

std::uint64_t ReplayWindow::Complete(std::uint32_t low) const {
  // Signed distance of the low halves, at most 2^31 either way.
  const auto distance = static_cast<std::int32_t>(low - static_cast<std::uint32_t>(newest_));
  if (distance < 0 && newest_ < std::uint64_t{0} - static_cast<std::uint64_t>(std::int64_t{distance})) return low;
  return newest_ + static_cast<std::uint64_t>(std::int64_t{distance});
}

std::size_t Channel::Seal(DatagramKind kind, std::uint32_t receiver, std::span<std::uint8_t> datagram,
                          std::size_t payload_bytes) {
  assert(receiver <= kMaxSessionNumber && datagram.size() >= kSealHeaderBytes + payload_bytes + kSealTagBytes);
  ++sequence_;
  Write32(datagram.data(), static_cast<std::uint32_t>(kind) | receiver << 8);
  Write32(datagram.data() + 4, static_cast<std::uint32_t>(sequence_));
  const AeadNonce nonce = NonceOf(sequence_);
  std::uint8_t* payload = datagram.data() + kSealHeaderBytes;
  crypto_aead_chacha20poly1305_ietf_encrypt_detached(payload, payload + payload_bytes, nullptr, payload, payload_bytes,
                                                     datagram.data(), kSealHeaderBytes, nullptr, nonce.data(),
                                                     send_.data());
  return kSealHeaderBytes + payload_bytes + kSealTagBytes;
}

std::optional<std::span<std::uint8_t>> Channel::Open(std::span<std::uint8_t> datagram, Fault* fault) {
  assert(datagram.size() >= kSealHeaderBytes + kSealTagBytes);
  const std::uint64_t sequence = window_.Complete(Read32(datagram.data() + 4));
  if (!window_.Fresh(sequence)) {
    *fault = Fault::kReplayed;
    return std::nullopt;
  }
  const std::span<std::uint8_t> payload =
      datagram.subspan(kSealHeaderBytes, datagram.size() - kSealHeaderBytes - kSealTagBytes);
  const AeadNonce nonce = NonceOf(sequence);
  if (crypto_aead_chacha20poly1305_ietf_decrypt_detached(payload.data(), nullptr, payload.data(), payload.size(),
                                                         payload.data() + payload.size(), datagram.data(),
                                                         kSealHeaderBytes, nonce.data(), receive_.data()) != 0) {
    *fault = Fault::kForged;
    return std::nullopt;
  }
  window_.Take(sequence);
  *fault = Fault::kNone;
  return payload;
}

std::uint32_t SessionNumberOf(std::span<const std::uint8_t> sealed) { return Read32(sealed.data()) >> 8; }

}  // namespace tessera::net

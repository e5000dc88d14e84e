#include "core/replication/bit_stream.h"

#include <algorithm>

namespace tessera::replication {
namespace {

constexpr std::uint64_t LowBits(int bits) { return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1; }

}  // namespace

void BitWriter::WriteVarint(std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) Write((value & 0x7f) | 0x80, 8);
  Write(value, 8);
}

void BitWriter::Rewind(const Mark& mark) {
  assert(mark.words <= used_);
  used_ = mark.words;
  pending_ = mark.pending;
  pending_bits_ = mark.pending_bits;
}

std::vector<std::uint8_t> BitWriter::Finish() {
  const std::size_t count = (bit_count() + 7) / 8;
  if (used_ == words_.size()) Grow();
  words_[used_] = pending_;
  std::vector<std::uint8_t> whole(count);
  if constexpr (std::endian::native == std::endian::little) {
    if (count > 0) std::memcpy(whole.data(), words_.data(), count);
  } else {
    for (std::size_t i = 0; i < count; ++i) whole[i] = static_cast<std::uint8_t>(words_[i / 8] >> (8 * (i % 8)));
  }
  pending_ = 0;
  pending_bits_ = 0;
  used_ = 0;
  return whole;
}

void BitWriter::Grow() { words_.resize(std::max<std::size_t>(8, 2 * words_.size())); }

std::uint64_t BitReader::Read32(int bits) {
  if (static_cast<std::size_t>(bits) > bytes_.size() * 8 - position_) {
    ok_ = false;
    position_ = bytes_.size() * 8;
    return 0;
  }
  const std::size_t first = position_ / 8;
  const int shift = static_cast<int>(position_ % 8);
  std::uint64_t window = 0;  // 32 bits and a shift below 8 lie within five bytes
  for (std::size_t i = 0; i < std::min<std::size_t>(5, bytes_.size() - first); ++i) {
    window |= std::uint64_t{bytes_[first + i]} << (8 * i);
  }
  position_ += static_cast<std::size_t>(bits);
  return (window >> shift) & LowBits(bits);
}

std::uint64_t BitReader::ReadSlowly(int bits) {
  if (bits <= 32) return Read32(bits);
  const std::uint64_t low = Read32(32);
  return low | Read32(bits - 32) << 32;
}

std::uint64_t BitReader::ReadVarint() {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const std::uint64_t group = Read(8);
    value |= (group & 0x7f) << shift;
    if ((group & 0x80) == 0) return value;
  }
  ok_ = false;  // longer than any 64-bit number
  return 0;
}

bool BitReader::AtEnd() {
  const std::size_t left = bytes_.size() * 8 - position_;
  return ok_ && left < 8 && Read32(static_cast<int>(left)) == 0;
}

}  // namespace tessera::replication

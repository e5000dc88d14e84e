// RangeEncoder and RangeDecoder: single bits in as little room as their odds allow.
//
//   RangeEncoder encoder;                    RangeDecoder decoder(bytes);
//   encoder.Encode(bit, odds);               bool bit = decoder.Decode(odds);
//   Bytes bytes = encoder.Finish();          if (decoder.overrun()) return error;
//
// A binary arithmetic coder without carry (the way of M. Mahoney's lpaq): the interval is two 32-bit numbers, a leading
// byte on which they agree goes out. Integers only, so both ends take the same decisions on every machine.
//
// Promise: a decoder never leaves its bytes; beyond their end it reads zeros. It cannot tell a damaged stream from
// another one: whoever must, adds a checksum (checksum.h). Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace tessera::replication {

// Odds are of a 1, in 1 / 2^16, and never 0 or 2^16.
inline constexpr int kOddsBits = 16;
inline constexpr std::uint32_t kEvenOdds = 1u << (kOddsBits - 1);

class RangeEncoder {
 public:
  void Encode(bool bit, std::uint32_t odds) {
    const std::uint32_t middle = low_ + static_cast<std::uint32_t>((std::uint64_t{high_ - low_} * odds) >> kOddsBits);
    if (bit) {
      high_ = middle;
    } else {
      low_ = middle + 1;
    }
    while (((low_ ^ high_) >> 24) == 0) {
      bytes_.push_back(static_cast<std::uint8_t>(high_ >> 24));
      low_ <<= 8;
      high_ = (high_ << 8) | 0xff;
    }
  }
  std::size_t size() const { return bytes_.size(); }

  // The shortest bytes that, followed by zeros, lie in the interval. The encoder is as new then.
  std::vector<std::uint8_t> Finish() {
    for (int kept = 0; kept <= 4; ++kept) {
      const std::uint64_t unit = std::uint64_t{1} << (32 - 8 * kept);
      const std::uint64_t value = (low_ + unit - 1) / unit * unit;
      if (value > high_) continue;
      for (int i = 0; i < kept; ++i) bytes_.push_back(static_cast<std::uint8_t>(value >> (24 - 8 * i)));
      break;
    }
    while (!bytes_.empty() && bytes_.back() == 0) bytes_.pop_back();
    low_ = 0;
    high_ = ~std::uint32_t{0};
    return std::exchange(bytes_, {});
  }

 private:
  std::vector<std::uint8_t> bytes_;
  std::uint32_t low_ = 0, high_ = ~std::uint32_t{0};
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) code_ = (code_ << 8) | Next();
  }

  bool Decode(std::uint32_t odds) {
    const std::uint32_t middle = low_ + static_cast<std::uint32_t>((std::uint64_t{high_ - low_} * odds) >> kOddsBits);
    const bool bit = code_ <= middle;
    if (bit) {
      high_ = middle;
    } else {
      low_ = middle + 1;
    }
    while (((low_ ^ high_) >> 24) == 0) {
      low_ <<= 8;
      high_ = (high_ << 8) | 0xff;
      code_ = (code_ << 8) | Next();
    }
    return bit;
  }

  // Further beyond the end than it ever is in a stream that an encoder has finished and that ended in no zeros. A loop
  // whose length the stream itself tells asks this, so that a few bytes cannot keep it busy for long.
  bool overrun() const { return position_ > bytes_.size() + kMaxZeros; }

 private:
  // Trailing zeros are cut off: a stream may well end in many likely bits that all are zeros.
  static constexpr std::size_t kMaxZeros = 4096;

  std::uint32_t Next() {
    const std::uint32_t byte = position_ < bytes_.size() ? bytes_[position_] : 0;
    ++position_;
    return byte;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t position_ = 0;
  std::uint32_t low_ = 0, high_ = ~std::uint32_t{0}, code_ = 0;
};

}  // namespace tessera::replication

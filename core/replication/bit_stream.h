// BitWriter and BitReader: numbers in as few bits as they need, lowest bit first.
//
//   BitWriter writer;
//   writer.Write(5, 3);
//   Bytes bytes = writer.Finish();
//   BitReader reader(bytes);
//   auto five = reader.Read(3);
//   if (!reader.ok()) return error;  // it was too short
//
// A reader never leaves its bytes: beyond the end it gives zeros and is no longer ok, so a parser checks once, at its
// end, and wherever a value it has read sizes a loop. A writer trusts its caller. Thread rule: one thread at a time.
#pragma once

#include <bit>
#include <cassert>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace tessera::replication {

// Small signed numbers to small unsigned ones: 0, -1, 1, -2, ... to 0, 1, 2, 3, ...
constexpr std::uint64_t ZigZag(std::int64_t v) {
  return (static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63);
}
constexpr std::int64_t UnZigZag(std::uint64_t v) {
  return static_cast<std::int64_t>(v >> 1) ^ -static_cast<std::int64_t>(v & 1);
}

// Widths of the bands of a banded number. The first 2^bands[0] values take bands[0] bits, the next 2^bands[1] take
// bands[1], and so on; each band costs one more bit of prefix, and what lies beyond the last is written as a varint.
using Bands = std::span<const std::uint8_t>;

class BitWriter {
 public:
  // Where the writer was; valid while nothing before it is rewound.
  struct Mark {
    std::size_t words = 0;
    std::uint64_t pending = 0;
    int pending_bits = 0;
  };

  // Requires 0 <= bits <= 64 and value < 2^bits.
  void Write(std::uint64_t value, int bits) {
    assert(bits >= 0 && bits <= 64 && (bits == 64 || value >> bits == 0));
    pending_ |= value << pending_bits_;
    const int sum = pending_bits_ + bits;
    if (sum < 64) {
      pending_bits_ = sum;
      return;
    }
    if (used_ == words_.size()) Grow();
    words_[used_++] = pending_;
    const int taken = 64 - pending_bits_;
    pending_ = taken < 64 ? value >> taken : 0;
    pending_bits_ = sum - 64;
  }
  void WriteBit(bool bit) { Write(bit ? 1 : 0, 1); }
  void WriteVarint(std::uint64_t value);  // 8 bits for each 7 that it has
  void WriteBanded(std::uint64_t value, Bands bands) {
    for (std::size_t i = 0; i < bands.size(); ++i) {
      const std::uint64_t size = std::uint64_t{1} << bands[i];
      const std::uint64_t prefix = (std::uint64_t{1} << i) - 1;  // i ones and a zero
      if (value < size) return Write(value << (i + 1) | prefix, static_cast<int>(i) + 1 + bands[i]);
      value -= size;
    }
    Write((std::uint64_t{1} << bands.size()) - 1, static_cast<int>(bands.size()));
    WriteVarint(value);
  }

  std::size_t bit_count() const { return used_ * 64 + static_cast<std::size_t>(pending_bits_); }
  Mark mark() const { return {used_, pending_, pending_bits_}; }
  void Rewind(const Mark& mark);
  // Room for so many bytes in all, so that writing them takes no more of it.
  void Reserve(std::size_t bytes) {
    if (words_.size() <= bytes / 8) words_.resize(bytes / 8 + 1);
  }
  // The whole, filled up with zeros to a byte. The writer is empty then, and keeps its room.
  std::vector<std::uint8_t> Finish();

 private:
  void Grow();

  std::vector<std::uint64_t> words_;  // room; so many of it are written:
  std::size_t used_ = 0;
  std::uint64_t pending_ = 0;  // bits that do not fill 64 yet
  int pending_bits_ = 0;       // below 64
};

class BitReader {
 public:
  // Bits of a Word that are sure to be there.
  static constexpr int kWordBits = 57;

  explicit BitReader(std::span<const std::uint8_t> bytes)
      : bytes_(bytes), words_end_(bytes.size() < 8 ? 0 : (bytes.size() - 7) * 8) {}

  std::uint64_t Read(int bits) {  // 0 to 64
    assert(bits >= 0 && bits <= 64);
    if (!HasWord() || bits > kWordBits) return ReadSlowly(bits);
    const std::uint64_t value = Word() & ((std::uint64_t{1} << bits) - 1);
    Skip(bits);
    return value;
  }
  bool ReadBit() { return Read(1) != 0; }
  std::uint64_t ReadVarint();
  std::uint64_t ReadBanded(Bands bands) {
    std::uint64_t before = 0;
    for (const std::uint8_t bits : bands) {
      if (!ReadBit()) return before + Read(bits);
      before += std::uint64_t{1} << bits;
    }
    return before + ReadVarint();
  }

  // Whether so much is left that the next bits can be had at once, before it is known how many of them are wanted.
  bool HasWord() const { return position_ < words_end_; }
  // The next bits, kWordBits of them or more. Requires HasWord().
  std::uint64_t Word() const {
    assert(HasWord());
    const std::uint8_t* const at = bytes_.data() + position_ / 8;
    std::uint64_t word = 0;
    if constexpr (std::endian::native == std::endian::little) {
      std::memcpy(&word, at, sizeof word);
    } else {
      for (std::size_t i = 0; i < sizeof word; ++i) word |= std::uint64_t{at[i]} << (8 * i);
    }
    return word >> (position_ % 8);
  }
  // Goes past bits of a Word, kWordBits at most.
  void Skip(int bits) { position_ += static_cast<std::size_t>(bits); }

  bool ok() const { return ok_; }
  // True if nothing but the zeros that fill the last byte is left.
  bool AtEnd();

 private:
  std::uint64_t ReadSlowly(int bits);
  std::uint64_t Read32(int bits);

  std::span<const std::uint8_t> bytes_;
  std::size_t words_end_;     // in bits: eight bytes follow from any position before it
  std::size_t position_ = 0;  // in bits
  bool ok_ = true;
};

}  // namespace tessera::replication

// ByteWriter and ByteReader: plain values to bytes and back, without loss. Frames, logs, recordings, tokens and the
// handshake are written with them.
//
// Numbers of a fixed width are little-endian, floating point numbers are their IEEE bits, a varint has 7 bits a byte,
// the low ones first, and a block is a varint of its length and then so many bytes.
//
//   ByteWriter out;
//   out.Varint(tick.value());
//   std::vector<std::uint8_t> bytes = out.Take();
//
//   ByteReader in(bytes);
//   in.Field("tick");
//   const Tick tick(in.Varint());
//   if (!in.ok()) return absl::InvalidArgumentError(in.error());  // "tick: truncated"
//
// A reader never reads past its end. After the first failure it gives zeros and empty spans, `ok()` stays false and
// `error()` names the field, so a decoder may check once. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/world/math.h"

namespace tessera {

class ByteWriter {
 public:
  void U8(std::uint8_t v) { *More(1) = v; }
  void U16(std::uint16_t v) { All<std::uint16_t>(v); }
  void U32(std::uint32_t v) { All<std::uint32_t>(v); }
  void U64(std::uint64_t v) { All<std::uint64_t>(v); }
  void Varint(std::uint64_t v) {
    for (; v >= 0x80; v >>= 7) U8(static_cast<std::uint8_t>(v | 0x80));
    U8(static_cast<std::uint8_t>(v));
  }
  void F32(float v) { All<std::uint32_t>(v); }
  void F64(double v) { All<std::uint64_t>(v); }
  void V(Vec3f v) { All<std::uint32_t>(v.x, v.y, v.z); }
  void V(Vec3d v) { All<std::uint64_t>(v.x, v.y, v.z); }
  void Q(Quatd q) { All<std::uint64_t>(q.x, q.y, q.z, q.w); }
  void Bytes(std::span<const std::uint8_t> bytes) { std::copy(bytes.begin(), bytes.end(), More(bytes.size())); }
  void Text(std::string_view text) { std::copy(text.begin(), text.end(), More(text.size())); }
  void Block(std::span<const std::uint8_t> bytes) {
    Varint(bytes.size());
    Bytes(bytes);
  }
  void Block(std::string_view text) {
    Varint(text.size());
    Text(text);
  }
  // Appends zeros up to a size in all.
  void PadTo(std::size_t size) {
    if (size > size_) std::fill_n(More(size - size_), size - size_, std::uint8_t{0});
  }

  void Reserve(std::size_t bytes) { Grow(bytes); }
  // Makes room for `most` more bytes; `Wrote` says where the bytes end that were written there.
  std::uint8_t* Room(std::size_t most) { return More(most); }
  void Wrote(const std::uint8_t* end) { size_ = static_cast<std::size_t>(end - bytes_.data()); }

  std::size_t size() const { return size_; }
  std::span<const std::uint8_t> bytes() const { return std::span(bytes_).first(size_); }
  std::vector<std::uint8_t> Take() {
    bytes_.resize(std::exchange(size_, 0));
    return std::exchange(bytes_, {});
  }

 private:
  template <class U, class... Values>
  void All(Values... values) {
    std::uint8_t* to = More(sizeof...(values) * sizeof(U));
    const auto put = [&](U v) {
      for (std::size_t i = 0; i < sizeof(U); ++i) *to++ = static_cast<std::uint8_t>(v >> (8 * i));
    };
    (put(std::bit_cast<U>(values)), ...);
  }
  std::uint8_t* More(std::size_t n) {
    if (bytes_.size() - size_ < n) Grow(n);
    size_ += n;
    return bytes_.data() + size_ - n;
  }
  void Grow(std::size_t n) { bytes_.resize(std::max(size_ + n, 2 * bytes_.size())); }

  std::vector<std::uint8_t> bytes_;  // the first `size_` of them are written
  std::size_t size_ = 0;
};

class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t remaining() const { return bytes_.size() - at_; }
  std::span<const std::uint8_t> rest() const { return bytes_.subspan(at_); }

  // Names what is read from here on; `name` outlives the reader.
  void Field(const char* name) {
    if (ok_) field_ = name;
  }
  void Fail(const char* why) {
    if (!ok_) return;
    ok_ = false;
    why_ = why;
  }
  // The first failure, e.g. "ghosts: truncated"; empty while there is none.
  std::string error() const {
    if (ok_) return {};
    return *field_ == '\0' ? std::string(why_) : std::string(field_) + ": " + why_;
  }

  std::uint8_t U8() {
    if (at_ == bytes_.size()) Fail(kTruncated);
    return ok_ ? bytes_[at_++] : std::uint8_t{0};
  }
  std::uint16_t U16() { return Fixed<std::uint16_t>(); }
  std::uint32_t U32() { return Fixed<std::uint32_t>(); }
  std::uint64_t U64() { return Fixed<std::uint64_t>(); }
  std::uint64_t Varint() {
    if (remaining() >= kMaxVarintBytes && ok_) {
      const std::uint8_t* const in = bytes_.data() + at_;
      std::uint64_t v = 0;
      for (std::size_t i = 0; i + 1 < kMaxVarintBytes; ++i) {
        v |= static_cast<std::uint64_t>(in[i] & 0x7f) << (7 * i);
        if (in[i] >= 0x80) continue;
        at_ += i + 1;
        return v;
      }
    }
    return CheckedVarint();
  }
  // The next id of a list that ascends: the one before plus a difference that is not 0 and does not wrap. Without one
  // this is false, and `last` stays.
  bool Ascend(std::uint64_t& last) {
    const std::uint64_t step = Varint();
    if (step == 0 || last + step < last) return false;
    last += step;
    return true;
  }
  std::uint32_t Varint32() {
    const std::uint64_t v = Varint();
    if (v > 0xffffffff) Fail(kOutOfRange);
    return ok_ ? static_cast<std::uint32_t>(v) : 0;
  }
  // Reads a count of things that take at least `min_bytes` each: one that the rest cannot hold fails here, before
  // anything is reserved.
  std::size_t Count(std::size_t min_bytes) {
    const std::uint64_t n = Varint();
    if (n > remaining() / min_bytes) Fail(kTruncated);
    return ok_ ? static_cast<std::size_t>(n) : 0;
  }
  float F32() { return std::bit_cast<float>(Fixed<std::uint32_t>()); }
  double F64() { return std::bit_cast<double>(Fixed<std::uint64_t>()); }
  Vec3f V3f() {
    const float x = F32(), y = F32(), z = F32();
    return {x, y, z};
  }
  Vec3d V3d() {
    const double x = F64(), y = F64(), z = F64();
    return {x, y, z};
  }
  Quatd Q() {
    const double x = F64(), y = F64(), z = F64(), w = F64();
    return {x, y, z, w};
  }
  std::span<const std::uint8_t> Bytes(std::size_t count) {
    if (count > remaining()) Fail(kTruncated);
    if (!ok_) return {};
    at_ += count;
    return bytes_.subspan(at_ - count, count);
  }
  // Reads a block of at most `most` bytes.
  std::span<const std::uint8_t> Block(std::size_t most) {
    const std::size_t size = Count(1);
    if (size > most) Fail("too long");
    return Bytes(ok_ ? size : 0);
  }
  template <std::size_t kCount>
  void Fill(std::array<std::uint8_t, kCount>& to) {
    const std::span<const std::uint8_t> from = Bytes(kCount);
    std::copy(from.begin(), from.end(), to.begin());
  }

 private:
  static constexpr const char* kTruncated = "truncated";
  static constexpr const char* kOutOfRange = "out of range";
  static constexpr std::size_t kMaxVarintBytes = 10;

  std::uint64_t CheckedVarint() {
    std::uint64_t v = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = U8();
      if (shift == 63 && byte > 1) break;
      v |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return ok_ ? v : 0;
    }
    Fail(kOutOfRange);
    return 0;
  }

  template <class U>
  U Fixed() {
    if (sizeof(U) > remaining()) Fail(kTruncated);
    if (!ok_) return 0;
    U v = 0;
    for (std::size_t i = 0; i < sizeof(U); ++i) v = static_cast<U>(v | static_cast<U>(bytes_[at_ + i]) << (8 * i));
    at_ += sizeof(U);
    return v;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
  const char* field_ = "";
  const char* why_ = "";
};

}  // namespace tessera

// Writer and Reader: plain values to bytes and back, without loss. Numbers are little-endian; counts and ids are
// varints (7 bits a byte, low first).
//
// A Reader never reads past its end: after the first failure it gives zeros and `ok()` stays false, so a decoder may
// check once. Thread rule: one thread at a time.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#include <vector>

#include "core/world/math.h"

namespace tessera::region {

class Writer {
 public:
  void U8(std::uint8_t v) { *More(1) = v; }
  void Varint(std::uint64_t v) {
    for (; v >= 0x80; v >>= 7) U8(static_cast<std::uint8_t>(v | 0x80));
    U8(static_cast<std::uint8_t>(v));
  }
  void F32(float v) { All<std::uint32_t>(v); }
  void F64(double v) { All<std::uint64_t>(v); }
  void V(Vec3f v) { All<std::uint32_t>(v.x, v.y, v.z); }
  void V(Vec3d v) { All<std::uint64_t>(v.x, v.y, v.z); }
  void Q(Quatd q) { All<std::uint64_t>(q.x, q.y, q.z, q.w); }

  void Reserve(std::size_t bytes) { Grow(bytes); }
  // Room for `most` more bytes; `Wrote` says where what was written there ends.
  std::uint8_t* Room(std::size_t most) { return More(most); }
  void Wrote(const std::uint8_t* end) { size_ = static_cast<std::size_t>(end - bytes_.data()); }
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

  std::vector<std::uint8_t> bytes_;  // written are the first
  std::size_t size_ = 0;             // of them
};

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool ok() const { return ok_; }
  std::size_t remaining() const { return bytes_.size() - at_; }

  std::span<const std::uint8_t> rest() const { return bytes_.subspan(at_); }
  void Skip(std::size_t n) {
    if (n > remaining()) ok_ = false;
    if (ok_) at_ += n;
  }
  void Fail() { ok_ = false; }

  std::uint8_t U8() {
    if (at_ == bytes_.size()) ok_ = false;
    return ok_ ? bytes_[at_++] : std::uint8_t{0};
  }
  std::uint64_t Varint() {
    std::uint64_t v = 0;
    for (unsigned shift = 0; shift < 64; shift += 7) {
      const std::uint8_t byte = U8();
      if (shift == 63 && byte > 1) break;
      v |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
      if (byte < 0x80) return ok_ ? v : 0;
    }
    ok_ = false;
    return 0;
  }
  std::uint32_t Varint32() {
    const std::uint64_t v = Varint();
    if (v > 0xffffffff) ok_ = false;
    return ok_ ? static_cast<std::uint32_t>(v) : 0;
  }
  // A count of things that take at least `min_bytes` each: one that the rest cannot hold fails here, before anything is
  // reserved.
  std::size_t Count(std::size_t min_bytes) {
    const std::uint64_t n = Varint();
    if (n > remaining() / min_bytes) ok_ = false;
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

 private:
  template <class U>
  U Fixed() {
    if (sizeof(U) > remaining()) ok_ = false;
    if (!ok_) return 0;
    U v = 0;
    for (std::size_t i = 0; i < sizeof(U); ++i) v = static_cast<U>(v | static_cast<U>(bytes_[at_ + i]) << (8 * i));
    at_ += sizeof(U);
    return v;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace tessera::region

// Fields of fixed width, little-endian, one after the other: how tokens and handshake datagrams are written and read.
//
// A reader never reads beyond its bytes: once one is missing, `ok()` is false and everything read is zero.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace tessera::net {

class WireWriter {
 public:
  template <class T>
  void Number(T value) {
    for (std::size_t i = 0; i < sizeof value; ++i) out_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  void Bytes(std::span<const std::uint8_t> bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }
  void Text(std::string_view text) { out_.insert(out_.end(), text.begin(), text.end()); }
  // Zeros up to a size in all.
  void PadTo(std::size_t size) { out_.resize(std::max(size, out_.size())); }
  std::size_t size() const { return out_.size(); }
  std::span<const std::uint8_t> written() const { return out_; }
  std::vector<std::uint8_t> Take() { return std::move(out_); }

 private:
  std::vector<std::uint8_t> out_;
};

class WireReader {
 public:
  explicit WireReader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  template <class T>
  T Number() {
    const std::span<const std::uint8_t> from = Bytes(sizeof(T));
    T value = 0;
    for (std::size_t i = 0; i < from.size(); ++i) value = static_cast<T>(value | static_cast<T>(from[i]) << (8 * i));
    return value;
  }
  // Empty once bytes are missing.
  std::span<const std::uint8_t> Bytes(std::size_t count) {
    if (count > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const auto taken = rest_.first(count);
    rest_ = rest_.subspan(count);
    return taken;
  }
  template <std::size_t kCount>
  void Fill(std::array<std::uint8_t, kCount>& to) {
    const auto from = Bytes(kCount);
    std::copy(from.begin(), from.end(), to.begin());
  }
  bool ok() const { return ok_; }
  std::span<const std::uint8_t> rest() const { return rest_; }

 private:
  std::span<const std::uint8_t> rest_;
  bool ok_ = true;
};

}  // namespace tessera::net

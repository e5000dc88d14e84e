// Secret: key material of a fixed size. It is wiped when it ends, compared in constant time and never printed.
#pragma once

#include <sodium.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <ostream>

namespace tessera::net {

template <std::size_t kBytes>
class Secret {
 public:
  Secret() = default;  // zeros
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { sodium_memzero(bytes_.data(), kBytes); }

  std::uint8_t* data() { return bytes_.data(); }
  const std::uint8_t* data() const { return bytes_.data(); }
  static constexpr std::size_t size() { return kBytes; }

  friend bool operator==(const Secret& a, const Secret& b) {
    return sodium_memcmp(a.bytes_.data(), b.bytes_.data(), kBytes) == 0;
  }
  friend std::ostream& operator<<(std::ostream& out, const Secret&) { return out << "(secret)"; }

 private:
  std::array<std::uint8_t, kBytes> bytes_{};
};

}  // namespace tessera::net

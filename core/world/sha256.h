// The checksum of files that workers, agents and the control plane give each other, and of scenes that clients fetch.
//
//   Sha256 sum;
//   sum.Add(first_part);
//   sum.Add(second_part);
//   const Sha256::Digest digest = sum.Finish();
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace tessera {

// SHA-256 (FIPS 180-4) in 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);
inline constexpr std::size_t kSha256Digits = 64;
// Whether `text` has the form of such a hash.
bool IsSha256Hex(std::string_view text);

// The same, of bytes that come in parts.
class Sha256 {
 public:
  using Digest = std::array<std::uint8_t, 32>;

  Sha256();
  ~Sha256();
  void Add(std::span<const std::uint8_t> bytes);
  // The hash of all that was added; then it begins anew.
  Digest Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tessera

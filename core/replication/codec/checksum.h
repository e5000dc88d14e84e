// CRC-32C (Castagnoli), the checksum of what is stored or sent. It finds every single flipped bit and every burst of up
// to 32 bits; it does not protect against forgery. Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tessera::replication {

namespace checksum_detail {
constexpr std::array<std::uint32_t, 256> MakeTable(std::uint32_t polynomial) {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t word = i;
    for (int bit = 0; bit < 8; ++bit) word = (word & 1) != 0 ? (word >> 1) ^ polynomial : word >> 1;
    table[i] = word;
  }
  return table;
}
inline constexpr std::array<std::uint32_t, 256> kTable = MakeTable(0x82f63b78);
}  // namespace checksum_detail

// `seed` makes checksums of different formats or settings differ.
constexpr std::uint32_t Crc32c(std::span<const std::uint8_t> bytes, std::uint32_t seed = 0) {
  std::uint32_t crc = ~seed;
  for (const std::uint8_t byte : bytes) crc = checksum_detail::kTable[(crc ^ byte) & 0xff] ^ (crc >> 8);
  return ~crc;
}
}  // namespace tessera::replication

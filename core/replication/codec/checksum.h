// Checksums of what is stored or sent: CRC-32C (Castagnoli) and CRC-16 (CCITT). Each finds every single flipped bit and
// every burst up to its own width; against forgery neither helps. Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace tessera::replication {

namespace checksum_detail {
template <class Word, Word kPolynomial>
constexpr std::array<Word, 256> MakeTable() {
  std::array<Word, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    auto word = static_cast<Word>(i);
    for (int bit = 0; bit < 8; ++bit) {
      word = static_cast<Word>((word & 1) != 0 ? (word >> 1) ^ kPolynomial : word >> 1);
    }
    table[i] = word;
  }
  return table;
}
inline constexpr auto kCrc32 = MakeTable<std::uint32_t, 0x82f63b78>();
inline constexpr auto kCrc16 = MakeTable<std::uint16_t, 0x8408>();
}  // namespace checksum_detail

// `seed` makes checksums of different formats or settings differ.
constexpr std::uint32_t Crc32c(std::span<const std::uint8_t> bytes, std::uint32_t seed = 0) {
  std::uint32_t crc = ~seed;
  for (const std::uint8_t byte : bytes) crc = checksum_detail::kCrc32[(crc ^ byte) & 0xff] ^ (crc >> 8);
  return ~crc;
}
constexpr std::uint16_t Crc16(std::span<const std::uint8_t> bytes, std::uint16_t seed = 0) {
  auto crc = static_cast<std::uint16_t>(~seed);
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(checksum_detail::kCrc16[(crc ^ byte) & 0xff] ^ (crc >> 8));
  }
  return static_cast<std::uint16_t>(~crc);
}

}  // namespace tessera::replication

#include "bench/snapshots_packer.h"

#include <algorithm>
#include <array>

namespace tessera::bench {
namespace {

using replication::BitReader;
using replication::BitWriter;
using replication::QuantizedState;

constexpr int kCountBits = 8, kIndexBits = 10;
constexpr std::array<int, 3> kPositionBits{18, 14, 18};
constexpr std::int64_t kOrientationLimit = 255;
constexpr int kComponentBits = 9;

bool Moved(const QuantizedState& a, const QuantizedState& b) { return a.position != b.position; }
bool Turned(const QuantizedState& a, const QuantizedState& b) {
  return a.largest != b.largest || a.smallest != b.smallest;
}

// Small offsets in 5 bits; beyond them those up to `large` more, in as many bits as that takes.
struct Offsets {
  static constexpr std::int64_t kSmall = 16;
  std::int64_t large;
  int large_bits;

  static bool Small(std::int64_t d) { return d >= -kSmall && d < kSmall; }
  bool Fits(std::int64_t d) const { return d >= -large - kSmall && d < large + kSmall; }
  int Write(BitWriter& writer, std::int64_t d) const {
    if (Small(d)) {
      writer.Write(static_cast<std::uint64_t>(d + kSmall), 5);
      return 5;
    }
    const std::int64_t beyond = d < 0 ? d + kSmall : d - kSmall;
    writer.Write(static_cast<std::uint64_t>(beyond + large), large_bits);
    return large_bits;
  }
  std::int64_t Read(BitReader& reader, bool small) const {
    if (small) return static_cast<std::int64_t>(reader.Read(5)) - kSmall;
    const std::int64_t beyond = static_cast<std::int64_t>(reader.Read(large_bits)) - large;
    return beyond < 0 ? beyond - kSmall : beyond + kSmall;
  }
};
constexpr Offsets kPositionOffsets{256, 9}, kOrientationOffsets{128, 8};

// Three numbers against three others: 0 if one does not fit, or 1, whether each is small, the numbers.
std::size_t WriteRelative(BitWriter& writer, const Offsets& offsets, const std::array<std::int64_t, 3>& d) {
  std::size_t bits = 4;
  writer.WriteBit(true);
  for (const std::int64_t c : d) writer.WriteBit(Offsets::Small(c));
  for (const std::int64_t c : d) bits += static_cast<std::size_t>(offsets.Write(writer, c));
  return bits;
}

std::array<std::int64_t, 3> ReadRelative(BitReader& reader, const Offsets& offsets) {
  std::array<bool, 3> small{};
  std::array<std::int64_t, 3> d{};
  for (bool& s : small) s = reader.ReadBit();
  for (std::size_t i = 0; i < 3; ++i) d[i] = offsets.Read(reader, small[i]);
  return d;
}

std::size_t WritePosition(BitWriter& writer, bool relative, const QuantizedState& now, const QuantizedState& base) {
  std::array<std::int64_t, 3> d{};
  for (std::size_t i = 0; i < 3; ++i) d[i] = now.position[i] - base.position[i];
  const bool fits = std::all_of(d.begin(), d.end(), [](std::int64_t c) { return kPositionOffsets.Fits(c); });
  if (relative && fits) return WriteRelative(writer, kPositionOffsets, d);
  if (relative) writer.WriteBit(false);
  std::size_t bits = relative ? 1 : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint64_t mask = (std::uint64_t{1} << kPositionBits[i]) - 1;
    writer.Write(static_cast<std::uint64_t>(now.position[i]) & mask, kPositionBits[i]);
    bits += static_cast<std::size_t>(kPositionBits[i]);
  }
  return bits;
}

std::size_t WriteOrientation(BitWriter& writer, bool relative, const QuantizedState& now, const QuantizedState& base) {
  std::array<std::int64_t, 3> d{};
  for (std::size_t i = 0; i < 3; ++i) d[i] = now.smallest[i] - base.smallest[i];
  const bool fits = now.largest == base.largest &&
                    std::all_of(d.begin(), d.end(), [](std::int64_t c) { return kOrientationOffsets.Fits(c); });
  if (relative && fits) return WriteRelative(writer, kOrientationOffsets, d);
  if (relative) writer.WriteBit(false);
  writer.Write(now.largest, 2);
  for (const std::int16_t c : now.smallest) {
    writer.Write(static_cast<std::uint64_t>(c + kOrientationLimit), kComponentBits);
  }
  return (relative ? 1u : 0u) + 2 + 3 * kComponentBits;
}

void PackCube(BitWriter& writer, PackerStep step, const QuantizedState& now, const QuantizedState& base,
              PackedBits& bits) {
  const bool moved = Moved(now, base), turned = Turned(now, base);
  writer.WriteBit(now.asleep);
  writer.WriteBit(moved);
  writer.WriteBit(turned);
  bits.flags += 3;
  if (moved) bits.position += WritePosition(writer, step >= PackerStep::kRelativePosition, now, base);
  if (turned) bits.orientation += WriteOrientation(writer, step >= PackerStep::kRelativeOrientation, now, base);
}

// The distance to the changed cube before: 4, 7 or 12 bits.
constexpr int IndexBits(std::size_t distance) { return distance <= 8 ? 4 : distance <= 40 ? 7 : 12; }

void WriteIndex(BitWriter& writer, std::size_t distance) {
  writer.WriteBit(distance <= 8);
  if (distance <= 8) return writer.Write(distance - 1, 3);
  writer.WriteBit(distance <= 40);
  if (distance <= 40) return writer.Write(distance - 9, 5);
  writer.Write(distance - 41, kIndexBits);
}
std::size_t ReadIndex(BitReader& reader) {
  if (reader.ReadBit()) return reader.Read(3) + 1;
  if (reader.ReadBit()) return reader.Read(5) + 9;
  return reader.Read(kIndexBits) + 41;
}

void UnpackCube(BitReader& reader, const QuantizedState& base, QuantizedState& now) {
  now = base;
  now.asleep = reader.ReadBit();
  const bool moved = reader.ReadBit(), turned = reader.ReadBit();
  if (moved && reader.ReadBit()) {
    const std::array<std::int64_t, 3> d = ReadRelative(reader, kPositionOffsets);
    for (std::size_t i = 0; i < 3; ++i) now.position[i] += d[i];
  } else if (moved) {
    for (std::size_t i = 0; i < 3; ++i) now.position[i] = static_cast<std::int64_t>(reader.Read(kPositionBits[i]));
  }
  if (turned && reader.ReadBit()) {
    const std::array<std::int64_t, 3> d = ReadRelative(reader, kOrientationOffsets);
    for (std::size_t i = 0; i < 3; ++i) now.smallest[i] = static_cast<std::int16_t>(now.smallest[i] + d[i]);
  } else if (turned) {
    now.largest = static_cast<std::uint8_t>(reader.Read(2));
    for (std::int16_t& c : now.smallest) {
      c = static_cast<std::int16_t>(static_cast<std::int64_t>(reader.Read(kComponentBits)) - kOrientationLimit);
    }
  }
}

}  // namespace

std::span<const FixedStep> FixedSteps() {
  static constexpr std::array<FixedStep, 5> kSteps{{{"raw", 4 * 32 + 3 * 32 + 3 * 32 + 1},
                                                    {"smallest three", 29 + 3 * 32 + 3 * 32 + 1},
                                                    {"velocity 33", 29 + 33 + 3 * 32 + 1},
                                                    {"no velocity", 29 + 3 * 32 + 1},
                                                    {"position 512", 29 + 18 + 18 + 14 + 1}}};
  return kSteps;
}

PackedBits PackCubes(BitWriter& writer, PackerStep step, const CubeStates& now, const CubeStates& base) {
  PackedBits bits;
  std::vector<std::size_t> changed;
  std::size_t index_bits = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i] == base[i]) continue;
    index_bits += changed.empty() ? kIndexBits : static_cast<std::size_t>(IndexBits(i - changed.back()));
    changed.push_back(i);
  }
  const bool by_index = step >= PackerStep::kRelativeIndex && index_bits < 900 && changed.size() < (1u << kCountBits);
  if (step >= PackerStep::kRelativeIndex) {
    writer.WriteBit(by_index);
    ++bits.index;
  }
  if (!by_index) {
    bits.index += now.size();
    for (std::size_t i = 0; i < now.size(); ++i) {
      writer.WriteBit(now[i] != base[i]);
      if (now[i] != base[i]) PackCube(writer, step, now[i], base[i], bits);
    }
    return bits;
  }
  bits.index += kCountBits + index_bits;
  writer.Write(changed.size(), kCountBits);
  for (std::size_t n = 0; n < changed.size(); ++n) {
    if (n == 0) {
      writer.Write(changed[0], kIndexBits);
    } else {
      WriteIndex(writer, changed[n] - changed[n - 1]);
    }
    PackCube(writer, step, now[changed[n]], base[changed[n]], bits);
  }
  return bits;
}

bool UnpackCubes(std::span<const std::uint8_t> bytes, const CubeStates& base, CubeStates& now) {
  BitReader reader(bytes);
  now = base;
  if (!reader.ReadBit()) {
    for (std::size_t i = 0; i < base.size(); ++i) {
      if (reader.ReadBit()) UnpackCube(reader, base[i], now[i]);
    }
    return reader.ok();
  }
  const std::size_t count = reader.Read(kCountBits);
  std::size_t at = 0;
  for (std::size_t n = 0; n < count; ++n) {
    at = n == 0 ? reader.Read(kIndexBits) : at + ReadIndex(reader);
    if (at >= base.size()) return false;
    UnpackCube(reader, base[at], now[at]);
  }
  return reader.ok();
}

}  // namespace tessera::bench

// The bit packer that codecs are held against: the steps of G. Fiedler's "Snapshot Compression" (2015), done again from
// his description. Each step takes one idea on; the last, kRelativeOrientation, is the whole packer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/replication/bit_stream.h"
#include "core/replication/quantize.h"

namespace tessera::bench {

// Steps in which every cube costs the same.
struct FixedStep {
  const char* name;
  int bits_a_cube;
};
std::span<const FixedStep> FixedSteps();

struct PackedBits {
  std::size_t index = 0, flags = 0, position = 0, orientation = 0;
  std::size_t total() const { return index + flags + position + orientation; }
};

enum class PackerStep : std::uint8_t {
  kChangedBit,           // a bit for each cube; the changed ones whole
  kRelativeIndex,        // changed ones by their distance in the list
  kRelativePosition,     // positions against the baseline
  kRelativeOrientation,  // orientations as well: the bit packer
};

using CubeStates = std::vector<replication::QuantizedState>;

// Bits that were written, by part.
PackedBits PackCubes(replication::BitWriter& writer, PackerStep step, const CubeStates& now, const CubeStates& base);
// Reads a kRelativeOrientation; false if truncated.
bool UnpackCubes(std::span<const std::uint8_t> bytes, const CubeStates& base, CubeStates& now);

}  // namespace tessera::bench

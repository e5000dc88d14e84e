// Fast records: one body's pose as a few fixed codes against its prediction. The coder for live clients: no state but
// the samples named, so what one client needs serves every other that has acknowledged the same ones.
//
//   PackedRecord packed = PackPose(prediction, base, state, limit);   // once for (body, samples)
//   for (each client with those samples) packed.AppendTo(writer);
//   ...
//   if (!ReadPose(reader, prediction, base, limit, state)) return error;
//
// A number is an exponential Golomb code of its zigzag whose parameter follows from how much was predicted to happen
// (Prediction::move_bits, turn_bits): a body that hardly moves misses by little, and so does one that flies. The tables
// were measured on the 901 cubes of bench/snapshots_trace.h.
//
// clang-format off
//   record     1: awake, moved and turned, or 0, asleep 1, moved 1, turned 1; [position], [orientation]
//   moved      0: position as in the baseline;  1: three eg(k) residuals against the prediction, y first
//   turned     0: orientation as in the baseline;  1: the predicted component is largest 1 or (0, which 2),
//              three eg(k) residuals
//   eg(k)      of z, with n = floor(log2(z / 2^k + 1)): n ones, a zero, then the k + n low bits of z + 2^k
// clang-format on
//
// Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <bit>
#include <cassert>

#include "core/replication/bit_stream.h"
#include "core/replication/codec/predict.h"

namespace tessera::replication {

// A record's bits where they lie: of a PackedRecord, or in a store of many.
struct PackedView {
  const std::uint64_t* words = nullptr;
  int bits = 0;

  void AppendTo(BitWriter& writer) const {
    if (bits == 0) return;
    std::size_t i = 0;
    int left = bits;
    for (; left > 64; left -= 64) writer.Write(words[i++], 64);
    writer.Write(words[i], left);
  }
};

// A record's bits, ready to be appended to any datagram.
struct PackedRecord {
  // 4 flags, 3 residuals of 47 bits in up to 95 each, which is largest in 3, 3 residuals of 18 bits in up to 37 each. A
  // full record (record_codec.h) takes up to 758.
  static constexpr std::size_t kMaxWords = 12;
  std::array<std::uint64_t, kMaxWords> words{};
  int bits = 0;

  void Append(std::uint64_t value, int count) {
    assert(count >= 0 && count <= 64 && bits + count <= static_cast<int>(kMaxWords * 64));
    assert(count == 64 || value >> count == 0);
    if (count == 0) return;
    const auto word = static_cast<std::size_t>(bits / 64);
    const int shift = bits % 64;
    words[word] |= value << shift;
    if (shift + count > 64) words[word + 1] |= value >> (64 - shift);
    bits += count;
  }
  void AppendTo(BitWriter& writer) const { view().AppendTo(writer); }
  PackedView view() const { return {words.data(), bits}; }
};

// eg(k). Reading: false where the residual has more than `max_bits`.
void AppendGolomb(PackedRecord& record, std::int64_t residual, int k);
bool ReadGolombSlowly(BitReader& reader, int k, int max_bits, std::int64_t& residual);
inline bool ReadGolomb(BitReader& reader, int k, int max_bits, std::int64_t& residual) {
  if (!reader.HasWord()) return ReadGolombSlowly(reader, k, max_bits, residual);
  const std::uint64_t word = reader.Word();
  const int n = std::countr_one(word), low = k + n, whole = n + 1 + low;
  if (whole > BitReader::kWordBits || low > max_bits) return ReadGolombSlowly(reader, k, max_bits, residual);
  reader.Skip(whole);
  const std::uint64_t top = std::uint64_t{1} << low;
  residual = UnZigZag(((word >> (n + 1) & (top - 1)) | top) - (std::uint64_t{1} << k));
  return true;
}

// Velocities are left out. `limit`: Quantizer::orientation_limit().
PackedRecord PackPose(const Prediction& prediction, const QuantizedState& base, const QuantizedState& state,
                      std::int32_t limit);
// False where a number is out of its range; reading past the end shows in reader.ok().
bool ReadPose(BitReader& reader, const Prediction& prediction, const QuantizedState& base, std::int32_t limit,
              QuantizedState& state);
// The same in two parts. The first says whether the second follows, which alone needs the predicted turn.
bool ReadMove(BitReader& reader, const Prediction& prediction, const QuantizedState& base, QuantizedState& state,
              bool& turned);
bool ReadTurn(BitReader& reader, const Prediction& prediction, std::int32_t limit, QuantizedState& state);

}  // namespace tessera::replication

#include "core/replication/codec/fast_record.h"

#include <algorithm>
#include <bit>

namespace tessera::replication {
namespace {

// Parameters of the codes, by the length of the predicted move and turn.
constexpr std::array<std::uint8_t, 12> kMoveParameter = {1, 1, 2, 3, 3, 4, 5, 5, 6, 6, 6, 6};
constexpr std::array<std::uint8_t, 10> kTurnParameter = {1, 1, 2, 3, 3, 4, 4, 5, 5, 6};
constexpr std::array<std::size_t, 3> kAxes = {1, 0, 2};
// Longest zigzag residuals: of two positions, of two components.
constexpr int kMostPositionBits = 47, kMaxOrientationBits = 18;

constexpr int kFlyingParameter = 2;  // both parameters of a body that falls freely

template <std::size_t kSize>
int Parameter(const std::array<std::uint8_t, kSize>& table, const Prediction& prediction, int bits) {
  return prediction.flies ? kFlyingParameter : table[std::min(static_cast<std::size_t>(bits), kSize - 1)];
}

}  // namespace

void AppendGolomb(PackedRecord& record, std::int64_t residual, int k) {
  const std::uint64_t shifted = ZigZag(residual) + (std::uint64_t{1} << k);
  const int bits = static_cast<int>(std::bit_width(shifted)) - 1;  // k + n
  const int n = bits - k;
  const std::uint64_t ones = (std::uint64_t{1} << n) - 1, rest = shifted - (std::uint64_t{1} << bits);
  if (n + 1 + bits <= 64) return record.Append(ones | rest << (n + 1), n + 1 + bits);  // a zero is above the ones
  record.Append(ones, n + 1);
  record.Append(rest, bits);
}

bool ReadGolombSlowly(BitReader& reader, int k, int max_bits, std::int64_t& residual) {
  int n = 0;
  while (reader.ReadBit()) {
    if (k + ++n > max_bits) return false;
  }
  const std::uint64_t shifted = reader.Read(k + n) + (std::uint64_t{1} << (k + n));
  residual = UnZigZag(shifted - (std::uint64_t{1} << k));
  return true;
}

PackedRecord PackPose(const Prediction& prediction, const QuantizedState& base, const QuantizedState& state,
                      std::int32_t limit) {
  PackedRecord record;
  const bool moved = state.position != base.position;
  const bool turned = !SameTurn(state, base);
  if (!state.asleep && moved && turned) {
    record.Append(1, 1);
  } else {
    record.Append((state.asleep ? 2u : 0u) | (moved ? 4u : 0u) | (turned ? 8u : 0u), 4);
  }
  if (moved) {
    const int k = Parameter(kMoveParameter, prediction, prediction.move_bits);
    for (const std::size_t axis : kAxes) AppendGolomb(record, state.position[axis] - prediction.position[axis], k);
  }
  if (!turned) return record;
  const bool expected = state.largest == LargestOf(prediction.orientation);
  record.Append(expected ? 1 : 0, 1);
  if (!expected) record.Append(state.largest, 2);
  const int k = Parameter(kTurnParameter, prediction, prediction.turn_bits);
  const std::array<std::int16_t, 3> predicted = ToSmallest(prediction.orientation, state.largest, limit);
  for (std::size_t i = 0; i < 3; ++i) AppendGolomb(record, state.smallest[i] - predicted[i], k);
  return record;
}

bool ReadPose(BitReader& reader, const Prediction& prediction, const QuantizedState& base, std::int32_t limit,
              QuantizedState& state) {
  bool turned = false;
  return ReadMove(reader, prediction, base, state, turned) && (!turned || ReadTurn(reader, prediction, limit, state));
}

bool ReadMove(BitReader& reader, const Prediction& prediction, const QuantizedState& base, QuantizedState& state,
              bool& turned) {
  state = QuantizedState();
  state.position = base.position;
  state.largest = base.largest;
  state.smallest = base.smallest;
  const bool usual = reader.ReadBit();
  const std::uint64_t flags = usual ? 6 : reader.Read(3);
  state.asleep = (flags & 1) != 0;
  const bool moved = (flags & 2) != 0;
  turned = (flags & 4) != 0;
  if (moved) {
    const int k = Parameter(kMoveParameter, prediction, prediction.move_bits);
    for (const std::size_t axis : kAxes) {
      std::int64_t residual = 0;
      if (!ReadGolomb(reader, k, kMostPositionBits, residual)) return false;
      if (residual < -2 * kMaxPosition || residual > 2 * kMaxPosition) return false;
      state.position[axis] = prediction.position[axis] + residual;
      if (state.position[axis] < -kMaxPosition || state.position[axis] > kMaxPosition) return false;
    }
  }
  return true;
}

bool ReadTurn(BitReader& reader, const Prediction& prediction, std::int32_t limit, QuantizedState& state) {
  state.largest = reader.ReadBit() ? LargestOf(prediction.orientation) : static_cast<std::uint8_t>(reader.Read(2));
  const int k = Parameter(kTurnParameter, prediction, prediction.turn_bits);
  const std::array<std::int16_t, 3> predicted = ToSmallest(prediction.orientation, state.largest, limit);
  for (std::size_t i = 0; i < 3; ++i) {
    std::int64_t residual = 0;
    if (!ReadGolomb(reader, k, kMaxOrientationBits, residual)) return false;
    const std::int64_t value = predicted[i] + residual;
    if (value < -limit || value > limit) return false;
    state.smallest[i] = static_cast<std::int16_t>(value);
  }
  return true;
}

}  // namespace tessera::replication

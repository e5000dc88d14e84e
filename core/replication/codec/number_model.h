// NumberModel: integers around 0, as bits that models learn: the number of bits of the magnitude (in unary), the sign,
// and the magnitude below its highest bit, of which the upper two are learnt and the rest is even odds.
//
// Mixed numbers see each of these bits from several contexts at once; plain ones from one. A number of up to kMaxLength
// bits can be coded. Thread rule: as bit_model.h.
#pragma once

#include <bit>
#include <cassert>

#include "core/replication/codec/bit_model.h"

namespace tessera::replication {

// One context's view.
struct NumberModel {
  static constexpr int kLengths = 14;  // longer ones go on in even odds
  static constexpr int kTops = 8;
  std::array<BitModel, kLengths> length;
  BitModel sign;
  std::array<std::array<BitModel, 3>, kTops + 1> top;  // by length; the highest bit below the leading one, then the
                                                       // next one by what that was
};

template <std::size_t kModels>
struct NumberMixer {
  std::array<BitMixer<kModels>, NumberModel::kLengths> length;
  BitMixer<kModels> sign;
  std::array<std::array<BitMixer<kModels>, 2>, NumberModel::kTops + 1> top;
};

inline constexpr int kMaxLength = 62;

constexpr std::uint64_t Magnitude(std::int64_t value) {
  return value < 0 ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
}
constexpr int LengthOf(std::int64_t value) { return static_cast<int>(std::bit_width(Magnitude(value))); }

template <class Coder, std::size_t kModels>
void Code(Coder& coder, std::int64_t& value, const std::array<NumberModel*, kModels>& models,
          NumberMixer<kModels>& mixer) {
  std::array<BitModel*, kModels> at{};
  const auto code = [&](bool& bit, const auto& select, BitMixer<kModels>& mix) {
    for (std::size_t i = 0; i < kModels; ++i) at[i] = select(*models[i]);
    Code(coder, bit, at, mix);
  };
  const int true_length = LengthOf(value);
  assert(true_length <= kMaxLength);
  int length = 0;
  for (; length < kMaxLength; ++length) {
    bool more = length < true_length;
    if (length < NumberModel::kLengths) {
      code(
          more, [&](NumberModel& m) { return &m.length[static_cast<std::size_t>(length)]; },
          mixer.length[static_cast<std::size_t>(length)]);
    } else {
      Code(coder, more, kEvenOdds);
    }
    if (!more) break;
  }
  if (length == 0) {
    value = 0;
    return;
  }
  bool negative = value < 0;
  code(
      negative, [](NumberModel& m) { return &m.sign; }, mixer.sign);
  const std::uint64_t wanted = Magnitude(value);
  std::uint64_t magnitude = 1;
  for (int i = length - 2; i >= 0; --i) {
    bool bit = (wanted >> i & 1) != 0;
    const int depth = length - 2 - i;
    if (depth < 2 && length <= NumberModel::kTops) {
      const std::size_t node = depth == 0 ? 0 : 1 + (magnitude & 1);
      const auto by_length = static_cast<std::size_t>(length);
      code(
          bit, [&](NumberModel& m) { return &m.top[by_length][node]; },
          mixer.top[by_length][static_cast<std::size_t>(depth)]);
    } else {
      Code(coder, bit, kEvenOdds);
    }
    magnitude = 2 * magnitude + (bit ? 1 : 0);
  }
  value = negative ? -static_cast<std::int64_t>(magnitude) : static_cast<std::int64_t>(magnitude);
}

// A number in one context alone.
struct PlainNumber {
  NumberModel model;
  NumberMixer<1> mixer;
};
template <class Coder>
void Code(Coder& coder, std::int64_t& value, PlainNumber& plain) {
  Code(coder, value, std::array<NumberModel*, 1>{&plain.model}, plain.mixer);
}

}  // namespace tessera::replication

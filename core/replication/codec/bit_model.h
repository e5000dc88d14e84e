// BitModel and BitMixer: how likely a bit is, learnt from what went before. Both ends learn the same, in integers.
//
//   BitModel model;                                  // one context
//   Code(coder, bit, model);                         // coder: RangeEncoder writes `bit`, RangeDecoder reads it
//   const std::array<BitModel*, 3> models = {...};   // the same bit as three contexts see it
//   Code(coder, bit, models, mixer);
//
// A model moves to each bit by 1 / (n + 1.6), n the bits it has seen up to a limit: quick at first, steady later. A
// mixer adds the models' opinions as log odds with weights that follow whoever was right (logistic mixing: M. Mahoney,
// "Adaptive Weighing of Context Models for Lossless Data Compression", 2005).
// Thread rule: one thread at a time; plain data, copied as a whole when a state is kept.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/replication/codec/range_coder.h"

namespace tessera::replication {

// Log odds are in 1/256, within +-kMaxLogOdds.
inline constexpr std::int32_t kMaxLogOdds = 2047;

// 2^16 / (1 + exp(-x / 256)); a table of every 64th, and straight lines between.
constexpr std::uint32_t Squash(std::int32_t log_odds) {
  constexpr std::array<std::uint16_t, 65> kTable = {
      22,    28,    36,    47,    60,    77,    98,    126,   162,   208,   267,   342,   439,
      562,   720,   922,   1179,  1506,  1921,  2446,  3108,  3938,  4971,  6249,  7812,  9702,
      11955, 14595, 17625, 21025, 24743, 28693, 32768, 36843, 40793, 44511, 47911, 50941, 53581,
      55834, 57724, 59287, 60565, 61598, 62428, 63090, 63615, 64030, 64357, 64614, 64816, 64974,
      65097, 65194, 65269, 65328, 65374, 65410, 65438, 65459, 65476, 65489, 65500, 65508, 65514};
  const std::int32_t x = std::clamp(log_odds, -kMaxLogOdds, kMaxLogOdds) + 2048;
  const auto at = static_cast<std::size_t>(x >> 6);
  const std::int32_t share = x & 63;
  return static_cast<std::uint32_t>((kTable[at] * (64 - share) + kTable[at + 1] * share) >> 6);
}

namespace bit_model_detail {

// The inverse of Squash, by the upper 12 bits of the odds.
constexpr std::array<std::int16_t, 4096> MakeStretch() {
  std::array<std::int16_t, 4096> table{};
  std::int32_t x = -kMaxLogOdds;
  for (std::size_t i = 0; i < table.size(); ++i) {
    while (x < kMaxLogOdds && Squash(x) < 16 * i + 8) ++x;
    table[i] = static_cast<std::int16_t>(x);
  }
  return table;
}
inline constexpr std::array<std::int16_t, 4096> kStretch = MakeStretch();

constexpr std::uint32_t kMaxSeen = 60;  // the limit of n: measured best on piles of cubes
constexpr std::array<std::uint16_t, kMaxSeen + 1> MakeRates() {
  std::array<std::uint16_t, kMaxSeen + 1> table{};
  for (std::uint32_t n = 0; n <= kMaxSeen; ++n) table[n] = static_cast<std::uint16_t>(655360 / (10 * n + 16));
  return table;
}
inline constexpr std::array<std::uint16_t, kMaxSeen + 1> kRates = MakeRates();

}  // namespace bit_model_detail

class BitModel {
 public:
  std::uint32_t odds() const { return std::clamp<std::uint32_t>(odds_, 24, 65536 - 24); }
  std::int32_t log_odds() const { return bit_model_detail::kStretch[odds_ >> 4]; }
  void Learn(bool bit) {
    const std::int32_t target = bit ? 65535 : 0;
    odds_ =
        static_cast<std::uint16_t>(odds_ + (((target - odds_) * std::int64_t{bit_model_detail::kRates[seen_]}) >> 16));
    if (seen_ < bit_model_detail::kMaxSeen) ++seen_;
  }

 private:
  std::uint16_t odds_ = kEvenOdds;
  std::uint16_t seen_ = 0;
};

template <std::size_t kModels>
class BitMixer {
 public:
  BitMixer() { weights_.fill(65536 / static_cast<std::int32_t>(kModels) + 65536 / 8); }

  std::uint32_t Mix(const std::array<BitModel*, kModels>& models) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < kModels; ++i) {
      inputs_[i] = models[i]->log_odds();
      sum += std::int64_t{inputs_[i]} * weights_[i];
    }
    return mixed_ = Squash(static_cast<std::int32_t>(std::clamp<std::int64_t>(sum >> 16, -kMaxLogOdds, kMaxLogOdds)));
  }
  // After Mix: the bit that came.
  void Learn(bool bit, const std::array<BitModel*, kModels>& models) {
    const std::int32_t error = (bit ? 65535 : 0) - static_cast<std::int32_t>(mixed_);
    for (std::size_t i = 0; i < kModels; ++i) {
      const std::int64_t change = (std::int64_t{inputs_[i]} * error * kRate + (1 << 17)) >> 18;
      weights_[i] = static_cast<std::int32_t>(std::clamp<std::int64_t>(weights_[i] + change, -kMaxWeight, kMaxWeight));
      models[i]->Learn(bit);
    }
  }

 private:
  static constexpr std::int32_t kRate = 8, kMaxWeight = 1 << 20;
  std::array<std::int32_t, kModels> weights_;  // in 1 / 2^16
  std::array<std::int32_t, kModels> inputs_{};
  std::uint32_t mixed_ = kEvenOdds;
};

// One bit either way: a RangeEncoder writes `bit`, a RangeDecoder sets it. So a format is written down once for both.
inline void Code(RangeEncoder& coder, bool& bit, std::uint32_t odds) { coder.Encode(bit, odds); }
inline void Code(RangeDecoder& coder, bool& bit, std::uint32_t odds) { bit = coder.Decode(odds); }

template <class Coder>
void Code(Coder& coder, bool& bit, BitModel& model) {
  Code(coder, bit, model.odds());
  model.Learn(bit);
}
template <class Coder, std::size_t kModels>
void Code(Coder& coder, bool& bit, const std::array<BitModel*, kModels>& models, BitMixer<kModels>& mixer) {
  Code(coder, bit, mixer.Mix(models));
  mixer.Learn(bit, models);
}

}  // namespace tessera::replication

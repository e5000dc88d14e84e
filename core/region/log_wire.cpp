#include "core/region/log_wire.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace tessera::region {
namespace {

// A state as words: doubles of position and orientation, then floats of both velocities, momentum and still time.
constexpr std::size_t kDoubles = 7, kFloats = 10, kWords = kDoubles + kFloats;
using Words = std::array<std::uint64_t, kWords>;

// Which words a group has; each group that changed has a bit in the first byte.
struct Group {
  std::size_t first, end;
};
constexpr std::array<Group, 6> kGroups{{{0, 3}, {3, 7}, {7, 10}, {10, 13}, {13, 16}, {16, 17}}};
constexpr std::uint8_t kSleeps = 1 << 6, kKnownBits = (1 << 7) - 1;

Words ToWords(const BodyState& s) {
  const auto d = [](double v) { return std::bit_cast<std::uint64_t>(v); };
  const auto f = [](float v) { return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(v)); };
  return {d(s.position.x),
          d(s.position.y),
          d(s.position.z),
          d(s.orientation.x),
          d(s.orientation.y),
          d(s.orientation.z),
          d(s.orientation.w),
          f(s.linear_velocity.x),
          f(s.linear_velocity.y),
          f(s.linear_velocity.z),
          f(s.angular_velocity.x),
          f(s.angular_velocity.y),
          f(s.angular_velocity.z),
          f(s.angular_momentum.x),
          f(s.angular_momentum.y),
          f(s.angular_momentum.z),
          f(s.still_s)};
}

BodyState FromWords(const Words& w, bool asleep) {
  const auto d = [&](std::size_t i) { return std::bit_cast<double>(w[i]); };
  const auto f = [&](std::size_t i) { return std::bit_cast<float>(static_cast<std::uint32_t>(w[i])); };
  BodyState s;
  s.position = {d(0), d(1), d(2)};
  s.orientation = {d(3), d(4), d(5), d(6)};
  s.linear_velocity = {f(7), f(8), f(9)};
  s.angular_velocity = {f(10), f(11), f(12)};
  s.angular_momentum = {f(13), f(14), f(15)};
  s.still_s = f(16);
  s.asleep = asleep;
  return s;
}

// Where the position will be found, given the velocity after the tick: what a step of free motion does, so the rest is
// rounding and what contacts push.
void PredictPosition(Words& words, const BodyState& base, const Words& now, double tick_s) {
  const auto v = [&](std::size_t i) {
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(now[i])));
  };
  words[0] = std::bit_cast<std::uint64_t>(base.position.x + v(7) * tick_s);
  words[1] = std::bit_cast<std::uint64_t>(base.position.y + v(8) * tick_s);
  words[2] = std::bit_cast<std::uint64_t>(base.position.z + v(9) * tick_s);
}

// Differences of 32 bits wrap in 32 bits.
std::uint64_t Difference(std::size_t word, std::uint64_t value, std::uint64_t predicted) {
  if (word < kDoubles) {
    const auto d = static_cast<std::int64_t>(value - predicted);
    return (static_cast<std::uint64_t>(d) << 1) ^ static_cast<std::uint64_t>(d >> 63);
  }
  const auto d = static_cast<std::int32_t>(static_cast<std::uint32_t>(value - predicted));
  return static_cast<std::uint32_t>((static_cast<std::uint32_t>(d) << 1) ^ static_cast<std::uint32_t>(d >> 31));
}

std::uint64_t Sum(std::size_t word, std::uint64_t difference, std::uint64_t predicted) {
  const std::uint64_t d = (difference >> 1) ^ (0 - (difference & 1));
  const std::uint64_t value = predicted + d;
  return word < kDoubles ? value : static_cast<std::uint32_t>(value);
}

std::size_t BytesOf(std::uint64_t v) { return (static_cast<std::size_t>(std::bit_width(v)) + 7) / 8; }

}  // namespace

std::uint8_t* PackState(std::uint8_t* out, const BodyState& state, const BodyState* base, double tick_s) {
  const Words now = ToWords(state);
  Words predicted{};
  bool still = false;  // at the same place: nothing is predicted then
  if (base != nullptr) {
    predicted = ToWords(*base);
    still = predicted[0] == now[0] && predicted[1] == now[1] && predicted[2] == now[2];
    if (!still) PredictPosition(predicted, *base, now, tick_s);
  }
  std::uint8_t* const head = out++;
  std::uint8_t groups = state.asleep ? kSleeps : std::uint8_t{0};
  std::array<std::uint64_t, kWords> differences;  // in the groups that are written
  std::size_t written = 0;
  std::array<std::uint8_t, kWords + 1> sizes;
  for (std::size_t g = 0; g < kGroups.size(); ++g) {
    std::uint64_t any = 0;
    const std::size_t before = written;
    for (std::size_t w = kGroups[g].first; w < kGroups[g].end; ++w) {
      const std::uint64_t difference = Difference(w, now[w], predicted[w]);
      any |= difference;
      sizes[written] = static_cast<std::uint8_t>(BytesOf(difference));
      differences[written++] = difference;
    }
    // A position that is given not at all is the one before; one that is as predicted is given in no bytes.
    const bool differs = g == 0 ? base == nullptr || !still : any != 0;
    if (differs) {
      groups |= static_cast<std::uint8_t>(1 << g);
    } else {
      written = before;
    }
  }
  *head = groups;
  sizes[written] = 0;
  for (std::size_t i = 0; i < written; i += 2) *out++ = static_cast<std::uint8_t>(sizes[i] | sizes[i + 1] << 4);
  static_assert(std::endian::native == std::endian::little);
  for (std::size_t i = 0; i < written; ++i) {
    std::memcpy(out, &differences[i], 8);
    out += sizes[i];
  }
  return out;
}

std::size_t UnpackState(std::span<const std::uint8_t> in, const BodyState* base, double tick_s, BodyState& state) {
  if (in.empty() || (in[0] & ~kKnownBits) != 0) return 0;
  const std::uint8_t groups = in[0];
  std::size_t count = 0;
  for (std::size_t g = 0; g < kGroups.size(); ++g) {
    if ((groups & (1 << g)) != 0) count += kGroups[g].end - kGroups[g].first;
  }
  std::size_t at = 1 + (count + 1) / 2;
  if (in.size() < at) return 0;
  std::array<std::uint64_t, kWords> differences{};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t size = i % 2 == 0 ? in[1 + i / 2] & 0xf : in[1 + i / 2] >> 4;
    if (size > 8 || size > in.size() - at) return 0;
    std::memcpy(&differences[i], in.data() + at, size);
    at += size;
  }
  const Words before = base == nullptr ? Words{} : ToWords(*base);
  Words words = before;
  // Velocities first: the position is predicted from them.
  std::size_t i = (groups & 1) != 0 ? 3 : 0;
  for (std::size_t g = 1; g < kGroups.size(); ++g) {
    if ((groups & (1 << g)) == 0) continue;
    for (std::size_t w = kGroups[g].first; w < kGroups[g].end; ++w) words[w] = Sum(w, differences[i++], before[w]);
  }
  if ((groups & 1) != 0) {
    if (base != nullptr) PredictPosition(words, *base, words, tick_s);
    for (std::size_t w = 0; w < 3; ++w) words[w] = Sum(w, differences[w], words[w]);
  }
  state = FromWords(words, (groups & kSleeps) != 0);
  return at;
}

// Four lanes of multiply and rotate, so that they do not wait for each other; each step is a bijection of the lane and
// of the word, hence no damage within one word is missed.
std::uint64_t LogChecksum(std::span<const std::uint8_t> bytes) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15u;
  std::array<std::uint64_t, 4> lanes{1, 2, 3, 4};
  const auto mix = [](std::uint64_t& lane, std::uint64_t word) { lane = std::rotl((lane ^ word) * kOdd, 29); };
  std::size_t at = 0;
  for (; bytes.size() - at >= 32; at += 32) {
    for (std::size_t l = 0; l < 4; ++l) {
      std::uint64_t word;
      std::memcpy(&word, bytes.data() + at + 8 * l, 8);
      mix(lanes[l], word);
    }
  }
  for (; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    mix(lanes[0], word);
  }
  std::uint64_t sum = bytes.size();
  for (const std::uint64_t lane : lanes) mix(sum, lane);
  return sum ^ (sum >> 32);
}

}  // namespace tessera::region

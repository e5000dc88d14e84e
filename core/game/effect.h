// Effect: the kinds of what game code asks for, as they are counted. A kind is the label of a metric, so there are few,
// and they follow from the table of functions, never from what a game calls anything.
//
// Thread rule: constants and plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace tessera::game {

enum class Effect : std::uint8_t {
  kProperty,
  kTimer,
  kMotion,
  kSpawn,
  kRemoval,
  kMessage,
  kExplosion,
  kJoint,
  kQuestion,
  kPlayer,
  kEvent,
  kPublished
};
inline constexpr std::size_t kEffects = 12;
inline constexpr std::array<std::string_view, kEffects> kEffectNames = {
    "property",  "timer", "motion",   "spawn",  "removal", "message",
    "explosion", "joint", "question", "player", "event",   "published"};

// The effect of a function of the table; nothing for one that only reads.
std::optional<Effect> EffectOf(std::uint32_t function);

struct EffectCount {
  std::uint64_t done = 0;       // asked for by callbacks that succeeded
  std::uint64_t discarded = 0;  // asked for by callbacks that failed afterwards
  std::uint64_t refused = 0;    // the function failed
  friend bool operator==(const EffectCount&, const EffectCount&) = default;
};
using EffectCounts = std::array<EffectCount, kEffects>;  // by Effect

}  // namespace tessera::game

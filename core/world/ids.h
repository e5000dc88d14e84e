// Identifiers: one distinct type for each kind of thing, so that a tick is never taken for a body.
//
// An id compares, hashes and prints; it does not add or multiply. `value()` is for codecs and messages. Ticks, which do
// count, are the one exception: `tick + 3` and `tick_b - tick_a` exist.
#pragma once

#include <compare>
#include <cstdint>
#include <functional>
#include <ostream>

namespace tessera {

template <class Tag, class Rep>
class Id {
 public:
  using rep = Rep;
  constexpr Id() = default;
  constexpr explicit Id(Rep value) : value_(value) {}
  constexpr Rep value() const { return value_; }
  friend constexpr auto operator<=>(const Id&, const Id&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Id& id) { return out << id.value_; }
  template <class H>
  friend H AbslHashValue(H h, const Id& id) {
    return H::combine(std::move(h), id.value_);
  }

 private:
  Rep value_ = 0;
};

// A body of the world. 0 means "no body" (a joint's world end). Scene bodies have ids below 2^32; a player's body is
// `PlayerBodyId(player)`; one that a game made is `SpawnedBodyId` (core/world/spawned_id.h). Ids are never used twice
// in the life of an instance.
using BodyId = Id<struct BodyTag, std::uint64_t>;
// A joint of the scene; from 1. That of a prefab's bodies has the id of the first of them, with its own number added:
// `SpawnedJointId` (core/world/prefab.h).
using JointId = Id<struct JointTag, std::uint64_t>;
// A worker's part of the world; from 1 in an instance. 0 means "no region".
using RegionId = Id<struct RegionTag, std::uint32_t>;
// A player of an instance; from 1, given in the order of joining. 0 means "no player".
using PlayerNumber = Id<struct PlayerTag, std::uint32_t>;
// Counts how often ownership of a body or of a cell has changed hands. It only grows; a lower one is refused.
using Epoch = Id<struct EpochTag, std::uint32_t>;
// Numbers the lives of a worker; unique in an instance, it only grows and is never used twice.
using Incarnation = Id<struct IncarnationTag, std::uint64_t>;
// Version of a partition map; only grows.
using MapVersion = Id<struct MapVersionTag, std::uint64_t>;

// The instance's clock: the number of steps simulated. Tick 0 is the scene as written; `Step` number t leads from tick
// t-1 to t.
class Tick {
 public:
  using rep = std::uint64_t;
  constexpr Tick() = default;
  constexpr explicit Tick(rep value) : value_(value) {}
  constexpr rep value() const { return value_; }
  friend constexpr auto operator<=>(const Tick&, const Tick&) = default;
  friend constexpr Tick operator+(Tick tick, rep n) { return Tick(tick.value_ + n); }
  friend constexpr std::int64_t operator-(Tick a, Tick b) {
    return static_cast<std::int64_t>(a.value_) - static_cast<std::int64_t>(b.value_);
  }
  constexpr Tick& operator++() {
    ++value_;
    return *this;
  }
  friend std::ostream& operator<<(std::ostream& out, Tick tick) { return out << tick.value_; }
  template <class H>
  friend H AbslHashValue(H h, Tick tick) {
    return H::combine(std::move(h), tick.value_);
  }

 private:
  rep value_ = 0;
};

// Bodies of players live in their own range, so every region knows from an id alone whose body it is.
inline constexpr std::uint64_t kFirstPlayerBody = std::uint64_t{1} << 32;
constexpr BodyId PlayerBodyId(PlayerNumber player) { return BodyId(kFirstPlayerBody + player.value()); }
constexpr bool IsPlayerBody(BodyId body) {
  return body.value() > kFirstPlayerBody && body.value() < 2 * kFirstPlayerBody;
}
constexpr PlayerNumber PlayerOf(BodyId body) {
  return IsPlayerBody(body) ? PlayerNumber(static_cast<std::uint32_t>(body.value() - kFirstPlayerBody))
                            : PlayerNumber();
}

// The world as a whole, where a game runs in it: it has a record like a body, and neither a shape nor a motion.
inline constexpr BodyId kInstanceBody{2 * kFirstPlayerBody};
// It stands for the sender of a backend's messages, and has no record.
inline constexpr BodyId kBackendSender{2 * kFirstPlayerBody + 1};

}  // namespace tessera

template <class Tag, class Rep>
struct std::hash<tessera::Id<Tag, Rep>> {
  std::size_t operator()(const tessera::Id<Tag, Rep>& id) const noexcept { return std::hash<Rep>{}(id.value()); }
};
template <>
struct std::hash<tessera::Tick> {
  std::size_t operator()(tessera::Tick tick) const noexcept { return std::hash<tessera::Tick::rep>{}(tick.value()); }
};

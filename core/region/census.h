// RegionCensus: what a region owns right after one tick, in a form that adds up.
//
// It counts bodies of the scene and of players. Those that a game makes come and go in any tick, and nobody knows how
// many there should be.
//
// All regions take theirs at the same ticks (`DueAt`). Over an instance the counts add up to the number of bodies, and
// the checksums, modulo 2^64, to the checksum of their ids, if and only if (but for chance, 2^-64) each body is owned
// exactly once. A body whose grant takes effect at the next tick still counts for the old owner, so the sum holds
// during handovers too.
#pragma once

#include <cstdint>
#include <span>

#include "core/region/owned_body.h"
#include "core/world/spawned_id.h"

namespace tessera::region {

struct RegionCensus {
  Tick tick;
  std::uint64_t owned = 0;        // dynamic bodies of the scene and of players
  std::uint64_t id_checksum = 0;  // sum of Mix over their ids
  friend bool operator==(const RegionCensus&, const RegionCensus&) = default;
};

// A bijection that spreads ids over 64 bits (the finaliser of SplitMix64, Steele et al. 2014), so that sums of ids do
// not cancel.
constexpr std::uint64_t Mix(BodyId id) {
  std::uint64_t z = id.value() + 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// Once a second of simulated time.
constexpr bool DueAt(Tick tick, std::uint32_t tick_rate_hz) { return tick.value() % tick_rate_hz == 0; }

inline RegionCensus TakeCensus(Tick tick, std::span<const OwnedBody> owned) {
  RegionCensus census{tick, 0, 0};
  for (const OwnedBody& body : owned) {
    if (IsSpawned(body.def->id)) break;  // they have the highest ids
    ++census.owned;
    census.id_checksum += Mix(body.def->id);
  }
  return census;
}

}  // namespace tessera::region

// KeptBlast: an area effect (core/game/blast.h) as a region, its standby and a checkpoint keep it.
//
// Thread rule: plain values and free functions.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/game/blast.h"
#include "core/game/record.h"

namespace tessera::region {

struct KeptBlast {
  game::Blast blast;
  bool acted = false;  // it is settled for all that the region owns
  friend bool operator==(const KeptBlast&, const KeptBlast&) = default;
};

inline bool IsSettledFor(const game::GameRecord& record, std::uint64_t blast) {
  return std::ranges::binary_search(record.blasts, blast, {}, &game::BlastMark::id);
}

// Marks the blasts that have acted as settled for a body with this record.
inline void MarkSettled(std::span<const KeptBlast> blasts, game::GameRecord& record) {
  for (const KeptBlast& kept : blasts) {
    if (!kept.acted || IsSettledFor(record, kept.blast.id)) continue;
    const auto at = std::ranges::lower_bound(record.blasts, kept.blast.id, {}, &game::BlastMark::id);
    record.blasts.insert(at, {kept.blast.id, kept.blast.ends});
  }
}

// Both ascend by id. One that was not known has acted on none of the bodies of who gets to know it.
inline std::vector<KeptBlast> MergeBlasts(std::span<const KeptBlast> known, std::span<const KeptBlast> others) {
  const auto id_of = [](const KeptBlast& kept) { return kept.blast.id; };
  std::vector<KeptBlast> merged(known.begin(), known.end());
  for (const KeptBlast& other : others) {
    const auto at = std::ranges::lower_bound(merged, other.blast.id, {}, id_of);
    if (at == merged.end() || at->blast.id != other.blast.id) merged.insert(at, {other.blast, false});
  }
  return merged;
}

}  // namespace tessera::region

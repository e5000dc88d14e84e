// OutputCommit: which of what a region has decided may be told to others, because its standby has it too.
//
// Poses are told at once: a death may set them back. Properties and bodies that come to be are told when the standby
// has the tick that made them, so that nothing that anybody has acted on is undone by a death. A body that one call of
// a game changed together with others is handed over no sooner: should its region die, the others would be set back,
// and it would not. Without a standby nothing waits.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/region/record_table.h"
#include "core/world/ids.h"

namespace tessera::region {

class OutputCommit {
 public:
  using PropertyBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

  // How long a handover may wait, ticks. Longer, and a fast body is far from what its owner sees.
  static constexpr std::uint64_t kMaxHandoverWait = 30;

  // A body's record changed in something that counts; the log of `tick` is the first that has it. `before` is null
  // where the body had no record.
  void Changed(const KeptRecord* before, const KeptRecord& after, Tick tick);
  // One call changed the body together with others in `tick`.
  void Bound(BodyId id, Tick tick) { entries_[id].bound = tick; }
  // A body came to be in `tick`.
  void Spawned(BodyId id, Tick tick) { entries_[id].spawned = tick; }
  // The body is not owned here any more.
  void Left(BodyId id);
  // After the step to `now`: the standby has all up to this tick; nothing without a standby.
  void Release(std::optional<Tick> standby_has, Tick now);

  // Whether one of these bodies, which should be handed over, has to wait in the step to `now`. What is changed
  // together with others in every tick waits no longer than kMaxHandoverWait.
  bool MustWait(std::span<const BodyId> assembly, Tick now);
  // Whether nobody may know of the body yet.
  bool IsHidden(BodyId id) const;
  bool empty() const { return entries_.empty(); }
  // The properties of a body with this record that may be told; null or empty for none.
  const PropertyBytes& PropertiesOf(const KeptRecord& record) const;

  // The part that may be told of what game and player have said to each other; for a player's body with this record.
  const game::SharedPlayerRecord& PlayerOf(const KeptRecord& record) const;

  void Validate() const;

 private:
  struct Told {
    PropertyBytes properties;
    game::SharedPlayerRecord player;
  };
  struct Entry {
    Tick spawned;  // 0: it was there before
    Tick bound;    // 0: it was not changed together with others
    Told told;     // as of the newest tick that the standby has
    std::deque<std::pair<Tick, Told>> later;
  };
  std::map<BodyId, Entry> entries_;
  struct Wait {
    Tick since, last;
  };
  std::map<BodyId, Wait> waiting_;
};

// Whether records differ in what counts: pushes are motion.
bool CountsAsChange(const KeptRecord* before, const KeptRecord& after);

}  // namespace tessera::region

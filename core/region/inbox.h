// Inbox: the neighbours' frames, checked, in order, at most one tick ahead.
//
// Nothing in a frame is trusted: one that is malformed, out of order or claims what cannot be leaves the inbox as it
// was. Thread rule: one thread at a time.
#pragma once

#include <deque>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

class Inbox {
 public:
  Inbox(std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog);

  // `now` is the receiver's tick. A frame that is here already is ignored. On success `taken` tells whether a frame was
  // added; it is the newest of its sender's.
  absl::Status Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const Frame** taken);
  // Takes back the frame that the last Put added: the receiver found that its claims clash with what it owns.
  void Reject(RegionId from);

  // A map is on its way: frames that go by it are kept as they came, at most one of each of its neighbours, until
  // ChangeMap. MapVersion(): none is any more.
  void Expect(MapVersion version, std::span<const RegionId> neighbors);
  // Another map is in force. Links to neighbours that stay go on where they were, unless `anew`; the others begin with
  // the frame of `first`. Returns the frames that were kept, for Put.
  std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> ChangeMap(MapVersion version,
                                                                        std::span<const RegionId> neighbors, Tick first,
                                                                        bool anew);
  // The newest map version that a good header called committed, or went by while it was expected.
  MapVersion newest_commit() const { return newest_commit_; }

  bool Has(std::size_t neighbor, Tick tick) const;
  // Requires Has(neighbor, tick).
  Frame Take(std::size_t neighbor, Tick tick);

 private:
  struct Link {
    RegionId id;
    Tick next;                                           // the tick that must come next
    std::deque<Frame> frames;                            // not yet taken
    std::vector<GhostRecord> previous, before_previous;  // ghosts of the newest frame, and of the one before it
  };
  Link* Find(RegionId id);
  absl::Status KeepEarly(RegionId from, std::span<const std::uint8_t> bytes);

  MapVersion map_version_, expected_version_, newest_commit_;
  std::vector<RegionId> expected_neighbors_;
  std::map<RegionId, std::vector<std::uint8_t>> early_;
  const Catalog& catalog_;
  std::vector<Link> links_;  // in the order of the neighbours
};

}  // namespace tessera::region

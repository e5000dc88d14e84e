// Inbox: the borders with all neighbours, and their frames, checked and in order.
//
// Nothing in a frame is trusted: one that is malformed, out of order or claims what cannot be leaves the inbox as it
// was. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"
#include "core/region/link.h"

namespace tessera::region {

class Inbox {
 public:
  Inbox(RegionId self, std::span<const RegionId> neighbors, MapVersion map_version, const Catalog& catalog);

  // `now` is the receiver's tick. A frame that is here already is ignored. On success `taken` tells whether a frame was
  // added; it is the newest of its sender's.
  absl::Status Put(RegionId from, std::span<const std::uint8_t> bytes, Tick now, const Frame** taken);
  // Takes back the frame that the last Put added: the receiver found that its claims clash with what it owns.
  void Reject(RegionId from);

  // A map is on its way: frames that go by it are kept as they came, a few of each of its neighbours, until ChangeMap.
  // MapVersion(): none is any more.
  void Expect(MapVersion version, std::span<const RegionId> neighbors);
  // Another map is in force. Borders with neighbours that stay go on where they were, unless `anew`; the others begin.
  // Returns the frames that were kept, for Put.
  std::vector<std::pair<RegionId, std::vector<std::uint8_t>>> ChangeMap(MapVersion version,
                                                                        std::span<const RegionId> neighbors, bool anew);
  // The newest map version that a good header called committed.
  MapVersion newest_commit() const { return newest_commit_; }

  // In the order of the neighbours.
  Link& link(std::size_t neighbor) { return links_[neighbor]; }
  const Link& link(std::size_t neighbor) const { return links_[neighbor]; }

 private:
  Link* Find(RegionId id);
  absl::Status KeepEarly(RegionId from, MapVersion committed, std::span<const std::uint8_t> bytes);

  const RegionId self_;
  MapVersion map_version_, expected_version_, newest_commit_;
  std::vector<RegionId> expected_neighbors_;
  std::map<RegionId, std::vector<std::vector<std::uint8_t>>> early_;
  const Catalog& catalog_;
  std::vector<Link> links_;  // in the order of the neighbours
};

}  // namespace tessera::region

// BodyFeed: brings a SnapshotHistory up to date with the bodies of a region, by the changes since the last time.
//
//   BodyFeed feed;
//   feed.Note(result.departures);   // after each step
//   feed.Push(region, history);     // at each tick of a snapshot
//
// A body is pushed only if its pose, velocities, sleep or properties changed. Thread rule: one thread at a time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/region/region.h"
#include "core/replication/snapshot.h"

namespace tessera::worker {

class BodyFeed {
 public:
  // The bodies that left in a step.
  void Note(std::span<const region::Departure> departures);
  // `history` must have all that this has pushed since it was made or cleared, and nothing else.
  void Push(const region::Region& region, replication::SnapshotHistory& history);
  // To be called before a new history: it gets everything.
  void Clear();
  // The body's place at the last push; nothing if it was not owned then.
  std::optional<Vec3d> PlaceOf(BodyId id) const;

 private:
  struct Pushed {
    BodyId id;
    Epoch epoch;
    BodyState state;
  };
  void AddProperties(std::span<const region::KeptRecord> properties);

  std::vector<Pushed> pushed_;                            // ascending by id
  std::vector<region::KeptRecord> properties_;            // as pushed, ascending by body
  std::vector<replication::DepartureRecord> departures_;  // since the last push
  // Scratch of Push, kept for its memory.
  std::vector<Pushed> pushing_;
  std::vector<replication::BodyRecord> changed_;
};

}  // namespace tessera::worker

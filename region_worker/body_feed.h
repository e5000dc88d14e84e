// BodyFeed: brings a SnapshotHistory up to date with what a region owns, by what has changed since it did so last.
//
//   BodyFeed feed;
//   feed.Note(result.departures);   // after each step
//   feed.Push(region, history);     // at each tick of a snapshot
//
// Nothing is pushed of a body that looks as it did, unless its properties are others. Thread rule: one thread at a
// time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/region/region.h"
#include "core/replication/snapshot.h"

namespace tessera::worker {

class BodyFeed {
 public:
  // Bodies that are owned no more.
  void Note(std::span<const region::Departure> departures);
  // Of a history that was told all that this has pushed since it was made or cleared, and nothing else.
  void Push(const region::Region& region, replication::SnapshotHistory& history);
  // The next history is told all.
  void Clear();
  // At the last push.
  std::optional<Vec3d> PlaceOf(BodyId id) const;

 private:
  struct Pushed {
    BodyId id;
    Epoch epoch;
    BodyState state;
  };
  void AddProperties(std::span<const region::ChangedProperties> properties);

  std::vector<Pushed> pushed_;                            // ascending by id
  std::vector<region::ChangedProperties> properties_;     // as pushed, ascending by body
  std::vector<replication::DepartureRecord> departures_;  // since the last push
  // Room used again and again.
  std::vector<Pushed> pushing_;
  std::vector<replication::BodyRecord> changed_;
};

}  // namespace tessera::worker

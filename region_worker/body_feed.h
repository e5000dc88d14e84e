// BodyFeed: brings a SnapshotHistory up to date with the bodies of a region, by the changes since the last time.
//
//   BodyFeed feed;
//   feed.Note(result.tick, result.departures);   // after each step
//   feed.Push(region, history);     // at each tick of a snapshot
//
// A body is pushed only if its pose, velocities, sleep or properties changed. Properties, new bodies and removed ones
// are pushed as of the newest tick that the region's standby has; poses, and handovers, at once. Thread rule: one
// thread at a time.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/region/output_commit.h"
#include "core/region/region.h"
#include "core/replication/snapshot.h"
#include "core/world/properties.h"

namespace tessera::worker {

class BodyFeed {
 public:
  // The bodies that left in the step to `tick`.
  void Note(Tick tick, std::span<const region::Departure> departures);
  // `history` must have all that this has pushed since it was made or cleared, and nothing else.
  void Push(const region::Region& region, replication::SnapshotHistory& history);
  // To be called before a new history: it gets everything.
  void Clear();
  // The body's place at the last push; nothing if it was not owned then.
  std::optional<Vec3d> PlaceOf(BodyId id) const;
  // The body's team at the last push; 0 if it was not owned then.
  TeamId TeamOf(BodyId id) const;

 private:
  struct Pushed {
    BodyId id;
    Epoch epoch;
    BodyState state;
    replication::BodyTraits traits;
    region::Region::Audience audience;
  };
  struct Removal {
    Tick tick;
    replication::DepartureRecord departure;
  };
  // The properties of a body, as they are and as clients see them: `team` as its team does, and `own` as its player
  // does, where that is more.
  struct Told {
    BodyId body;
    region::OutputCommit::PropertyBytes bytes, shown, own, team;
  };
  static void Show(Told& told, std::span<const PropertyDef> defs);
  static replication::BodyRecord RecordOf(const Pushed& body);
  static void Attach(const Told& told, replication::BodyRecord& record);
  void ReleaseRemovals(Tick committed);
  bool IsHeldBack(BodyId id) const;
  void AddProperties(const region::Region& region);

  std::vector<Pushed> pushed_;                            // ascending by id
  std::vector<Told> properties_;                          // as pushed, ascending by body
  std::vector<replication::DepartureRecord> departures_;  // since the last push
  std::vector<Removal> removals_;                         // those that nobody may know yet
  // Scratch of Push, kept for its memory.
  std::vector<Pushed> pushing_;
  std::vector<replication::BodyRecord> changed_;
  std::vector<Told> telling_;
};

}  // namespace tessera::worker

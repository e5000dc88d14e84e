// BlastTable: the area effects (core/game/blast.h) that a region knows, until they end.
//
// A blast goes from region to region over the frames: once the standby has the tick that made it, from whoever knows it
// to each neighbour that is nearer to it, and from those that it reaches to all their neighbours. A link that comes up
// again is sent all that are left. So each region that it reaches hears of it while it lives, and others may.
//
// Promise: after `Act` each blast whose tick has come is settled for every body that the region owns. A body that is
// handed over, or promoted out of a copy, takes along which ones are (GameRecord::blasts), and is settled for the rest
// by the region that takes it in. So none acts twice on a body, and none is missed while one region after another owns
// it.
//
// Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "core/game/blast.h"
#include "core/game/game_host.h"
#include "core/region/bodies.h"
#include "core/region/borders.h"
#include "core/region/kept_blast.h"
#include "core/region/message_packet.h"
#include "core/region/neighborhood.h"
#include "core/region/outgoing.h"
#include "core/region/record_table.h"

namespace tessera::region {

class BlastTable {
 public:
  explicit BlastTable(const Scene& scene) : scene_(scene) {}

  // --- What comes.
  // The game made it in the step to `now`.
  void Make(game::Blast blast, Tick now);
  void Receive(std::span<const MessagePacket> packets, Tick now);
  // Those that a dead region knew, or the state that this region begins with.
  void Adopt(std::span<const KeptBlast> others) { kept_ = MergeBlasts(kept_, others); }
  // A body came to be owned here, with its record.
  void Came(BodyId id) { fresh_.insert(id); }

  // --- The end of a step.
  // Pushes what those whose tick has come reach, by way of the records. Returns what happened to which body.
  std::vector<game::GameEvent> Act(Tick now, const Bodies& bodies, RecordTable& records);
  // Passes on what may leave.
  void Send(Tick now, std::optional<Tick> standby_has, const Neighborhood& neighborhood, const Borders& borders,
            OutgoingMessages& outgoing);
  // A link is up again.
  void Forget(RegionId neighbor) { sent_.erase(neighbor); }
  // A failover has made void what was under way.
  void Restart() { sent_.clear(); }
  // Whether any is to act or to leave, so that the next frames will not be silent.
  bool waits() const { return waits_; }

  // Those that are known, ascending by id.
  std::span<const KeptBlast> all() const { return kept_; }
  // Marks a record that leaves with its body.
  void Mark(game::GameRecord& record) const { MarkSettled(kept_, record); }

  void Validate(const Bodies& bodies) const;

 private:
  void ActOn(const game::Blast& blast, const OwnedBody& body, RecordTable& records,
             std::vector<game::GameEvent>& events) const;
  void SettleFresh(Tick now, const Bodies& bodies, RecordTable& records, std::vector<game::GameEvent>& events);
  bool GoesTo(RegionId neighbor, const game::Blast& blast, const Neighborhood& neighborhood) const;

  const Scene& scene_;
  std::vector<KeptBlast> kept_;                       // ascending by id
  std::map<std::uint64_t, Tick> made_;                // those made here whose tick the standby may lack
  std::map<RegionId, std::set<std::uint64_t>> sent_;  // to neighbours
  std::set<BodyId> fresh_;                            // bodies that came, until no mark of theirs is needed
  bool waits_ = false;
};

}  // namespace tessera::region

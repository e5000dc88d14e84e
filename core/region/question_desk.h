// QuestionDesk: puts the questions of this region's records to the regions that they touch, collects the answers, and
// answers for this region.
//
// A question stands in its asker's record (core/game/question.h); what the desk keeps of it may be lost at any time:
// then all regions are asked again. So a handover or a death costs a question time and no more. All regions answer for
// the question's moment, from the poses that they remember. One that does not, within a second, leaves the answer
// incomplete, and so does one that did not live then, or has no work left.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "core/game/question.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/message_packet.h"
#include "core/region/neighborhood.h"
#include "core/region/record_table.h"
#include "core/region/routes.h"
#include "core/region/shared_properties.h"

namespace tessera::region {

class QuestionDesk {
 public:
  // All must outlive it.
  QuestionDesk(const Catalog& catalog, const Neighborhood& neighborhood, const Bodies& bodies,
               const RecordTable& records, const SharedProperties& shared)
      : catalog_(catalog), neighborhood_(neighborhood), bodies_(bodies), records_(records), shared_(shared) {}

  // Borders between this region and the farthest that the query touches.
  std::uint32_t HopsFor(const BodyQuery& query) const;
  // Once all have answered, or a second is over; nothing before.
  std::optional<game::Answer> AnswerTo(BodyId asker, const game::GameQuestion& question, Tick now) const;

  // The end of the step to `now`: the packets that ask other regions.
  std::vector<MessagePacket> Ask(Tick now);
  // After a failover: regions are gone, and others have their bodies. All are asked again.
  void Restart() { open_.clear(); }
  // A question or an answer for this region. Returns the answer that goes back, if any.
  std::optional<MessagePacket> Take(const MessagePacket& packet, Tick now);

 private:
  using Key = std::tuple<BodyId, std::uint32_t, Tick>;  // asker, number, asked
  struct Open {
    std::size_t most_hits = 1;
    std::map<RegionId, std::optional<game::Answer>> regions;
    Tick next;  // ask those that have not answered again
  };

  std::vector<RegionId> Touched(const BodyQuery& query) const;
  // As far as this region knows.
  game::Answer AnswerHere(game::Question question, QueryScope scope, Tick now);
  PropertySet ChangedOf(BodyId id) const;
  Open OpenAnew(const game::GameQuestion& question, Tick now);

  const Catalog& catalog_;
  const Neighborhood& neighborhood_;
  const Bodies& bodies_;
  const RecordTable& records_;
  const SharedProperties& shared_;
  mutable Routes routes_;
  std::map<Key, Open> open_;
  Tick worked_at_;
  std::uint64_t worked_ = 0;  // instructions in that tick
};

}  // namespace tessera::region

// GrantsIn: the bodies that are handed over to this region, and the acknowledgements that it owes for them.
//
// An acknowledgement is due as soon as a body is here, but the granter may drop its copy only when the body cannot be
// lost with this region: the acknowledgement leaves once the standby has the tick in which the body came. It counts as
// heard when the granter's frames show that the frame with it arrived; until then it is sent again whenever the link
// comes up again. So a grant that is repeated is known by the body that is owned, or by the acknowledgement that is
// still under way. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/frame.h"

namespace tessera::region {

class GrantsIn {
 public:
  explicit GrantsIn(std::span<const RegionId> neighbors) { SetNeighbors(neighbors, true); }

  // Another map is in force: acknowledgements to neighbours that stay are kept, unless `anew`.
  void SetNeighbors(std::span<const RegionId> neighbors, bool anew);

  // --- What comes.
  // A step begins: nothing has been taken in during it.
  void StartStep() { taken_in_.clear(); }
  // The bodies of a grant that are new here; of a body that two neighbours grant, the first counts. Their
  // acknowledgements, and those of repeated bodies, are due once the standby has the tick `since`.
  std::vector<const GrantedBody*> Accept(RegionId from, const Grant& grant, const Bodies& bodies, Tick since);
  // Whether this region has had this granted body before.
  bool IsRepeat(RegionId from, const GrantedBody& body, const Bodies& bodies) const;
  // Bodies that were taken in since the step began, ascending.
  std::span<const BodyId> taken_in() const { return taken_in_; }

  // --- What is acknowledged.
  // The body is to be acknowledged to its granter, as after a failover that settled the grant.
  void Owe(BodyId id, Epoch epoch, RegionId to, Tick since) { due_.push_back({id, epoch, to, since}); }
  // This region granted the body on, and its new owner has it: the acknowledgement waits for no standby any more.
  void WentOn(BodyId id, Epoch epoch);
  // Makes those acknowledgements ready whose tick the standby has; without a standby, all.
  void Release(std::optional<Tick> standby_has);
  // Takes the acknowledgements that are ready for a neighbour. `Sent` says in which frame they left.
  std::vector<GrantAcknowledgement> TakeReady(RegionId to);
  void Sent(RegionId to, std::span<const GrantAcknowledgement> acknowledgements, std::uint64_t frame_number);
  // The neighbour's frame of this number came: it has those of this region's frames before that number.
  void Heard(RegionId from, std::uint64_t frame_number);
  // The link is up again: acknowledgements that may not have arrived are ready again.
  void Repeat(RegionId to);

  void Validate() const;

 private:
  struct Due {
    BodyId id;
    Epoch epoch;
    RegionId to;
    Tick since;
  };
  struct UnderWay {
    std::vector<GrantAcknowledgement> ready;                              // for the next frame
    std::vector<std::pair<GrantAcknowledgement, std::uint64_t>> unheard;  // sent, with the number of the frame
  };
  // Whether an acknowledgement of it is still due or under way.
  bool Acknowledges(RegionId to, const GrantedBody& body) const;

  std::vector<BodyId> taken_in_;
  std::vector<Due> due_;
  std::map<RegionId, UnderWay> under_way_;  // by neighbour
};

}  // namespace tessera::region

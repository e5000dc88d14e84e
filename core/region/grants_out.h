// GrantsOut: the bodies that this region hands over.
//
// A handover is decided after a step and takes effect with the next one; until then the bodies are departing. From the
// decision on, a copy of each is kept, with all that it takes to promote it, until the new owner acknowledges that it
// has the body: should the grant be lost with a link or a region, the copy is what is left. When the link is up again,
// the newest grants that were not acknowledged are sent again. Thread rule: one thread at a time.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/departing_body.h"
#include "core/region/frame.h"
#include "core/region/region_state.h"

namespace tessera::region {

// An assembly that changes hands, in the three forms that it takes.
struct PreparedGrant {
  RegionId to;
  Grant grant;                                 // for the new owner
  std::vector<DepartingBody> departing;        // for the next step
  std::vector<KeptGrants::value_type> copies;  // kept until they are acknowledged
};

class GrantsOut {
 public:
  // `catalog` must outlive it.
  explicit GrantsOut(const Catalog& catalog) : catalog_(catalog) {}

  // Bodies whose handover the last step decided, ascending.
  std::span<const DepartingBody> departing() const { return departing_; }
  const KeptGrants& kept() const { return kept_; }

  // The handovers that this step decided take the place of those of the step before.
  void Decide(std::vector<PreparedGrant> grants);
  // Whether a copy was kept for this acknowledgement by `from`; it is dropped.
  bool Acknowledged(RegionId from, const GrantAcknowledgement& acknowledgement);
  // The body came back under `epoch`: earlier copies were for the case that its owner died with it. Until the standby
  // has it, whoever granted it back keeps it.
  void ForgetBefore(BodyId id, Epoch epoch);
  // Grants to a neighbour that it may not have: those that it has not acknowledged, of bodies that are not back. A body
  // that went on here as a ghost meanwhile is granted as it is now.
  std::vector<Grant> Repeated(RegionId to, const Bodies& bodies) const;
  // A failover settled what was under way: nothing departs, and only these copies are still needed.
  void Settle(KeptGrants still_needed);

  void Validate(const Bodies& bodies) const;

 private:
  const Catalog& catalog_;
  std::vector<DepartingBody> departing_;
  KeptGrants kept_;
};

}  // namespace tessera::region

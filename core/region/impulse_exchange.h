// ImpulseExchange: keeps momentum across borders (exchange.h has the formula).
//
// After a step it notes this region's solutions of contacts across borders, for the frames to the neighbours. A tick
// later the neighbours' solutions of the same step are here, and it settles each contact: what the two sides found
// different becomes a force on the bodies that this region has.
//
// A body may change hands between a contact and its settlement. Who settles for it then is a rule that both regions can
// follow without asking: the new owner, if that owned the other body and so has both solutions; otherwise the old
// owner, which sends the new one a late correction. So each share acts exactly once.
//
// A body that still touches another's gets a tenth of its correction at once and the rest over the next ticks: that
// rest is owed to it. Thread rule: one thread at a time.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/physics/world.h"
#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/departing_body.h"
#include "core/region/exchange.h"
#include "core/region/frame.h"
#include "core/region/neighborhood.h"
#include "core/region/owed_impulse.h"

namespace tessera::region {

class ImpulseExchange {
 public:
  // `catalog` must outlive it.
  ImpulseExchange(const Catalog& catalog, double tick_s) : catalog_(catalog), tick_s_(tick_s) {}

  // --- After a step.
  // Notes the contacts (of Bodies::ImpulsesNearBorders) between owned bodies and ghosts of neighbours whose link is up.
  void Note(std::span<const physics::PairImpulse> contacts, const Bodies& bodies, std::span<const RegionId> links_up);
  // Solutions that one neighbour must have: of contacts with its bodies, and of bodies that it has as ghosts or gets.
  // `is_sent` is asked by the index of an owned body.
  std::vector<ImpulseRecord> RecordsFor(RegionId neighbor, absl::FunctionRef<bool(std::size_t)> is_sent) const;

  // --- In the next step, before the physics.
  struct AddressedCorrection {
    RegionId to;
    LateCorrection late;
  };
  // The late correction that passes on what is owed to a body that is handed over, if anything is.
  std::optional<AddressedCorrection> PassOn(const DepartingBody& body);
  // Nothing is owed here any more to a body that was taken in: its granter passes on what is.
  void Forget(BodyId id);

  struct Inputs {
    const Bodies& bodies;
    const Neighborhood& neighborhood;
    std::span<const BorderFrame> frames;      // by neighbour
    std::span<const DepartingBody> departed;  // handed over in this step
    std::span<const BodyId> taken_in;         // in this step, ascending
    std::span<const RegionId> links_up;       // ascending
  };
  struct Push {
    BodyId id;
    Vec3f force_n, torque_nm;
  };
  struct Settlement {
    std::vector<Push> pushes;               // on bodies and ghosts, in the next step
    std::vector<AddressedCorrection> late;  // to new owners
  };
  Settlement Settle(const Inputs& in);

  std::span<const OwedImpulse> owed() const { return owed_; }  // in no order
  // The contacts of before count no more.
  void Clear() { border_.clear(); }
  void Validate() const;

 private:
  // This region's solution of a contact across a border.
  struct BorderContact {
    Solution solution;
    std::uint32_t own;  // place of the owned body
  };
  // Correction that is due to a body.
  struct Correction {
    Vec3d impulse, angular;  // N s; about its centre of mass, N m s
    bool touches = false;    // the other body of the contact, still
    void operator+=(const Correction& more);
  };
  // One of a pair that touched in the last step.
  struct Party {
    BodyId id;
    std::ptrdiff_t place = -1;
    double mass_kg = 0;
    const DepartingBody* departed = nullptr;
    bool was_here = false;  // owned in that step
    bool slept = false;     // its owner had it asleep after it
    bool reported = false;  // by a neighbour, for this step
  };
  Party PartyOf(BodyId id, const Inputs& in) const;
  std::vector<Solution> GatherSolutions(const Inputs& in) const;
  void TakeLateCorrections(const Inputs& in, Settlement& settlement);
  void SettlePair(std::span<const Solution> solutions, const Inputs& in, Settlement& settlement);
  void GiveShare(const Party& party, const Correction& share, RegionId other_owner, bool between_others,
                 const Inputs& in, Settlement& settlement);
  std::optional<AddressedCorrection> LateFor(const DepartingBody& body, double ticks, Vec3d impulse,
                                             Vec3d angular) const;
  void AddDue(std::ptrdiff_t place, Correction share, const Inputs& in);
  void AddOwed(const Bodies& bodies);
  std::vector<Push> PushBodies(const Bodies& bodies);
  Correction& DueAt(std::size_t place);

  const Catalog& catalog_;
  const double tick_s_;
  std::vector<BorderContact> border_;           // written by Note, ascending by pair
  std::vector<OwedImpulse> owed_;               // written by PushBodies
  std::vector<std::optional<Correction>> due_;  // scratch of Settle, by place
};

}  // namespace tessera::region

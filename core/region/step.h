// RegionStep: the parts of a region and the order in which a tick puts them to work.
//
//   hand out -> take in -> place ghosts -> exchange -> players -> forces -> physics -> read back -> decide, predict ->
//   note contacts -> frames
//
// What each part is, its own header says. Behind Region; thread rule as there.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "core/region/bodies.h"
#include "core/region/catalog.h"
#include "core/region/exchange.h"
#include "core/region/inbox.h"
#include "core/region/inventory.h"
#include "core/region/log.h"
#include "core/region/map_change.h"
#include "core/region/pair_reports.h"
#include "core/region/players.h"
#include "core/region/property_table.h"
#include "core/region/reach.h"
#include "core/region/region.h"
#include "core/region/resolve.h"
#include "core/region/standby.h"

namespace tessera::region {

class RegionStep {
 public:
  explicit RegionStep(Config config_in);

  std::vector<OutgoingFrame> Start();
  StepResult Step(const PhaseObserver& observer);
  // Whether what a frame says agrees with what is owned here; names the body.
  absl::Status CheckClaims(const Frame& frame) const;

  void Close(RegionId neighbor);
  bool OpenTo(RegionId region) const;
  // Standby, maps and failover: see Region.
  absl::Status SetProperty(BodyId id, std::string_view name, PropertyValue value, std::uint64_t change_number);
  void SetStandby(bool on);
  void LogAcknowledged(Tick up_to);
  RegionState State() const;
  absl::Status Announce(const PartitionMap& map, Tick effective);
  void AdoptMap(PartitionMap map, bool anew);
  std::size_t AwayCount() const;
  absl::StatusOr<Inventory> BeginFailover(const PartitionMap& map, std::span<const Standby* const> wards);
  absl::StatusOr<StepResult> Resume(const Resolution& resolution, std::span<const Standby* const> wards);

  // A body that is the neighbour's from the next step on.
  struct HandedOut {
    GhostRecord record;  // epoch: of the new ownership
    RegionId to;
  };
  // Taken in (or up); told to `to` once the heir has the tick from which it is owned here.
  struct DueConfirmation {
    BodyId id;
    Epoch epoch;
    RegionId to;
    Tick since;
  };
  // This region's solution of a contact across a border.
  struct BorderContact {
    Solution solution;
    std::uint32_t own;  // place of its body (Bodies::PlaceOf)
  };

  Config config;
  std::vector<RegionId> neighbors;
  std::vector<RegionId> grantable;  // those of them that stay neighbours by an announced map
  double tick_s;
  Catalog catalog;
  Bodies bodies;
  Players players;
  Inbox inbox;
  PairReports reports;
  PropertyTable properties;  // of the bodies that are owned
  Reach reach;
  Tick tick;
  std::vector<HandedOut> handed_out;  // decided in the last step, ascending by body; true from the next on
  std::vector<BodyId> taken_in;       // owned since this step, ascending
  KeptGrants unconfirmed;             // granted; kept until the new owner tells that it has it
  std::vector<DueConfirmation> due_confirmations;
  std::vector<BorderContact> border;  // of the last step, ascending by pair
  MapChange change;
  std::optional<PartitionMap> failover;  // begun, not resumed
  bool standby_on = false;
  Tick acknowledged;              // by the heir
  std::vector<OwedImpulse> owed;  // ghosts' too, in no order

 private:
  static constexpr std::uint32_t kNotShown = 0xffffffff;
  // What is being written for one neighbour, and what it was last told.
  struct Outbox {
    std::vector<Grant> grants;
    std::vector<Confirmation> confirmations;
    std::vector<LateCorrection> late_corrections;
    std::vector<ForwardedInput> inputs;
    std::vector<GhostRecord> told;
    // Confirmations that were sent, with the number of their frame: the neighbour may not have them.
    std::vector<std::pair<Confirmation, std::uint64_t>> unheard;
  };
  using Frames = std::vector<Frame>;  // in the order of the neighbours

  Frames TakeFrames();
  void HandOut(StepResult& result);
  void TakeIn(const Frames& frames, StepResult& result);
  void PlaceGhosts(const Frames& frames);
  void ExchangeImpulses(const Frames& frames);
  void UpdatePlayers(StepResult& result);
  void ApplyForces();
  void ReadBack(StepResult& result);
  void NoteContacts();
  std::span<const physics::PairImpulse> ContactsNearBorders() const;
  void NoteTouching(std::span<const physics::PairImpulse> contacts);
  void Predict();
  void MeasurePrediction(StepResult& result) const;
  void CommitInputs();
  void DecideHandovers();
  void GrantTo(RegionId to, std::span<const std::size_t> assembly);
  void ShowFirst();
  void ShowNear();
  void AddNear(BodyId id, std::vector<std::uint32_t>* near) const;
  void ShowDeeper();
  void ShowWhole();
  void ShowAround(std::size_t body, const Aabb& bounds);
  void AddLoads(Frame& frame, std::span<const std::uint32_t> shown, std::size_t neighbor) const;
  void ShowSleepers();
  void NoteStill();
  bool IsCalm(std::size_t index) const;
  std::vector<OutgoingFrame> MakeFrames();
  Frame MakeFrame(std::size_t neighbor);
  Frame EmptyFrame() const;
  // A border opens: what its closing may have lost is said again.
  void SayAgain(std::size_t neighbor);
  struct Unrest {
    bool any = false;          // anything is awake, or may be steered
    std::vector<Aabb> places;  // where what of it may leave this region's cell may come to be
  };
  Unrest FindUnrest();
  // `unrest`: of this tick, found when it is first asked for.
  std::uint32_t VouchFor(std::size_t neighbor, const Frame& frame, std::optional<Unrest>& unrest);
  bool MayGrant(RegionId to) const;
  // Of a body that came back under this epoch.
  void ForgetGrantsBefore(BodyId id, Epoch epoch);
  // A grant that this region has had before; and whether its confirmation is still to be said or heard.
  bool IsRepeat(std::size_t neighbor, const GrantedBody& body) const;
  bool Confirms(std::size_t neighbor, const GrantedBody& body) const;

  const HandedOut* FindHandedOut(BodyId id) const;
  // Index into neighbors, or -1.
  std::ptrdiff_t NeighborIndex(RegionId id) const;
  Outbox* OutboxTo(RegionId id);  // null if it is no neighbour
  std::vector<std::size_t> OwnedAssembly(std::size_t index) const;
  Vec3d FieldOn(std::size_t index);  // of an awake body; kept until its state changes
  physics::Forces ForcesOn(std::size_t index);
  const PlayerControl* ControlOf(BodyId id) const;

  // Due to a body whose contact across a border is settled.
  struct Kick {
    Vec3d impulse, angular;  // N s; about its centre of mass, N m s
    bool touches = false;    // the other body of the contact, still
    void operator+=(const Kick& more) {
      impulse += more.impulse, angular += more.angular;
      touches = touches || more.touches;
    }
  };
  using Kicks = std::vector<std::optional<Kick>>;  // by place
  // One of a pair that touched in the last step.
  struct Party {
    BodyId id;
    std::ptrdiff_t place = -1;
    double mass_kg = 0;
    const HandedOut* gone = nullptr;  // handed over since
    bool was_here = false;            // owned in that step
    bool slept = false;               // its owner had it asleep after it
    bool told = false;                // by a neighbour, for this step
  };
  Party PartyOf(BodyId id) const;
  std::vector<Solution> GatherSolutions(const Frames& frames) const;
  void TakeLateCorrections(const Frames& frames, Kicks& kicks);
  void Settle(const Party& party, const Kick& share, RegionId other_owner, bool between_others, Kicks& kicks);
  // What is due to a body that changed hands, so many ticks before who has it now hears of it.
  void SendLate(const HandedOut& gone, double ticks, Vec3d impulse, Vec3d angular);
  void AddLate(std::ptrdiff_t place, Kick share, Kicks& kicks) const;
  void KickBodies(Kicks& kicks);
  // Of a place, at the start of a step.
  const BodyState& StartOf(std::size_t place) const;
  const BodyDef& DefAt(std::size_t place) const;

  void OwnInitial();
  void ChangeMapIfDue();
  void ReleaseConfirmations();
  void WriteLog(StepResult& result);
  void TakeUp(const Takeover& takeover, const KeptGrant& copy);
  void LetGo(BodyId id, RegionId to, const std::map<BodyId, KeptGrant>& copies, StepResult& result);
  absl::Status FindCopies(const Resolution& resolution, std::span<const Standby* const> wards,
                          std::map<BodyId, KeptGrant>& copies) const;
  void KeepPending(const Resolution& resolution, std::span<const Standby* const> wards);

  std::vector<Outbox> outboxes_;
  LogWriter log_;
  bool stepped_ = false;            // at least once
  std::size_t stepped_places_ = 0;  // bodies and ghosts there were in the last step
  bool rehearse_ = false;           // before the next step: bodies are new here whose contacts nobody remembers
  // A pair of the last step, and what it does as a load: a mean of its steps, in which the first two count as the
  // lesser of each component, 0 if they differ in sign. So a blow, which is over, is not told as a load.
  struct Touch {
    BodyId a, b;
    std::uint32_t place_a, place_b;  // Bodies::PlaceOf; physics::kNoTag of what is static
    Vec3f impulse_on_b, angular_on_a, angular_on_b;
    std::array<Vec3f, 3> now;  // the same, in the last alone
  };
  std::vector<bool> whole_;                       // by owned body: shown with all that it hangs together with
  std::vector<Touch> touching_, touched_before_;  // near borders, ascending by (a, b)
};

}  // namespace tessera::region

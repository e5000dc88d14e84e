// Failovers: workers that die while their world runs. What happens to a running instance, top to bottom:
//
//   1. Declare dead   A worker's exit is reported; or its host and its standby fall silent about it, while somebody who
//                     holds a copy of its region is heard. The map without it is stored.
//   2. Inventory      The living stand still by that map and say what they own and hold copies of. Proof is awaited
//                     that the dead stand still: an exit, or a lease that has run out.
//   3. Resolve        The living learn who promotes which bodies, and then it is stored. A control plane that dies
//                     before that leaves its successor a failover to begin anew: step 2, with another map.
//   4. Resume         The living run by the new map, with the bodies of the dead.
//   5. Replace        As fewer regions run than are wanted, PlannedChanges plans a new one.
//
// Silence is no death. Who may have the last copy of a region that died, or of which nothing is heard either, is not
// declared dead for it, since it would be fenced with that copy; and a failover waits for the inventory of a silent
// host for longer than for one that is heard (docs/decisions/0095-silence-loses-no-world.md). Both end with what the
// host says, its eviction, or a limit. Where no death is known and nobody who is heard can carry a silent region on, it
// may run as before, and is waited for, by name, until its host says something or is evicted.
//
// `Next` returns one step of 1 to 4 at a time, from the stored record and what is known. The caller stores the record
// before anybody gets an order that follows from it, but for a resolution. The records' steps themselves are
// failover.h's.
//
// Thread rule: as Cluster.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "control_plane/cluster/cluster_state.h"
#include "control_plane/control_settings.h"
#include "control_plane/failover.h"
#include "control_plane/failover_watch.h"
#include "control_plane/now.h"

namespace tessera::control {

// At most one of these.
struct FailoverStep {
  std::optional<records::Instance> next = std::nullopt;  // to be stored
  std::optional<records::Instance> told = std::nullopt;  // orders follow it from now on; stored with the step after it
  std::optional<Players> players = std::nullopt;         // with either; nothing: they stay
  bool dropped_plan = false;                             // `next` only gives up a planned map, as newcomers died
  std::string given_up = {};                             // why the world cannot go on from its workers; empty: it can
  std::string awaits = {};  // "waits for host beta, silent since ...: region 3"; empty: for nobody
};

class Failovers {
 public:
  Failovers(ClusterState& state, const ControlSettings& settings) : state_(state), settings_(settings) {}

  // The instance was loaded, maybe amid a failover.
  void Adopt(const InstanceEntry& instance, Now now);
  void Forget(std::uint64_t number);

  // The next step of a RUNNING instance; an empty one if there is none now. `cut` keeps standbys apart.
  FailoverStep Next(const InstanceEntry& instance, const CutBetween& cut, Now now);
  // Has the standby carry a region on whose worker lives, which ends. An empty step if that would cost anything.
  FailoverStep CarryOn(const InstanceEntry& instance, std::uint32_t region, const CutBetween& cut, Now now);
  // Newcomers whose standbys have reported a copy are protected from then on.
  static std::optional<records::Instance> NextProtected(const InstanceEntry& instance);

  // --- Evidence, in the order in which it comes.
  // Renews the lease on stepping of a worker that is to run; others get no answer.
  void RenewLease(const HostEntry& host, const v1::LeaseRequest& request, Now now);
  // A worker reported. If its standby copies grew, or if it was asked for leases while all stand still for a failover,
  // it is a witness that those regions live, whatever their own agents say.
  static void Witness(InstanceEntry& instance, const v1::WorkerReport& before, const v1::WorkerReport& report, Now now);
  // This process stood still for `pause`: missing witnesses of that time prove nothing.
  void Forgive(Steady pause, Now now);
  // A worker that was declared dead for its silence has ended. The instance, if its failover waits for that.
  InstanceEntry* NoteExit(const HostEntry& host, const v1::WorkerExited& exited);
  // The instance, if its failover waits for that inventory.
  InstanceEntry* NoteInventory(const HostEntry& host, const v1::InventoryReport& report, Now now);

 private:
  // A resolution that the living of a failover have been sent, by its map's version.
  struct Told {
    std::uint64_t version = 0;
    Steady at{0};
    region::Resolution resolution;
  };
  // How long a world stands for a failover: nobody steps from the death on.
  struct Standstill {
    Steady since{0};                              // last sign of the dead; 0: none in this life
    std::map<std::uint64_t, std::uint64_t> gaps;  // that regions had reported before, by incarnation; of earlier ones
    Steady said_at{0};                            // when the failover's event said so long; 0: it is not over
    std::chrono::milliseconds said{0};
  };

  const Told* ToldIn(const InstanceEntry& instance) const;
  bool OrdersAreOut(const InstanceEntry& instance) const;
  bool BegunByAnother(const InstanceEntry& instance) const;
  std::vector<Death> Deaths(const InstanceEntry& instance, std::vector<std::size_t>& awaited, Now now) const;
  bool CarriedOnByAnother(const InstanceEntry& instance, std::size_t dead, Now now) const;
  bool Outlives(const InstanceEntry& instance, std::size_t standby, std::size_t other) const;
  bool IsHeard(const WorkerEntry& worker, Now now) const;
  bool MayHaveLastCopy(const InstanceEntry& instance, std::size_t index, Now now) const;
  bool IsAwaited(const InstanceEntry& instance, std::size_t index, Now now) const;
  Steady PatienceFor(const InstanceEntry& instance) const;
  std::vector<std::size_t> SilentUnanswered(const InstanceEntry& instance, Now now) const;
  std::optional<records::Instance> NextAwaited(const InstanceEntry& instance, const std::string& awaits, Now now);
  FailoverStep GoOn(const InstanceEntry& instance, bool silent, Now now);
  FailoverStep Begin(const InstanceEntry& instance, const std::vector<Death>& deaths, const std::string& why,
                     const CutBetween& cut, Now now);
  FailoverStep Resolve(const InstanceEntry& instance, bool silent, Now now);
  FailoverStep End(const InstanceEntry& instance, Now now);
  void NoteStandstill(const InstanceEntry& instance, const std::vector<Death>& deaths);
  FailoverStep NextStood(const InstanceEntry& instance, Now now);

  ClusterState& state_;
  ControlSettings settings_;
  std::map<std::uint64_t, FailoverWatch> watches_;      // by instance number; empty while there was no failover
  std::map<std::uint64_t, Steady> begun_at_;            // likewise; none for one that an earlier life began
  std::map<std::uint64_t, Told> told_;                  // likewise
  std::map<std::uint64_t, Standstill> standstills_;     // likewise; until all is said of it
  std::map<std::uint64_t, std::uint64_t> adopted_;      // versions of the maps of failovers that an earlier life began
  std::map<std::uint64_t, Steady> silent_at_;           // when somebody whom the failover awaits was last silent
  std::map<std::uint64_t, std::uint64_t> awaits_said_;  // version of the map under which an event said who is awaited
};

}  // namespace tessera::control

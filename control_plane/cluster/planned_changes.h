// PlannedChanges: growing, shrinking, draining, restarting and balancing a world that runs, and moving it from slow
// hosts and cut links. It gathers what is known of the regions; the planned maps and their steps are change.h's.
//
// Nothing is changed during a failover. `Next` returns one step at a time, from the stored record and what is known;
// the caller stores it before anybody gets an order that follows from it.
//
// Thread rule: as Cluster.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "control_plane/change.h"
#include "control_plane/cluster/change_words.h"
#include "control_plane/cluster/cluster_state.h"
#include "control_plane/cluster/cut_links.h"
#include "control_plane/cluster/slow_hosts.h"
#include "control_plane/control_settings.h"
#include "control_plane/now.h"
#include "control_plane/standbys.h"
#include "tessera/v1/instance.pb.h"

namespace tessera::control {

class PlannedChanges {
 public:
  PlannedChanges(ClusterState& state, const ControlSettings& settings)
      : state_(state), settings_(settings), cut_links_(state, settings) {}
  void Forget(std::uint64_t number) {
    changes_.erase(number);
    slow_hosts_.Forget(number);
    cut_links_.Forget(number);
  }

  // The record with what is asked for, of a RUNNING instance; nothing if it is so already. The work follows by `Next`.
  // RESOURCE_EXHAUSTED when it needs a place and there is none.
  absl::StatusOr<std::optional<records::Instance>> Scale(const InstanceEntry& instance, std::uint32_t regions,
                                                         Now now) const;
  absl::StatusOr<std::optional<records::Instance>> Restart(const InstanceEntry& instance, Now now) const;
  // The wish for the world's time: nothing if it is so already.
  static std::optional<records::Instance> Pause(const InstanceEntry& instance, bool paused, Now now);
  // A paused world makes so many ticks. INVALID_ARGUMENT: not 1 to kMaxStepTicks; FAILED_PRECONDITION: it is not
  // paused, its regions do not all stand after one tick, or something is under way.
  static absl::StatusOr<std::optional<records::Instance>> MakeTicks(const InstanceEntry& instance, std::uint32_t ticks,
                                                                    Now now);
  // INVALID_ARGUMENT: not 1 to the scene's tick rate.
  static absl::StatusOr<std::optional<records::Instance>> SetPace(const InstanceEntry& instance,
                                                                  double ticks_per_second, Now now);
  // Another game, which is a sound one for the scene. FAILED_PRECONDITION: it runs none, or another is under way.
  static absl::StatusOr<std::optional<records::Instance>> SetGame(const InstanceEntry& instance,
                                                                  const std::string& name, const std::string& hash,
                                                                  Now now);
  // A request is stored: the next change waits for nothing.
  void Hasten(std::uint64_t number) { changes_[number].not_before = Steady(0); }
  // The last change came to nothing: the next one waits for a while.
  void RetryLater(std::uint64_t number, Now now) { changes_[number].not_before = now.steady + kChangeRetry; }

  // The next step of a RUNNING instance without a failover; nothing if there is none now.
  std::optional<records::Instance> Next(InstanceEntry& instance, Now now);

  // A region that its standby is to carry on now, since a change cannot end for a link of its that is cut; as CutLinks.
  std::optional<std::uint32_t> HeldUpBy(const InstanceEntry& instance, Now now) {
    return cut_links_.HoldingUp(instance, now);
  }
  // That failover is planned.
  void NoteCarriedOn(InstanceEntry& instance, std::uint32_t region, Now now);

  // The pairs of regions that cannot hear each other. Valid until the next call.
  CutBetween CutsOf(const InstanceEntry& instance) const;

 private:
  using Pair = std::pair<std::uint32_t, std::uint32_t>;  // the lower region first
  struct WorkerLoad {
    double body_cost_s = 0;       // step time for each loaded body, smoothed; 0: not measured yet
    Steady unprotected_since{0};  // by its own word, while its standby's host is heard; 0: it is protected
  };
  // Not stored: a new life of the control plane finds it again.
  struct Change {
    Steady not_before{0};  // no planned map before
    // Pairs that have no link, or whose link failed a standby, and until when they are kept apart.
    std::map<Pair, Steady> cuts;
    std::map<std::uint64_t, WorkerLoad> workers;  // by incarnation
    Steady unlinked{0};                           // how long the plan under way has waited for links of newcomers
    Steady unlinked_at{0};                        // when that was last seen; 0: it does not wait for any now
    std::optional<Layout> before;  // as the regions were run when the change under way began; none: not known
  };

  std::optional<records::Instance> NextTerms(const InstanceEntry& instance, Now now);
  std::vector<RegionFacts> Facts(const InstanceEntry& instance, Now now) const;
  std::optional<records::Instance> Plan(InstanceEntry& instance, std::vector<RegionFacts> facts,
                                        const std::optional<SlowRegion>& slow, Now now);
  std::optional<records::Instance> NoteNoRoom(InstanceEntry& instance, std::span<const RegionFacts> facts,
                                              const absl::Status& why, Now now);
  // Which region is to leave its host now, and why; `hosts` are marked that it is to keep away from.
  struct Leaver {
    std::optional<CutMove> cut;
    std::optional<SlowRegion> slow;  // unless it leaves for a cut
    std::uint32_t region() const { return cut ? cut->region : slow ? slow->region : 0; }
  };
  Leaver LeaverOf(const InstanceEntry& instance, std::optional<CutMove> cut, const std::optional<SlowRegion>& slow,
                  std::vector<FreeHost>& hosts, Now now) const;
  void NoteMoved(InstanceEntry& instance, const Leaver& leaver, records::Instance& planned, Now now);
  void SetUnlinked(const InstanceEntry& instance, std::vector<RegionFacts>& facts) const;
  std::optional<records::Instance> NextTakenBack(InstanceEntry& instance, std::span<const RegionFacts> facts, Now now);
  void NoteCuts(const InstanceEntry& instance, Now now);
  void NoteUnprotected(const InstanceEntry& instance, Change& change, Now now);
  static double SmoothedStep(const WorkerEntry& worker, WorkerLoad& load);

  ClusterState& state_;
  ControlSettings settings_;
  std::map<std::uint64_t, Change> changes_;  // by instance number
  SlowHosts slow_hosts_;
  CutLinks cut_links_;
};

// The tick after which all regions of a paused world stand, as they have reported: who goes by the map of the pause
// makes no tick any more. Nothing while they do not.
std::optional<std::uint64_t> StandingTick(const InstanceEntry& instance);

}  // namespace tessera::control

// History: what a cluster said and did while it was struck by faults, and the judgement of it.
//
// Witnesses write it down independently of each other: somebody who makes changes, somebody who asks for the world's
// state, somebody who reads each worker's own figures on its host, and the store's own record of who wrote. What must
// hold of it:
//
//   no change that was acknowledged is lost           (LostChanges)
//   one leader's writes at a time                     (TwoWriters)
//   no place of a world is stepped by two             (TwoOwners)
//   what was said to be RUNNING did step              (StallsOf, FalseRunning, FalseDegraded)
//   neighbours that are cut from each other are named, or moved to where they are not    (OutcomeOf)
//
// All times are seconds of one clock. Thread rule: values; functions without state.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace tessera::bench {

// Somebody added a host, or removed it. Each name is added once, and removed once at most.
struct ChangeRecord {
  std::string name;
  bool added = true;
  double asked = 0;
  bool acknowledged = false;
  double answered = 0;
};

// One reading of a worker's own figures.
struct StepRecord {
  std::string worker;  // unlike any other, of whatever life
  std::uint32_t region = 0;
  double at = 0;
  std::uint64_t steps = 0;  // ticks that this process simulated
  std::uint64_t tick = 0;   // the last of them
  std::uint64_t map = 0;    // by this map
};

// Two regions of a map that are neighbours, and the hosts that run them.
struct Border {
  std::uint32_t one = 0, other = 0;
  std::string host_of_one, host_of_other;
};

// The control plane's word about the world.
struct ClaimRecord {
  double asked = 0;
  bool running = false, degraded = false;
  std::string reason;
  std::uint64_t map = 0;                 // the version of the one in force
  std::vector<std::uint32_t> regions{};  // those of that map
  std::vector<Border> borders{};         // likewise, of regions whose hosts were told
};

// Packets between two hosts were lost, both ways, while others heard both of them.
struct HostCut {
  std::string one, other;
  double from = 0, to = 0;
};

// One write to the store, by the leader whose token it is; tokens are the revisions at which leaders were elected.
struct WriteRecord {
  std::int64_t revision = 0, token = 0;
};

struct History {
  std::vector<ChangeRecord> changes;
  std::vector<StepRecord> steps;    // each worker's in their order
  std::vector<ClaimRecord> claims;  // in their order
  std::vector<WriteRecord> writes;  // in their order
  double until = 0;                 // the end of all
  double late_s = 0;                // the longest time by which a sleep of a witness took longer than it should have
};

// All control planes ended at `to`, and one began from a backup that was begun at `from`.
struct Setback {
  double from = 0, to = 0;
};

// `found`: the names that the cluster knows in the end. One line for each change that it should know and does not. No
// backup knows of a change that was acknowledged after it was begun: of these either is right after a setback.
std::vector<std::string> LostChanges(const std::vector<ChangeRecord>& changes, const std::set<std::string>& found,
                                     const std::vector<Setback>& setbacks = {});

// One line for each write by a leader after another one was elected.
std::vector<std::string> TwoWriters(const std::vector<WriteRecord>& writes);

// One line for each worker that went on by a map after another worker had begun with a later one, in ticks beyond its
// beginning: both owned the same place.
std::vector<std::string> TwoOwners(const std::vector<StepRecord>& steps);

// When a region made no steps.
struct Stall {
  double from = 0, to = 0;
};
using Stalls = std::map<std::uint32_t, std::vector<Stall>>;  // by region; in their order
// Shorter ones than `least` are none.
Stalls StallsOf(const std::vector<StepRecord>& steps, double until, double least);

// When all regions of one map, of version `map` or later, had been seen to make a step after `since` by that or a later
// one; nothing if there is no such map. The first that holds of any: what comes after it, a place that is given back to
// its host, is not waited for.
std::optional<double> AllStepped(const History& history, double since, std::uint64_t map);

struct Falsehood {
  double total_s = 0;    // all in all
  double longest_s = 0;  // at a stretch
  std::vector<std::string> told;
  std::vector<Stall> stretches;  // as many as are told: when each was said

  // The part of the total that was said between these times.
  double Between(double from, double to) const;
};
// RUNNING was said while a region of the map stood still.
Falsehood FalseRunning(const std::vector<ClaimRecord>& claims, const Stalls& stalls);
// DEGRADED was said while all regions stepped. A missing standby is true whoever steps, so it is no falsehood, and
// neither is a missing link while there was such a cut.
Falsehood FalseDegraded(const std::vector<ClaimRecord>& claims, const Stalls& stalls,
                        const std::vector<HostCut>& cuts = {});

// The judgement of all that was said of a world with neighbours on both sides of a cut, while it lasted.
struct CutOutcome {
  double degraded_s = -1;      // from the cut until DEGRADED was said and the neighbours were named; negative: never
  double routed_s = -1;        // until it was RUNNING by a map without such neighbours; negative: never
  double false_running_s = 0;  // RUNNING was said with such neighbours, later than `known_s` after the cut

  bool told() const { return degraded_s >= 0 || routed_s >= 0; }
};
CutOutcome OutcomeOf(const std::vector<ClaimRecord>& claims, const HostCut& cut, double known_s);

}  // namespace tessera::bench

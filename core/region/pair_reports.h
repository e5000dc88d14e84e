// PairReports: contact and trigger events, each reported once in the instance.
//
// The owner of a pair's lower dynamic body reports it. Worlds on both sides of a border see begins and ends that nobody
// else does (a ghost comes or goes); so the reporter remembers which pairs it has reported, and a handover takes those
// along and makes no event. Thread rule: one thread at a time.
#pragma once

#include <cassert>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/physics/world.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

// Begun (or ended) and reported.
struct PairChange {
  TouchingPair pair;
  bool begun = false;
};

class PairReports {
 public:
  explicit PairReports(const Catalog& catalog) : catalog_(catalog) {}

  // Pairs of a body that is handed over, and those of one that was received.
  std::vector<TouchingPair> Pairs(BodyId reporter) const;
  void Release(BodyId reporter);
  void Adopt(std::span<const TouchingPair> pairs);
  // Those of a body of a saved state. The world has not seen them touch: those that do not once one of the two is awake
  // end with the next `Report`.
  void Restore(std::span<const TouchingPair> pairs);
  // All that are begun and not ended, ascending; and what begun or ended since the last call, in order.
  std::vector<TouchingPair> All() const;
  std::vector<PairChange> TakeChanges() { return std::exchange(changes_, {}); }
  void KeepChanges(bool on) { keep_changes_ = on; }  // whether somebody takes them
  BodyId ReporterOf(const TouchingPair& pair) const { return ReporterOf(pair.body_a, pair.body_b); }
  // A body left the world: its pairs end with the next `Report`, unless it is back by then.
  void BodyLeft(BodyId id) { left_.push_back(id); }

  // The events of a step that are to be reported, ascending by pair. `touching` is nothing while both sleep: the world
  // does not look at them then.
  std::vector<physics::PairEvent> Report(std::span<const physics::PairEvent> events,
                                         const std::function<bool(BodyId)>& owned,
                                         const std::function<bool(BodyId)>& present,
                                         const std::function<std::optional<bool>(const TouchingPair&)>& touching);

  void Validate() const { assert(by_reporter_.size() == by_other_.size()); }

 private:
  BodyId ReporterOf(BodyId a, BodyId b) const { return catalog_.Known(a) ? a : b; }

  // False if its begin, or its end, is reported already.
  bool Begin(const TouchingPair& pair);
  bool End(const TouchingPair& pair);
  void Note(const TouchingPair& pair, bool begun) {
    if (keep_changes_) changes_.push_back({pair, begun});
  }

  const Catalog& catalog_;
  bool keep_changes_ = false;
  std::vector<PairChange> changes_;
  // Begun, not ended: by the body that reports it, and by the other one. A region has thousands, and some of them
  // change hands in every tick.
  using ByBody = std::set<std::pair<BodyId, TouchingPair>>;
  static std::vector<TouchingPair> Of(const ByBody& pairs, BodyId id);
  ByBody by_reporter_, by_other_;
  std::vector<TouchingPair> restored_;  // those that the world has not reported yet
  std::vector<BodyId> left_;            // since the last report; who came with an adopted pair may be missing too
};

}  // namespace tessera::region

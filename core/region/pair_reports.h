// PairReports: contact and trigger events, each reported once in the instance.
//
// The owner of a pair's lower dynamic body reports it. Worlds on both sides of a border see begins and ends that nobody
// else does (a ghost comes or goes); so the reporter remembers which pairs it has told of, and a handover takes those
// along and makes no event. Thread rule: one thread at a time.
#pragma once

#include <functional>
#include <set>
#include <span>
#include <vector>

#include "core/physics/world.h"
#include "core/region/catalog.h"
#include "core/region/frame.h"

namespace tessera::region {

class PairReports {
 public:
  explicit PairReports(const Catalog& catalog) : catalog_(catalog) {}

  // Pairs of a body that is handed over, and those of one that was received.
  std::vector<TouchingPair> Pairs(BodyId reporter) const;
  void Release(BodyId reporter);
  void Adopt(std::span<const TouchingPair> pairs);
  // A body left the world: its pairs end with the next `Report`.
  void BodyLeft() { swept_ = false; }

  // The events of a step that are to be told, ascending by pair.
  std::vector<physics::PairEvent> Report(std::span<const physics::PairEvent> events,
                                         const std::function<bool(BodyId)>& owned,
                                         const std::function<bool(BodyId)>& present);

 private:
  BodyId ReporterOf(BodyId a, BodyId b) const { return catalog_.Known(a) ? a : b; }

  const Catalog& catalog_;
  std::set<TouchingPair> told_;  // begun, not ended
  bool swept_ = true;            // no pair of `told_` lacks a body
};

}  // namespace tessera::region

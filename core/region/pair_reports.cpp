#include "core/region/pair_reports.h"

#include <algorithm>

namespace tessera::region {

std::vector<TouchingPair> PairReports::Pairs(BodyId reporter) const {
  std::vector<TouchingPair> pairs;
  for (const TouchingPair& pair : told_) {
    if (ReporterOf(pair.body_a, pair.body_b) == reporter) pairs.push_back(pair);
  }
  return pairs;
}

void PairReports::Release(BodyId reporter) {
  std::erase_if(told_, [&](const TouchingPair& pair) {
    if (ReporterOf(pair.body_a, pair.body_b) != reporter) return false;
    Note(pair, false);
    return true;
  });
}

void PairReports::Adopt(std::span<const TouchingPair> pairs) {
  for (const TouchingPair& pair : pairs) Begin(pair);
  swept_ = false;
}

bool PairReports::Begin(const TouchingPair& pair) {
  if (!told_.insert(pair).second) return false;
  Note(pair, true);
  return true;
}

std::vector<physics::PairEvent> PairReports::Report(std::span<const physics::PairEvent> events,
                                                    const std::function<bool(BodyId)>& owned,
                                                    const std::function<bool(BodyId)>& present) {
  std::vector<physics::PairEvent> reports;
  for (const physics::PairEvent& event : events) {
    if (!owned(ReporterOf(event.body_a, event.body_b))) continue;
    const TouchingPair pair{event.body_a, event.body_b, event.trigger};
    if (event.begin ? !Begin(pair) : told_.erase(pair) == 0) continue;
    if (!event.begin) Note(pair, false);
    reports.push_back(event);
  }
  if (!swept_) {
    swept_ = true;
    std::erase_if(told_, [&](const TouchingPair& pair) {
      if (present(pair.body_a) && present(pair.body_b)) return false;
      Note(pair, false);
      reports.push_back({pair.body_a, pair.body_b, pair.trigger, false});
      return true;
    });
  }
  std::stable_sort(reports.begin(), reports.end(), [](const physics::PairEvent& x, const physics::PairEvent& y) {
    return std::pair(x.body_a, x.body_b) < std::pair(y.body_a, y.body_b);
  });
  return reports;
}

}  // namespace tessera::region

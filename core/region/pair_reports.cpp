#include "core/region/pair_reports.h"

#include <algorithm>

namespace tessera::region {

std::vector<TouchingPair> PairReports::Of(const ByBody& pairs, BodyId id) {
  std::vector<TouchingPair> found;
  for (auto it = pairs.lower_bound({id, TouchingPair()}); it != pairs.end() && it->first == id; ++it) {
    found.push_back(it->second);
  }
  return found;
}

std::vector<TouchingPair> PairReports::Pairs(BodyId reporter) const { return Of(by_reporter_, reporter); }

std::vector<TouchingPair> PairReports::All() const {
  std::vector<TouchingPair> all;
  all.reserve(by_reporter_.size());
  for (const auto& [reporter, pair] : by_reporter_) all.push_back(pair);
  std::sort(all.begin(), all.end());
  return all;
}

void PairReports::Release(BodyId reporter) {
  for (const TouchingPair& pair : Pairs(reporter)) End(pair);
}

void PairReports::Adopt(std::span<const TouchingPair> pairs) {
  for (const TouchingPair& pair : pairs) {
    Begin(pair);
    left_.insert(left_.end(), {pair.body_a, pair.body_b});
  }
}

void PairReports::Restore(std::span<const TouchingPair> pairs) {
  Adopt(pairs);
  restored_.insert(restored_.end(), pairs.begin(), pairs.end());
}

bool PairReports::Begin(const TouchingPair& pair) {
  const BodyId reporter = ReporterOf(pair);
  if (!by_reporter_.emplace(reporter, pair).second) return false;
  by_other_.emplace(reporter == pair.body_a ? pair.body_b : pair.body_a, pair);
  Note(pair, true);
  return true;
}

bool PairReports::End(const TouchingPair& pair) {
  const BodyId reporter = ReporterOf(pair);
  if (by_reporter_.erase({reporter, pair}) == 0) return false;
  by_other_.erase({reporter == pair.body_a ? pair.body_b : pair.body_a, pair});
  Note(pair, false);
  return true;
}

std::vector<physics::PairEvent> PairReports::Report(
    std::span<const physics::PairEvent> events, const std::function<bool(BodyId)>& owned,
    const std::function<bool(BodyId)>& present,
    const std::function<std::optional<bool>(const TouchingPair&)>& touching) {
  std::vector<physics::PairEvent> reports;
  for (const physics::PairEvent& event : events) {
    if (!owned(ReporterOf(event.body_a, event.body_b))) continue;
    const TouchingPair pair{event.body_a, event.body_b, event.trigger};
    if (event.begin ? !Begin(pair) : !End(pair)) continue;
    reports.push_back(event);
  }
  std::erase_if(restored_, [&](const TouchingPair& pair) {
    if (!by_reporter_.contains({ReporterOf(pair), pair})) return true;
    const std::optional<bool> touches = touching(pair);
    if (!touches) return false;
    if (!*touches && End(pair)) reports.push_back({pair.body_a, pair.body_b, pair.trigger, false});
    return true;
  });
  std::sort(left_.begin(), left_.end());
  left_.erase(std::unique(left_.begin(), left_.end()), left_.end());
  for (const BodyId id : std::exchange(left_, {})) {
    if (present(id)) continue;
    for (const ByBody* pairs : {&by_reporter_, &by_other_}) {
      for (const TouchingPair& pair : Of(*pairs, id)) {
        End(pair);
        reports.push_back({pair.body_a, pair.body_b, pair.trigger, false});
      }
    }
  }
  std::stable_sort(reports.begin(), reports.end(), [](const physics::PairEvent& x, const physics::PairEvent& y) {
    return std::pair(x.body_a, x.body_b) < std::pair(y.body_a, y.body_b);
  });
  return reports;
}

}  // namespace tessera::region

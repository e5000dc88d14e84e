#include "bench/lasting_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

namespace tessera::bench {
namespace {

constexpr double kTicksPerSecond = 60;
// A region that makes less than this share of its ticks counts as one that stands still.
constexpr double kStandsStill = 0.1;
// A reading is not of one moment: its tick may be one older than its map.
constexpr std::uint64_t kReadingSlack = 2;

// How long before a time a worker's last reading is looked for: many pauses between two.
constexpr double kLooksBack_s = 5;

struct Beginning {
  double at = 0;
  std::uint64_t tick = 0;
  std::string worker;
};

std::map<std::string, std::vector<const StepRecord*>> ByWorker(const std::vector<StepRecord>& steps) {
  std::map<std::string, std::vector<const StepRecord*>> result;
  for (const StepRecord& step : steps) result[step.worker].push_back(&step);
  return result;
}

bool StandsStill(const Stalls& stalls, std::uint32_t region, double at, double since) {
  const auto found = stalls.find(region);
  return found != stalls.end() && std::ranges::any_of(found->second, [&](const Stall& stall) {
           return std::max(stall.from, since) <= at && at < stall.to;
         });
}

bool WasUnderWay(const std::vector<HostCut>& cuts, double at) {
  return std::ranges::any_of(cuts, [at](const HostCut& cut) { return cut.from <= at && at < cut.to; });
}

bool Crosses(const Border& border, const HostCut& cut) {
  return (border.host_of_one == cut.one && border.host_of_other == cut.other) ||
         (border.host_of_one == cut.other && border.host_of_other == cut.one);
}

// As the control plane words it, whichever of them comes first.
bool NamesBoth(const std::string& reason, const Border& border) {
  for (const auto& [one, other] : {std::pair(border.one, border.other), std::pair(border.other, border.one)}) {
    if (reason.find(fmt::format("regions {} and {} have no link", one, other)) != std::string::npos) return true;
  }
  return false;
}

// `lie` says of each claim whether it is one; a claim counts until the next.
Falsehood Add(const std::vector<ClaimRecord>& claims, const std::function<std::string(const ClaimRecord&)>& lie) {
  Falsehood result;
  double stretch = 0;
  for (std::size_t i = 0; i + 1 < claims.size(); ++i) {
    const std::string told = lie(claims[i]);
    if (told.empty()) {
      stretch = 0;
      continue;
    }
    if (stretch == 0) {
      result.told.push_back(told);
      result.stretches.push_back({claims[i].asked, claims[i].asked});
    }
    result.stretches.back().to = claims[i + 1].asked;
    const double span = claims[i + 1].asked - claims[i].asked;
    stretch += span;
    result.total_s += span;
    result.longest_s = std::max(result.longest_s, stretch);
  }
  return result;
}

}  // namespace

double Falsehood::Between(double from, double to) const {
  double sum = 0;
  for (const Stall& stretch : stretches) {
    sum += std::max(0.0, std::min(stretch.to, to) - std::max(stretch.from, from));
  }
  return sum;
}

std::vector<std::string> LostChanges(const std::vector<ChangeRecord>& changes, const std::set<std::string>& found,
                                     const std::vector<Setback>& setbacks) {
  std::map<std::string, const ChangeRecord*> last;
  for (const ChangeRecord& change : changes) {
    const bool set_back = std::ranges::any_of(setbacks, [&](const Setback& setback) {
      return setback.from <= change.answered && change.asked <= setback.to;
    });
    // One that was not acknowledged may have taken effect: after it either is right.
    last[change.name] = change.acknowledged && !set_back ? &change : nullptr;
  }
  std::vector<std::string> lost;
  for (const auto& [name, change] : last) {
    if (change == nullptr || change->added == found.contains(name)) continue;
    lost.push_back(fmt::format("{} of {} was acknowledged at {:.3f} s and is lost",
                               change->added ? "the addition" : "the removal", name, change->answered));
  }
  return lost;
}

std::vector<std::string> TwoWriters(const std::vector<WriteRecord>& writes) {
  std::set<std::int64_t> tokens;
  for (const WriteRecord& write : writes) tokens.insert(write.token);
  std::vector<std::string> found;
  for (const WriteRecord& write : writes) {
    const auto next = tokens.upper_bound(write.token);
    if (write.token >= write.revision) {
      found.push_back(fmt::format("revision {} is of leader {}, who was not elected yet", write.revision, write.token));
    } else if (next != tokens.end() && *next < write.revision) {
      found.push_back(
          fmt::format("revision {} is of leader {}, though {} had been elected", write.revision, write.token, *next));
    }
  }
  return found;
}

std::vector<std::string> TwoOwners(const std::vector<StepRecord>& steps) {
  std::map<std::uint64_t, Beginning> begun;  // by map: the first who was seen to step by it
  for (const StepRecord& step : steps) {
    // A newcomer has the map of a planned change long before the tick from which it holds, and stands until then.
    if (step.steps == 0) continue;
    const auto [at, first] = begun.try_emplace(step.map, Beginning{step.at, step.tick, step.worker});
    if (!first && step.at < at->second.at) at->second = {step.at, step.tick, step.worker};
  }
  std::vector<std::string> found;
  for (const auto& [worker, readings] : ByWorker(steps)) {
    for (std::size_t i = 1; i + 1 < readings.size(); ++i) {
      const StepRecord &before = *readings[i - 1], &now = *readings[i], &after = *readings[i + 1];
      // By the map that still holds at the next reading, so these steps certainly were by it.
      if (now.steps == before.steps || after.map != before.map) continue;
      const auto other = std::find_if(begun.upper_bound(before.map), begun.end(), [&](const auto& later) {
        return later.second.at <= before.at && later.second.tick + kReadingSlack < now.tick;
      });
      if (other == begun.end()) continue;
      found.push_back(fmt::format(
          "{} stepped to tick {} by map {} at {:.3f} s, though {} had begun with map {} in tick {} at {:.3f} s", worker,
          now.tick, before.map, now.at, other->second.worker, other->first, other->second.tick, other->second.at));
      break;  // one line a worker
    }
  }
  return found;
}

Stalls StallsOf(const std::vector<StepRecord>& steps, double until, double least) {
  struct Progress {
    double at = 0;
    std::string worker;
    std::uint64_t steps = 0;
  };
  std::map<std::string, std::uint64_t> counted;  // steps at the last reading, by worker
  std::map<std::uint32_t, Progress> last;        // at which a region was seen to have moved
  std::vector<const StepRecord*> in_order;
  in_order.reserve(steps.size());
  for (const StepRecord& step : steps) in_order.push_back(&step);
  std::ranges::stable_sort(in_order, {}, &StepRecord::at);
  Stalls stalls;
  for (const StepRecord* step : in_order) {
    const auto before = counted.find(step->worker);
    const bool moved = before != counted.end() ? before->second < step->steps : step->steps > 0;
    counted[step->worker] = step->steps;
    if (!moved) continue;
    const auto seen = last.find(step->region);
    if (seen != last.end() && step->at - seen->second.at > least) {
      const double span = step->at - seen->second.at;
      const bool same = seen->second.worker == step->worker;
      const double made = same ? static_cast<double>(step->steps - seen->second.steps) : 0;
      // Whoever made its ticks was not looked at for a while.
      if (made < kStandsStill * kTicksPerSecond * span) stalls[step->region].push_back({seen->second.at, step->at});
    }
    last[step->region] = {step->at, step->worker, step->steps};
  }
  for (const auto& [region, progress] : last) {
    if (until - progress.at > least) stalls[region].push_back({progress.at, until});
  }
  return stalls;
}

std::optional<double> AllStepped(const History& history, double since, std::uint64_t map) {
  std::map<std::string, std::uint64_t> counted;  // steps at the last reading, by worker
  std::vector<const StepRecord*> moved;
  for (const StepRecord& step : history.steps) {
    if (step.at < since - kLooksBack_s) continue;
    const auto before = counted.find(step.worker);
    const bool moves = before != counted.end() ? before->second < step.steps : step.steps > 0;
    counted[step.worker] = step.steps;
    if (moves && step.at >= since && step.map >= map) moved.push_back(&step);
  }
  std::map<std::uint64_t, const std::vector<std::uint32_t>*> maps;
  for (const ClaimRecord& claim : history.claims) {
    if (claim.map >= map && !claim.regions.empty()) maps.try_emplace(claim.map, &claim.regions);
  }
  std::optional<double> first;
  for (const auto& [version, regions] : maps) {
    std::optional<double> last = since;
    for (const std::uint32_t region : *regions) {
      std::optional<double> at;
      for (const StepRecord* step : moved) {
        if (step->region == region && step->map >= version && (!at || step->at < *at)) at = step->at;
      }
      if (!at) last.reset();
      if (!last) break;
      last = std::max(*last, *at);
    }
    if (last && (!first || *last < *first)) first = last;
  }
  return first;
}

Falsehood FalseRunning(const std::vector<ClaimRecord>& claims, const Stalls& stalls) {
  std::map<std::uint32_t, double> listed;  // since when the map has had it
  return Add(claims, [&](const ClaimRecord& claim) -> std::string {
    std::erase_if(listed, [&](const auto& entry) { return !std::ranges::count(claim.regions, entry.first); });
    for (const std::uint32_t region : claim.regions) listed.try_emplace(region, claim.asked);
    if (!claim.running) return "";
    for (const std::uint32_t region : claim.regions) {
      // A stall that began before the map had the region is another region's.
      if (!StandsStill(stalls, region, claim.asked, listed.at(region))) continue;
      return fmt::format("RUNNING was said at {:.3f} s while region {} stood still", claim.asked, region);
    }
    return "";
  });
}

Falsehood FalseDegraded(const std::vector<ClaimRecord>& claims, const Stalls& stalls,
                        const std::vector<HostCut>& cuts) {
  return Add(claims, [&](const ClaimRecord& claim) -> std::string {
    if (!claim.degraded || claim.reason.find("standby") != std::string::npos) return "";
    const bool names_a_link = claim.reason.find("have no link") != std::string::npos;
    if (names_a_link && WasUnderWay(cuts, claim.asked)) return "";
    for (const std::uint32_t region : claim.regions) {
      if (StandsStill(stalls, region, claim.asked, 0)) return "";
    }
    return fmt::format("DEGRADED was said at {:.3f} s while all regions stepped: {}", claim.asked, claim.reason);
  });
}

CutOutcome OutcomeOf(const std::vector<ClaimRecord>& claims, const HostCut& cut, double known_s) {
  CutOutcome outcome;
  for (std::size_t i = 0; i + 1 < claims.size(); ++i) {
    const ClaimRecord& claim = claims[i];
    if (claim.asked < cut.from || claim.asked >= cut.to || claim.borders.empty()) continue;
    const double since = claim.asked - cut.from;
    const auto crosses = [&](const Border& border) { return Crosses(border, cut); };
    const bool apart = std::ranges::none_of(claim.borders, crosses);
    const bool named = std::ranges::any_of(
        claim.borders, [&](const Border& border) { return crosses(border) && NamesBoth(claim.reason, border); });
    if (outcome.degraded_s < 0 && claim.degraded && named) outcome.degraded_s = since;
    if (outcome.routed_s < 0 && claim.running && apart) outcome.routed_s = since;
    if (claim.running && !apart) {
      const double until = std::min(claims[i + 1].asked, cut.to);
      outcome.false_running_s += std::max(0.0, until - std::max(claim.asked, cut.from + known_s));
    }
  }
  return outcome;
}

}  // namespace tessera::bench

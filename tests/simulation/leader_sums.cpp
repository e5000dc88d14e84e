#include "tests/simulation/leader_sums.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace tessera::simulation {

void LeaderSums::Add(const LeaderOutcome& outcome) {
  ++runs;
  failed += outcome.problems.empty() ? 0 : 1;
  steps += outcome.steps;
  takeovers += outcome.takeovers;
  elections += outcome.elections;
  acknowledged += outcome.acknowledged;
  lost_changes += outcome.lost_changes;
  two_owners += outcome.two_owners;
  lies += outcome.lies;
  ended += outcome.ended;
  lost_bodies += outcome.lost_bodies;
  for (std::size_t i = 0; i < kLeaderFaultKinds; ++i) faults[i] += outcome.faults[i];
  gaps.insert(gaps.end(), outcome.gaps.begin(), outcome.gaps.end());
  stood = std::max(stood, outcome.stood);
}

std::uint64_t LeaderSums::GapMs(double share) const {
  if (gaps.empty()) return 0;
  std::vector<Micros> sorted = gaps;
  std::ranges::sort(sorted);
  const auto at = static_cast<std::size_t>(std::llround(share * static_cast<double>(sorted.size() - 1)));
  return sorted[at] / 1000;
}

void LeaderSums::Print(std::ostream& out) const {
  if (runs == 0) return;
  out << runs << " runs of several control planes, " << failed << " failed; " << steps << " steps of regions, "
      << takeovers << " deaths carried on\n";
  for (std::size_t i = 0; i < kLeaderFaultKinds; ++i) {
    const std::string name = kLeaderFaultNames[i];
    out << "  " << name << std::string(32 - std::min<std::size_t>(name.size(), 31), ' ') << faults[i] << '\n';
  }
  out << elections << " changes of leader; nobody led " << gaps.size() << " times, p50 " << GapMs(0.5) << " ms, worst "
      << GapMs(1) << " ms; a world stood for " << stood / 1000 << " ms at most\n"
      << "two owners " << two_owners << ", lies " << lies << ", worlds given up " << ended << ", changes lost "
      << lost_changes << " of " << acknowledged << " acknowledged, bodies lost " << lost_bodies << std::endl;
}

void LeaderSums::WriteCsv(std::ostream& out) const {
  if (runs == 0) return;
  const auto line = [&out](const std::string& config, const char* metric, std::uint64_t value, const char* unit) {
    out << "lasting,simulator,tessera," << config << ',' << metric << ',' << value << ',' << unit << '\n';
  };
  line("all", "seeds", runs, "seeds");
  line("all", "seeds_failed", failed, "seeds");
  for (std::size_t i = 0; i < kLeaderFaultKinds; ++i) {
    line(std::string("fault=") + kLeaderFaultNames[i], "faults", faults[i], "faults");
  }
  line("all", "leader_changes", elections, "changes");
  line("all", "leader_gap_ms_p50", GapMs(0.5), "ms");
  line("all", "leader_gap_ms_max", GapMs(1), "ms");
  line("all", "world_stood_ms_max", stood / 1000, "ms");
  line("all", "two_owners", two_owners, "regions");
  line("all", "lies", lies, "lies");
  line("all", "worlds_given_up", ended, "worlds");
  line("all", "acknowledged", acknowledged, "changes");
  line("all", "acknowledged_lost", lost_changes, "changes");
}

}  // namespace tessera::simulation

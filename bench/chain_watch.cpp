#include "bench/chain_watch.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "bench/truth.h"
#include "scenes/measured/builder.h"
#include "scenes/measured/linkages.h"

namespace tessera::bench {
namespace {

constexpr double kWatched_s = 10;

const std::vector<double>& TrueCrossings(const scenes::Chain& chain, double ratio) {
  static std::map<double, std::vector<double>> known;
  auto [entry, is_new] = known.try_emplace(ratio);
  if (is_new) {
    const double l = chain.link_m, r = chain.ball_radius_m;
    std::vector<Rod> rods(chain.bodies.size() - 1, {1, l, l / 2, chain.link_inertia_kg_m2});
    rods.push_back({ratio, 2 * r, r, chain.ball_inertia_kg_m2});
    entry->second = CrossingTimes(RodChain(rods, -chain.scene.gravity_m_s2.y), kWatched_s, 1e-3);
  }
  return entry->second;
}

}  // namespace

absl::StatusOr<ChainFigures> SwingChain(const Trial& trial, double ratio) {
  const scenes::Chain chain = scenes::BallAndChain(ratio);
  absl::StatusOr<Run> run = Run::Start(trial, chain.scene);
  if (!run.ok()) return run.status();
  ChainFigures figures;
  std::vector<double> crossings;
  double x = run->StateOf(chain.bodies.back()).position.x, time = 0;
  while (run->time_s() < kWatched_s - 1e-9) {
    run->Tick();
    for (const JointDef& joint : chain.scene.joints) {
      const BodyState a = run->StateOf(joint.body_a);
      const BodyState b = joint.body_b == BodyId() ? BodyState() : run->StateOf(joint.body_b);
      const double gap = scenes::GapOf(joint, a, joint.body_b == BodyId() ? nullptr : &b);
      if (!(gap <= figures.gap_m)) figures.gap_m = gap;
    }
    const double now = run->StateOf(chain.bodies.back()).position.x;
    if (x * now < 0) crossings.push_back(time + (run->time_s() - time) * x / (x - now));
    x = now;
    time = run->time_s();
  }
  const std::vector<double>& truth = TrueCrossings(chain, ratio);
  figures.period_error =
      crossings.size() < truth.size() || truth.empty() ? 1 : std::abs(crossings[truth.size() - 1] / truth.back() - 1);
  figures.cpu_us = run->cpu_us_per_tick();
  return figures;
}

}  // namespace tessera::bench

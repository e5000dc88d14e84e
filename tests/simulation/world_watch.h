// WorldWatch: runs a Deployment and holds what its control planes say of the world against the steps that its regions
// make (false_words.h), every kLook of virtual time; and counts how long nobody leads.
//
//   WorldWatch watch(deployment);
//   watch.RunFor(Milliseconds(5000));
//   EXPECT_EQ(watch.words().lies(), 0U);
//
// While a write keeps a control plane from answering, it says nothing. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <vector>

#include "tests/simulation/deployment.h"
#include "tests/simulation/false_words.h"

namespace tessera::simulation {

class WorldWatch {
 public:
  static constexpr Micros kLook = Milliseconds(10);

  // Hears of each step of the deployment, which outlives this.
  explicit WorldWatch(Deployment& deployment, const WordBounds& bounds = {});
  ~WorldWatch() { deployment_.on_step = {}; }
  WorldWatch(const WorldWatch&) = delete;
  WorldWatch& operator=(const WorldWatch&) = delete;

  void RunFor(Micros span);
  template <class Condition>
  bool RunUntil(Micros patience, Condition condition) {
    const Micros end = deployment_.timeline().now() + patience;
    while (!condition() && deployment_.timeline().now() < end) RunFor(kLook);
    return condition();
  }

  // Whether this control plane can know that the world steps, and nothing else is amiss with it: else DEGRADED is no
  // lie. By itself it always can.
  std::function<bool(const SimulatedControl&)> sees = [](const SimulatedControl&) { return true; };

  FalseWords& words() { return words_; }
  // Each time without anybody who leads, runs and reaches the store, from beginning to end.
  const std::vector<Micros>& leader_gaps() const { return leader_gaps_; }

 private:
  std::vector<RegionId> Regions() const;
  void Look();

  Deployment& deployment_;
  FalseWords words_;
  std::set<Node> stepped_;  // lives that did; others go by maps that are not in force yet
  Micros leaderless_since_;
  bool led_;  // at the last look
  std::vector<Micros> leader_gaps_;
};

}  // namespace tessera::simulation

#include "control_plane/life.h"

#include <gmock/gmock.h>

namespace tessera::control {
namespace {

LifeFacts Facts(std::vector<v1::WorkerPhase> phases, bool players_ready) {
  LifeFacts facts;
  for (const v1::WorkerPhase phase : phases)
    facts.workers.push_back({static_cast<std::uint32_t>(facts.workers.size() + 1), phase, false, "alpha", false, ""});
  facts.players_ready = players_ready;
  return facts;
}

constexpr auto kBound = v1::WORKER_PHASE_BOUND;
constexpr auto kLinked = v1::WORKER_PHASE_LINKED;
constexpr auto kRunning = v1::WORKER_PHASE_RUNNING;

TEST(LifeTest, TheStartGoesOutOnlyWhenAllAreLinked) {
  for (const auto state : {v1::INSTANCE_STATE_STARTING, v1::INSTANCE_STATE_PENDING}) {
    EXPECT_FALSE(NextStep(state, false, Facts({kLinked, kBound}, true)).run);
  }
  EXPECT_TRUE(NextStep(v1::INSTANCE_STATE_STARTING, false, Facts({kLinked, kLinked}, true)).run);
  const LifeStep waiting = NextStep(v1::INSTANCE_STATE_STARTING, false, Facts({kLinked, kLinked}, false));
  EXPECT_EQ(waiting.state, v1::INSTANCE_STATE_WAITING_FOR_PLAYERS);
  EXPECT_FALSE(waiting.run);
}

TEST(LifeTest, RunningNeedsEveryWorker) {
  for (const auto state : {v1::INSTANCE_STATE_STARTING, v1::INSTANCE_STATE_WAITING_FOR_PLAYERS}) {
    EXPECT_EQ(NextStep(state, true, Facts({kRunning, kLinked}, true)).state, state);
    EXPECT_EQ(NextStep(state, true, Facts({kRunning, kRunning}, true)).state, v1::INSTANCE_STATE_RUNNING);
    EXPECT_EQ(NextStep(state, true, Facts({kRunning, v1::WORKER_PHASE_STOPPING}, true)).state, state);
  }
}

// From every state, with every mix of two workers' facts: taking the steps on the same facts comes to rest, never
// leaves a final state, and never takes the start back.
TEST(LifeTest, ComesToRestOnTheSameFacts) {
  for (int from = v1::INSTANCE_STATE_PENDING; from <= v1::INSTANCE_STATE_FAILED; ++from) {
    if (from == v1::INSTANCE_STATE_PLACING || from == v1::INSTANCE_STATE_DEGRADED) continue;  // not this function's
    for (unsigned mix = 0; mix < 6 * 6 * 128; ++mix) {
      const auto phase = [](unsigned n) { return static_cast<v1::WorkerPhase>(n % 6); };
      LifeFacts facts = Facts({phase(mix), phase(mix / 6)}, (mix / 36 & 1) != 0);
      facts.start_deadline_passed = (mix / 36 & 2) != 0;
      facts.start_timed_out = (mix / 36 & 4) != 0;
      facts.workers[0].gone = (mix / 36 & 8) != 0;
      facts.workers[1].gone = (mix / 36 & 16) != 0;
      facts.workers[1].host_lost = (mix / 36 & 32) != 0;
      LifeStep at{static_cast<v1::InstanceState>(from), (mix / 36 & 64) != 0, ""};
      for (int steps = 0;; ++steps) {
        ASSERT_LT(steps, 5) << from << " mix " << mix;
        const LifeStep next = NextStep(at.state, at.run, facts);
        ASSERT_TRUE(next.run || !at.run);
        if (next.state == at.state && next.run == at.run) break;
        ASSERT_FALSE(IsFinal(at.state));
        if (next.state == v1::INSTANCE_STATE_FAILED) {
          ASSERT_NE(next.reason, "");
        }
        at = next;
        if (at.state == v1::INSTANCE_STATE_PLACING) break;
      }
    }
  }
}

TEST(LifeTest, AFailureNamesRegionAndHost) {
  LifeFacts facts = Facts({kRunning, kRunning}, true);
  facts.workers[1].gone = true;
  facts.workers[1].ending = "worker was killed by signal 9 (SIGKILL)";
  const LifeStep step = NextStep(v1::INSTANCE_STATE_STARTING, true, facts);
  EXPECT_EQ(step.state, v1::INSTANCE_STATE_FAILED);
  EXPECT_EQ(step.reason, "region 2 on alpha: worker was killed by signal 9 (SIGKILL)");
  EXPECT_EQ(NextStep(v1::INSTANCE_STATE_RUNNING, true, facts).state,
            v1::INSTANCE_STATE_RUNNING);  // failover's business
}

TEST(LifeTest, AStartThatTimesOutNamesWhoIsLate) {
  LifeFacts facts = Facts({kLinked, kBound}, true);
  facts.start_timed_out = true;
  EXPECT_EQ(NextStep(v1::INSTANCE_STATE_STARTING, false, facts).reason,
            "start timed out: not linked: region 2 on alpha");
  facts = Facts({kRunning, kLinked}, true);
  facts.start_timed_out = true;
  EXPECT_EQ(NextStep(v1::INSTANCE_STATE_STARTING, true, facts).reason,
            "start timed out: not running: region 2 on alpha");
}

TEST(LifeTest, ALostHostDegradesWhatRunsAndFailsWhatHasNotStarted) {
  LifeFacts facts = Facts({kRunning, kRunning, kRunning}, true);
  facts.workers[0].host_lost = facts.workers[2].host_lost = true;
  EXPECT_EQ(NextStep(v1::INSTANCE_STATE_RUNNING, true, facts).state, v1::INSTANCE_STATE_RUNNING);
  EXPECT_EQ(DegradedReason(facts.workers), "host alpha is silent: regions 1, 3");
  EXPECT_EQ(NextStep(v1::INSTANCE_STATE_STARTING, false, facts).reason,
            "region 1: host alpha was lost before the start");
}

TEST(LifeTest, AWorkerThatHasEndedDegradesWhileNobodyCarriesItOn) {
  LifeFacts facts = Facts({kRunning, kRunning}, true);
  facts.workers[1].gone = true;
  EXPECT_EQ(DegradedReason(facts.workers), "region 2 on alpha has ended");
  facts.workers[1].ending = "worker was killed by signal 9";
  EXPECT_EQ(DegradedReason(facts.workers), "region 2 on alpha has ended: worker was killed by signal 9");
}

}  // namespace
}  // namespace tessera::control

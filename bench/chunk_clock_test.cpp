#include "bench/chunk_clock.h"
#include "bench/thread_cpu.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <thread>

namespace tessera::bench {
namespace {

void RunOnFirstProcessor() {
  cpu_set_t all, first;
  CPU_ZERO(&all);
  CPU_ZERO(&first);
  ASSERT_EQ(sched_getaffinity(0, sizeof(all), &all), 0);
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &all)) continue;
    CPU_SET(cpu, &first);
    break;
  }
  ASSERT_EQ(sched_setaffinity(0, sizeof(first), &first), 0);
}

void Work(double cpu_s) {
  const double begin = ThreadCpuSeconds();
  while (ThreadCpuSeconds() < begin + cpu_s) {
  }
}

// An engine whose step is CPU time.
class BusyEngine : public Engine {
 public:
  explicit BusyEngine(double step_s) : step_s_(step_s) {}
  std::string_view name() const override { return "busy"; }
  absl::Status Load(const Scene&) override { return absl::OkStatus(); }
  void Step(double) override { Work(step_s_); }
  BodyState StateOf(BodyId) const override { return {}; }
  void SetState(BodyId, const BodyState&) override {}
  void ApplyForce(BodyId, Vec3f, Vec3f) override {}

 private:
  double step_s_;
};

TEST(ChunkClockTest, AThreadWithoutAProcessorDisturbs) {
  if (WaitedSeconds() < 0) GTEST_SKIP() << "this system does not count waiting";
  ChunkTime time;
  // A thread of its own, so that this process may go on using all processors.
  std::thread([&] {
    RunOnFirstProcessor();
    std::atomic<bool> done = false;
    std::thread other([&] {
      RunOnFirstProcessor();
      while (!done.load()) {
      }
    });
    BusyEngine engine(0.01);
    time = TimeSteps(engine, 10, 1);
    done = true;
    other.join();
  }).join();
  EXPECT_FALSE(time.undisturbed);
  EXPECT_GE(time.cpu_s, 0.1);
  EXPECT_GT(time.wall_s, 1.2 * time.cpu_s);  // the two share a processor
}

TEST(ChunkClockTest, TimesAllSteps) {
  BusyEngine engine(0.002);
  const ChunkTime time = TimeSteps(engine, 5, 1);
  EXPECT_GE(time.cpu_s, 0.01);
  EXPECT_GE(time.wall_s, 0.01);
}

}  // namespace
}  // namespace tessera::bench

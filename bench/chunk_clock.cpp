#include "bench/chunk_clock.h"
#include "bench/thread_cpu.h"

#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>
#include <thread>

namespace tessera::bench {
namespace {

constexpr double kDisturbedShare = 0.01;
constexpr int kSettleLooks = 50;  // a fifth of a millisecond each

// State of a task, as proc(5) has it: R where it runs or is ready to; 0 if it has ended.
char StateOfTask(const std::filesystem::path& task) {
  std::ifstream file(task / "stat");
  std::string line;
  if (!std::getline(file, line)) return 0;
  const std::size_t name_end = line.rfind(')');
  return name_end != std::string::npos && name_end + 2 < line.size() ? line[name_end + 2] : 0;
}

bool OthersAreIdle() {
  const std::string self = std::to_string(gettid());
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    if (task.path().filename() != self && StateOfTask(task.path()) == 'R') return false;
  }
  return true;
}

// Lets the threads of an engine come to rest. One that waits for a processor is counted only once it has got it. False:
// some do not rest.
bool SettleThreads() {
  for (int look = 0; look < kSettleLooks; ++look) {
    if (OthersAreIdle()) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return false;
}

}  // namespace

double WaitedSeconds() {
  std::uint64_t sum_ns = 0;
  bool known = false;
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    std::ifstream file(task.path() / "schedstat");
    std::uint64_t ran_ns = 0, waited_ns = 0;
    if (!(file >> ran_ns >> waited_ns)) continue;  // it has ended
    sum_ns += waited_ns;
    known = true;
  }
  return known ? 1e-9 * static_cast<double>(sum_ns) : -1;
}

ChunkTime TimeSteps(Engine& engine, int steps, double dt_s) {
  const double waited = WaitedSeconds(), cpu = ThreadCpuSeconds();
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) engine.Step(dt_s);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
  ChunkTime time{.cpu_s = ThreadCpuSeconds() - cpu, .wall_s = taken.count()};
  time.undisturbed = SettleThreads() && waited >= 0 && WaitedSeconds() - waited <= kDisturbedShare * time.wall_s;
  return time;
}

}  // namespace tessera::bench

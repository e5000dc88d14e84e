// WorkCounter: how much work a piece of code is.
//
// Counts the instructions that this thread executes in user mode, which hardly differ from run to run, where the kernel
// lets it (perf_event_open); elsewhere, as on most virtual machines, its CPU time.
//
//   WorkCounter counter;
//   const double work = counter.Of([&] { world.Step(dt); });  // in counter.unit()
//
// Thread rule: the thread that made it.
#pragma once

#include <string>

namespace tessera::bench {

class WorkCounter {
 public:
  WorkCounter();
  ~WorkCounter();
  WorkCounter(const WorkCounter&) = delete;
  WorkCounter& operator=(const WorkCounter&) = delete;

  std::string unit() const { return file_ >= 0 ? "instructions" : "cpu_time"; }
  double Now() const;  // only differences mean anything
  template <class Function>
  double Of(Function function) const {
    const double before = Now();
    function();
    return Now() - before;
  }

 private:
  int file_ = -1;
};

}  // namespace tessera::bench

// Process: an operating-system process, held by a pidfd so that a reused pid is never taken for it.
//
//   absl::StatusOr<Process> process = Process::Spawn({.argv = {"/usr/bin/tessera-region"}, .log_path = "r1.log"});
//   loop.Watch(process->pidfd(), [&] { Report(process->Reap()); });  // readable once the process has ended
//
// A spawned process leads a session of its own, so that no signal of a terminal reaches it. It has /dev/null as input,
// its log file as output, no other descriptor and no blocked signal. An earlier life of this
// program spawned an adopted process; its exit status cannot be had. The end of this object does not end the process:
// ChildProcess does. Thread rule: one owner. `Spawn` with a `parent_death_signal` only from a thread that lives as long
// as the process is to live, since the kernel counts the end of the spawning *thread*.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::host {

struct ProcessSpec {
  std::vector<std::string> argv;  // the first is the program's path
  std::string log_path;  // both outputs are appended to this file; rotated before and, by programs of ours, meanwhile
  std::string output_path{};    // if given, standard output is appended to this file instead
  int parent_death_signal = 0;  // sent to the process when this program ends, in whatever way; 0: it lives on
  std::vector<std::string> without_environment{};  // names of variables that it does not inherit
  std::string
      cgroup{};  // folder of a control group (cgroup.h) that it is put into before its program runs; empty: ours
};

struct ExitStatus {
  bool known = false;  // false: another program spawned the process, which was adopted
  int code = 0;        // meaningful if `known` and not signalled
  int signal = 0;      // 0: not signalled

  bool Clean() const { return known && signal == 0 && code == 0; }
  // "exited with code 3", "killed by SIGSEGV (Segmentation fault)", "ended; its exit status is unknown".
  std::string Describe() const;

  friend bool operator==(const ExitStatus&, const ExitStatus&) = default;
};

class Process {
 public:
  // Returns once the program has been executed. UNAVAILABLE names the program, or the log file.
  static absl::StatusOr<Process> Spawn(const ProcessSpec& spec);
  // NOT_FOUND unless process `pid` lives and started at `start_time`.
  static absl::StatusOr<Process> Adopt(pid_t pid, std::uint64_t start_time);

  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  ~Process();

  pid_t pid() const { return pid_; }
  int pidfd() const { return pidfd_; }
  std::uint64_t start_time() const { return start_time_; }
  void Signal(int signal) const;                                 // does nothing once the process has ended
  bool WaitUntilEnded(std::chrono::milliseconds timeout) const;  // true once `Reap` returns at once
  ExitStatus Reap() const;                                       // waits for the end; once per process

 private:
  Process(pid_t pid, int pidfd, std::uint64_t start_time);

  pid_t pid_;
  int pidfd_;
  std::uint64_t start_time_;
};

// Clock ticks from boot to the start of a live process; nullopt if there is none, or it has ended and was not reaped.
std::optional<std::uint64_t> ProcessStartTime(pid_t pid);
inline bool IsAlive(std::int64_t pid) { return ProcessStartTime(static_cast<pid_t>(pid)).has_value(); }
// The kernel's identifier of this boot of the machine.
std::string BootId();

}  // namespace tessera::host

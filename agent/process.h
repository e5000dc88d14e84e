// Process: a worker's operating-system process, held by a pidfd so that a reused pid is never taken for it.
//
//   auto process = Process::Spawn({.argv = {"/usr/bin/tessera-region", "--region", "1"}, .log_path = "r1.log"});
//   loop.Watch(process->pidfd(), [&] { Report(process->Reap()); });  // readable once it has ended
//
// A spawned process leads a session of its own, has /dev/null as input and its log file as output, no other descriptor,
// no blocked signal: it outlives this program unless `die_with_parent`. An adopted one was spawned by an earlier life
// of this program; its exit status cannot be had. Thread rule: `Spawn` with `die_with_parent` only from a thread that
// lives as long as the program, since the kernel counts the end of the spawning *thread*. Else: one owner.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::agent {

struct SpawnSpec {
  std::vector<std::string> argv;                   // the first is the program's path
  std::string log_path;                            // appended to
  bool die_with_parent = false;                    // SIGKILL when this program ends, in whatever way
  std::vector<std::string> without_environment{};  // names of variables that it does not inherit
};

struct ExitStatus {
  bool known = false;  // else the process was adopted
  int code = 0;        // unless signalled
  int signal = 0;      // 0: not signalled

  friend bool operator==(const ExitStatus&, const ExitStatus&) = default;
};

class Process {
 public:
  // Returns once the program has been executed; an error names it, or the log file.
  static absl::StatusOr<Process> Spawn(const SpawnSpec& spec);
  // NOT_FOUND unless process `pid` lives and started at `start_time`.
  static absl::StatusOr<Process> Adopt(pid_t pid, std::uint64_t start_time);

  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  ~Process();

  pid_t pid() const { return pid_; }
  int pidfd() const { return pidfd_; }
  std::uint64_t start_time() const { return start_time_; }
  void Signal(int signal) const;  // of an ended process: nothing
  ExitStatus Reap() const;        // once pidfd is readable

 private:
  Process(pid_t pid, int pidfd, std::uint64_t start_time);

  pid_t pid_;
  int pidfd_;
  std::uint64_t start_time_;
};

// Clock ticks from boot to the start of a live process; nullopt if there is none, or it has ended and was not reaped.
std::optional<std::uint64_t> ProcessStartTime(pid_t pid);
std::string BootId();
// Whether the three ports from `first` on can be bound on `address` (IPv4) now: UDP, UDP, TCP.
bool PortsFree(const std::string& address, std::uint16_t first);

}  // namespace tessera::agent

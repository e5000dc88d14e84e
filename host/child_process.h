// ChildProcess: a process that lives at most as long as the object that holds it.
//
//   absl::StatusOr<ChildProcess> child = ChildProcess::Start({.argv = {program, "--ready-file", ready}, .log_path =
//   log}); if (!child->WaitForFile(ready, 30s)) return LastLines(log, 5); child->End(10s);
//
// It also ends with this program: it gets the spec's `parent_death_signal` then, SIGTERM if the spec has none.
// Thread rule: one owner; start it from a thread that lives as long as the child is to live.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "host/process.h"

namespace tessera::host {

class ChildProcess {
 public:
  // UNAVAILABLE names the program, or the log file.
  static absl::StatusOr<ChildProcess> Start(ProcessSpec spec);

  ChildProcess(ChildProcess&&) noexcept = default;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ~ChildProcess();  // as `End`, with 10 s of patience

  pid_t pid() const { return process_.pid(); }
  int pidfd() const { return process_.pidfd(); }
  // Its end, if it comes within `timeout`; at once when it has ended.
  std::optional<ExitStatus> Wait(std::chrono::milliseconds timeout);
  void Signal(int signal) const { process_.Signal(signal); }
  // Sends SIGTERM, then SIGKILL after `patience`. Returns when the process has ended.
  ExitStatus End(std::chrono::milliseconds patience);
  // Waits until there is a file at `path`. False when the process ended or the time is over first.
  bool WaitForFile(const std::string& path, std::chrono::milliseconds timeout);

 private:
  explicit ChildProcess(Process process) : process_(std::move(process)) {}

  Process process_;  // its pidfd is negative when this object was moved from
  std::optional<ExitStatus> ended_;
};

}  // namespace tessera::host

// For tests: the real tessera-region as a child process, with what it says on stderr.
//
// Thread rule: one thread. Destruction kills what still runs.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tessera::worker {

// How long a test waits for an event that must come. Long, so that a busy machine fails nothing.
inline constexpr std::chrono::seconds kPatience{60};

class WorkerProcess {
 public:
  explicit WorkerProcess(const std::vector<std::string>& arguments);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  pid_t pid() const { return pid_; }
  // Reads on until stderr holds `text` or ends. What it said so far is in `said()`.
  bool WaitForLine(const std::string& text);
  const std::string& said() const { return said_; }
  void Signal(int signal) const;
  // Its exit status; 128 + n for signal n, -1 if it does not end in time.
  int Wait();

 private:
  bool ReadMore(std::chrono::steady_clock::time_point deadline);  // false: ended or out of time

  pid_t pid_ = -1;
  int pidfd_ = -1, stderr_ = -1;
  std::string said_;
  std::optional<int> status_;
};

std::string ScenePath(const std::string& name);
// Writes `text` to a file of its own under the test's folder; its path.
std::string WriteTestFile(const std::string& name, const std::string& text);

// The first of 3 * `regions` ports on 127.0.0.1 that were free, for UDP and TCP, when it looked.
std::uint16_t FreeBasePort(std::uint32_t regions);

// What /metrics on that port says; a failed test and nothing if there is none.
std::string ReadMetrics(std::uint16_t port);

}  // namespace tessera::worker

// For tests: the real tessera-region as a child process, with its output.
//
// Thread rule: one thread. Destruction kills what still runs.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "host/testing/watched_program.h"

namespace tessera::worker {

inline constexpr std::chrono::seconds kPatience = host::kTestPatience;

class WorkerProcess {
 public:
  explicit WorkerProcess(const std::vector<std::string>& arguments);

  pid_t pid() const { return program_.pid(); }
  // Whether its output came to hold `text` before it ended.
  bool WaitForLine(const std::string& text) { return program_.WaitForText(text); }
  std::string said() const { return program_.Output(); }
  void Signal(int signal) const { program_.Signal(signal); }
  // Its exit status; 128 + n for signal n.
  int Wait();

 private:
  host::WatchedProgram program_;
};

std::string ScenePath(const std::string& name);
// Writes `text` to a file of its own under the test's folder; its path.
std::string WriteTestFile(const std::string& name, const std::string& text);

// The first of 3 * `regions` ports on 127.0.0.1 that were free, for UDP and TCP, when it looked.
std::uint16_t FreeBasePort(std::uint32_t regions);

// The text of /metrics on that port; a failed test and nothing if there is none.
std::string ReadMetrics(std::uint16_t port);

}  // namespace tessera::worker

// WatchedProgram: a program under test, whose output the test reads while it runs.
//
//   WatchedProgram worker({program, "--region", "1"});
//   ASSERT_TRUE(worker.WaitForText("listening")) << worker.Output();
//   worker.Signal(SIGTERM);
//   EXPECT_EQ(worker.Wait().code, 0);
//
// Destruction kills what still runs, and prints the output of a failed test. Thread rule: the test's main thread.
#pragma once

#include <chrono>
#include <ostream>
#include <string>
#include <vector>

#include "host/child_process.h"
#include "host/temporary_folder.h"

namespace tessera::host {

// How long a test waits for an event that must come. Long, so that a busy machine fails nothing.
inline constexpr std::chrono::seconds kTestPatience{60};

// In the message of a failed test.
inline void PrintTo(const ExitStatus& status, std::ostream* out) { *out << status.Describe(); }

class WatchedProgram {
 public:
  explicit WatchedProgram(std::vector<std::string> argv);
  ~WatchedProgram();

  pid_t pid() const { return process_.pid(); }
  void Signal(int signal) const { process_.Signal(signal); }
  // The exit status; the test fails, and the program is killed, if it does not end within kTestPatience.
  ExitStatus Wait();
  bool Ended() { return process_.Wait(std::chrono::milliseconds(0)).has_value(); }
  // Both outputs until now.
  std::string Output() const;
  // False if the program ends, or kTestPatience is over, and its output does not hold `text`.
  bool WaitForText(const std::string& text);

 private:
  std::string log() const { return folder_.path() + "/output"; }

  TemporaryFolder folder_;
  ChildProcess process_;
};

}  // namespace tessera::host

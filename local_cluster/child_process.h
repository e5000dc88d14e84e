// ChildProcess: a program started, watched and ended by the id we hold.
//
// It gets SIGTERM when the thread that started it ends, so that nothing outlives a command that was killed. Destruction
// ends it. Thread rule: start it from a thread that lives as long as it is to live.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tessera::local {

struct ExitStatus {
  int code = 0;                  // meaningful unless signal
  int signal = 0;                // 0: ended by itself
  std::string Describe() const;  // "exit status 1", "signal 9"
};

class ChildProcess {
 public:
  // argv[0] is the program's path. stdout and stderr are appended to `log_file`; stdout to `output_file` instead if one
  // is given. CommandError if it cannot be started.
  ChildProcess(const std::vector<std::string>& argv, const std::string& log_file, const std::string& output_file = {});
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  // Its end, if it comes within `timeout`; at once when it has ended.
  std::optional<ExitStatus> Wait(std::chrono::milliseconds timeout);
  void Signal(int signal) const;
  // SIGTERM, then SIGKILL after `patience`. Returns when it is gone.
  ExitStatus End(std::chrono::milliseconds patience);
  // Waits until `path` exists. False when the process ended or the time is over.
  bool WaitForFile(const std::string& path, std::chrono::milliseconds timeout);

 private:
  pid_t pid_ = -1;
  int pidfd_ = -1;
  std::optional<ExitStatus> ended_;
};

// Whether a process of this id runs; one that has ended and was not reaped does not.
bool IsAlive(std::int64_t pid);

// The last lines of a log, for an error message.
std::string LastLines(const std::string& file, int count);

}  // namespace tessera::local

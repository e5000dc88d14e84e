// StopSignal: Ctrl-C and SIGTERM as something to wait for, so that commands end in order.
//
// Blocks both signals in this thread and those it starts later; create it first in main's thread.
#pragma once

#include <chrono>

namespace tessera::cli {

class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  // True once a signal came; waits for it at most `timeout`.
  bool Wait(std::chrono::milliseconds timeout);

 private:
  int fd_ = -1;
  bool stopped_ = false;
};

}  // namespace tessera::cli

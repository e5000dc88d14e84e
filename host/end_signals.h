// Signals that a program waits for in place of being ended by them.
//
//   const sigset_t signals = host::BlockSignals({SIGTERM, SIGINT});
//   while (sigtimedwait(&signals, nullptr, &second) < 0) Work();
//
// Thread rule: free functions. Block before any other thread is made: threads inherit it from who makes them.
#pragma once

#include <signal.h>

#include <initializer_list>

namespace tessera::host {

inline sigset_t SetOfSignals(std::initializer_list<int> signals) {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : signals) sigaddset(&set, signal);
  return set;
}

// Blocks them in this thread. The set is for sigtimedwait or signalfd.
inline sigset_t BlockSignals(std::initializer_list<int> signals) {
  const sigset_t set = SetOfSignals(signals);
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  return set;
}

}  // namespace tessera::host

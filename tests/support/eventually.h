// Waiting for what other processes do, where only asking again tells whether it was done.
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace tessera::support {

// True as soon as `holds` is; false when it did not become so within `patience`, which only a failing test waits out.
inline bool Eventually(const std::function<bool()>& holds, std::chrono::seconds patience = std::chrono::seconds(90)) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));  // between two questions
  }
  return true;
}

}  // namespace tessera::support

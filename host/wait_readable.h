// WaitReadable: poll(2) that a signal handler does not cut short.
#pragma once

#include <chrono>
#include <initializer_list>

namespace tessera::host {

// Waits until one of the descriptors is readable; false if `timeout` is over first.
bool WaitReadable(std::initializer_list<int> descriptors, std::chrono::milliseconds timeout);

}  // namespace tessera::host

// LoopbackDoor: a TCP port of loopback where somebody listens, until it is closed.
//
// Thread rule: one thread.
#pragma once

#include <string>
#include <vector>

namespace tessera::control {

class LoopbackDoor {
 public:
  LoopbackDoor();  // at a free port
  ~LoopbackDoor() { Close(); }
  LoopbackDoor(const LoopbackDoor&) = delete;
  LoopbackDoor& operator=(const LoopbackDoor&) = delete;

  const std::string& address() const { return address_; }  // "127.0.0.1:41233", also while it is closed
  // Takes the connections that have come. How many there were.
  int Accept();
  // Closes those that were taken, as a server does that heard nothing from them.
  void Drop();
  // As the end of a process does.
  void Close();
  void Open();
  // Nobody who dials from now on is answered, as where a machine was cut off.
  void FallSilent();

 private:
  std::string address_;
  int listening_ = -1;
  std::vector<int> taken_;
};

}  // namespace tessera::control

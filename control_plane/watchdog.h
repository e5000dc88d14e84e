// Watchdog: tells systemd's, where the unit has one, that this process does its work. Without, systemd restarts it.
//
// Thread rule: one thread, while no other changes the environment.
#pragma once

#include <memory>
#include <utility>

#include "control_plane/http_pages.h"

namespace tessera::control {

class Watchdog {
 public:
  explicit Watchdog(std::shared_ptr<PlaneGate> gate);
  // Call it about every second. Says that all is well unless the control plane that leads is not alive; one that
  // follows has no work. True: it was said.
  bool Beat() const;

 private:
  const std::shared_ptr<PlaneGate> gate_;
  bool wanted_ = false;
};

}  // namespace tessera::control

#include "control_plane/watchdog.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace tessera::control {

Watchdog::Watchdog(std::shared_ptr<PlaneGate> gate) : gate_(std::move(gate)) {
  std::uint64_t span_us = 0;
  wanted_ = sd_watchdog_enabled(0, &span_us) > 0;
}

bool Watchdog::Beat() const {
  bool alive = true;
  if (wanted_) gate_->With([&alive](ControlPlane& plane) { alive = plane.Alive(); });
  return wanted_ && alive && sd_notify(0, "WATCHDOG=1") > 0;
}

}  // namespace tessera::control

#include "agent/service_notify.h"

#include <systemd/sd-daemon.h>

#include <chrono>
#include <cstdint>
#include <utility>

namespace tessera::agent {

ServiceNotify::ServiceNotify(std::shared_ptr<EventLoop> loop) : loop_(std::move(loop)) {
  std::uint64_t usec = 0;
  if (sd_watchdog_enabled(0, &usec) <= 0) return;
  watchdog_interval_ = std::chrono::microseconds(usec) / 2;
  BeatWatchdog();
}

void ServiceNotify::Ready() {
  if (std::exchange(ready_, true)) return;
  sd_notify(0, "READY=1");
}

void ServiceNotify::Stopping() { sd_notify(0, "STOPPING=1"); }

void ServiceNotify::Status(const std::string& text) {
  if (text == status_) return;
  status_ = text;
  sd_notify(0, ("STATUS=" + text).c_str());
}

void ServiceNotify::BeatWatchdog() {
  sd_notify(0, "WATCHDOG=1");
  loop_->RunAt(Clock::now() + watchdog_interval_, [this] { BeatWatchdog(); });
}

}  // namespace tessera::agent

// ServiceNotify: what systemd hears of this program (sd_notify(3)). Without systemd: nothing happens.
//
// Thread rule: the event loop's thread.
#pragma once

#include <memory>
#include <string>

#include "agent/event_loop.h"

namespace tessera::agent {

class ServiceNotify {
 public:
  // Starts the watchdog's beat if the unit has one: twice in its time, from the event loop, so a loop that hangs is
  // seen.
  explicit ServiceNotify(std::shared_ptr<EventLoop> loop);

  void Ready();
  void Stopping();
  void Status(const std::string& text);  // sent when it differs from the last

 private:
  void BeatWatchdog();

  std::shared_ptr<EventLoop> loop_;
  Duration watchdog_interval_{};
  bool ready_ = false;
  std::string status_;
};

}  // namespace tessera::agent

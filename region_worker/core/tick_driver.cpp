#include "region_worker/core/tick_driver.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "region_worker/core/link_message.h"

namespace tessera::worker {

TickDriver::TickDriver(region::Config config) : region_(config), pacer_(config.scene->tick_rate_hz) {}

void TickDriver::Run(TimePoint now) {
  running_ = true;
  last_step_ = now;
  Restart(now);
}

void TickDriver::Restart(TimePoint now) {
  pacer_.Start(now);
  waiting_since_.reset();
  waiting_for_.clear();
}

bool TickDriver::Due(TimePoint now) {
  if (!running_ || region_.halted() || now < pacer_.due()) return false;
  if (region_.CanStep()) return true;
  if (!waiting_since_) waiting_since_ = now;
  waiting_for_ = region_.WaitingFor();
  return false;
}

region::StepResult TickDriver::Step(TimePoint now, const region::PhaseObserver& observer, LinkTable& links,
                                    Actions& actions) {
  frame_wait_ = waiting_since_ ? now - *waiting_since_ : Duration(0);
  waiting_since_.reset();
  waited_for_ = std::exchange(waiting_for_, {});
  pacer_.Began(now);
  region::StepResult result = region_.Step(observer);
  stepped_ = true;
  last_step_ = now;
  watch_.Stepped();
  links.SendFrames(std::exchange(result.frames, {}), actions);
  return result;
}

void TickDriver::Watch(TimePoint now, bool may_give_up, LinkTable& links, Actions& actions) {
  if (!running_ || !watch_.Due(now, last_step_)) return;
  for (const RegionId neighbor : region_.neighbors()) links.Send(neighbor, Bare(LinkMessageKind::kAlive), actions);
  links.RepeatFrames(actions);
  const bool gives_up = may_give_up && !region_.halted();
  const std::vector<RegionId> waited_for = gives_up ? region_.WaitingFor() : std::vector<RegionId>();
  for (const SilentNeighbour& silent : watch_.Look(waited_for, links, now, tick_length())) {
    const auto silent_ms = std::chrono::duration_cast<std::chrono::milliseconds>(silent.silent).count();
    LogWarning(actions, absl::StrCat("border link down region=", silent.region.value(),
                                     " tick=", region_.tick().value(), " silent_ms=", silent_ms));
    region_.TakeLinkDown(silent.region);
    ++links_down_;
  }
}

std::optional<TimePoint> TickDriver::wake_at(TimePoint now) const {
  if (!running_ || region_.halted() || now >= pacer_.due()) return std::nullopt;
  return pacer_.due();
}

}  // namespace tessera::worker

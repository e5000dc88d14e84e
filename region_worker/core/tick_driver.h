// TickDriver: a region's ticks against the clock: when the next one is stepped, for whom it waits, and when it takes
// the link of a silent neighbour down.
//
//   TickDriver ticks(config);
//   ticks.SendFirstFrames(links, actions);
//   ticks.Run(now);
//   each round: if (ticks.Due(now)) { result = ticks.Step(now, links, actions); ...; ticks.StepEnded(end); }
//               else ticks.Watch(now, may_give_up, links, actions);
//
// Pure: the region's frames go out as actions, time is passed in. Thread rule: one thread.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/region/region.h"
#include "region_worker/core/actions.h"
#include "region_worker/core/link_table.h"
#include "region_worker/core/neighbour_watch.h"
#include "region_worker/core/tick_pacer.h"

namespace tessera::worker {

class TickDriver {
 public:
  explicit TickDriver(region::Config config);

  // Frames of the tick that the region begins with. Once, before anything else.
  void SendFirstFrames(LinkTable& links, Actions& actions) { links.SendFrames(region_.Start(), actions); }
  // From now on ticks are due.
  void Run(TimePoint now);
  bool running() const { return running_; }
  // Ticks in a second from the next one on.
  void SetPace(double ticks_per_second) { pacer_.SetRate(ticks_per_second); }
  // Ticks are counted anew from now: time in which none could be stepped is not caught up with.
  void Restart(TimePoint now);

  // Whether the next tick is to be stepped: it is time, and the neighbours' frames are here.
  bool Due(TimePoint now);
  // Requires Due. The result's frames have been sent.
  region::StepResult Step(TimePoint now, const region::PhaseObserver& observer, LinkTable& links, Actions& actions);
  // True if the tick was late: it ended more than a tick after its time.
  bool StepEnded(TimePoint end) { return pacer_.Finished(end); }
  // Says to the neighbours that this region is well while it waits, and takes the links of silent ones down if it may.
  void Watch(TimePoint now, bool may_give_up, LinkTable& links, Actions& actions);
  // When the next tick is due; nullopt while only a frame, or Run, can change anything.
  std::optional<TimePoint> wake_at(TimePoint now) const;

  bool stepped() const { return stepped_; }  // at least once
  TimePoint last_step() const { return last_step_; }
  Duration frame_wait() const { return frame_wait_; }  // before the last step
  // The neighbours whose frames came last, ascending; empty where the last step waited for none.
  std::span<const RegionId> waited_for() const { return waited_for_; }
  Duration tick_length() const { return pacer_.tick_length(); }
  std::uint64_t links_down() const { return links_down_; }  // that it took down

  const region::Region& region() const { return region_; }
  region::Region& region() { return region_; }

 private:
  region::Region region_;
  TickPacer pacer_;
  NeighbourWatch watch_;
  bool running_ = false, stepped_ = false;
  TimePoint last_step_{};
  std::optional<TimePoint> waiting_since_;  // for frames
  Duration frame_wait_{0};
  std::vector<RegionId> waiting_for_, waited_for_;  // now; before the last step
  std::uint64_t links_down_ = 0;
};

}  // namespace tessera::worker

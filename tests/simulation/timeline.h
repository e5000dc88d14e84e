// Timeline: virtual time, and what happens when. Nothing sleeps: the clock jumps to the next event.
//
//   Timeline timeline;
//   timeline.In(Micros(2000), [&] { deliver(); });
//   while (timeline.now() < end && timeline.RunNext()) {}
//
// Events of one instant run in the order in which they were asked for. Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <queue>
#include <vector>

namespace tessera::simulation {

using Micros = std::uint64_t;  // since the start of the simulation
constexpr Micros Milliseconds(std::uint64_t n) { return n * 1000; }

class Timeline {
 public:
  Micros now() const { return now_; }
  void At(Micros time, std::function<void()> action) {
    events_.push({time < now_ ? now_ : time, serial_++, std::move(action)});
  }
  void In(Micros delay, std::function<void()> action) { At(now_ + delay, std::move(action)); }
  // The time of the next event; requires one.
  Micros next() const { return events_.top().time; }
  bool empty() const { return events_.empty(); }
  // Time passes in which nothing happens: requires that no event is due before.
  void AdvanceTo(Micros time) { now_ = time > now_ ? time : now_; }
  bool RunNext() {
    if (events_.empty()) return false;
    Event event = std::move(const_cast<Event&>(events_.top()));  // it is popped before it runs
    events_.pop();
    now_ = event.time;
    event.action();
    return true;
  }

 private:
  struct Event {
    Micros time = 0;
    std::uint64_t serial = 0;
    std::function<void()> action;
    bool operator<(const Event& other) const { return time != other.time ? time > other.time : serial > other.serial; }
  };
  Micros now_ = 0;
  std::uint64_t serial_ = 0;
  std::priority_queue<Event> events_;
};

}  // namespace tessera::simulation

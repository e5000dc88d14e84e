#include "region_worker/tick_meter.h"

#include <ctime>

#include "spdlog/spdlog.h"

namespace tessera::worker {
namespace {

constexpr Duration kLogDistance = std::chrono::seconds(1);
constexpr int kLongTick = 2;  // times as long as it should be: logged

double Seconds(Duration duration) { return std::chrono::duration<double>(duration).count(); }

std::int64_t Ms(Duration duration) { return std::chrono::duration_cast<std::chrono::milliseconds>(duration).count(); }

Duration CpuTimeOfThread() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

void TickMeter::Begin(TimePoint now) {
  begun_before_ = std::exchange(begun_, now);
  const Duration worked = CpuTimeOfThread();
  worked_ = worked - std::exchange(worked_until_, worked);
}

region::PhaseObserver TickMeter::observer() {
  return [this](region::Phase phase) { entered_[static_cast<std::size_t>(phase)] = Clock::now(); };
}

void TickMeter::Stepped(const TickDriver& ticks) {
  const auto length_of = [&](region::Phase phase) {
    const auto index = static_cast<std::size_t>(phase);
    return Seconds(entered_[index + 1] - entered_[index]);
  };
  metrics_.physics.Observe(length_of(region::Phase::kPhysics));
  metrics_.prediction.Observe(length_of(region::Phase::kPrediction));
  metrics_.frame_wait.Observe(Seconds(ticks.frame_wait()));
  metrics_.CountWait(ticks.waited_for(), Seconds(ticks.frame_wait()));
  if (begun_before_ != TimePoint()) NoteLength(ticks);
}

void TickMeter::NoteLength(const TickDriver& ticks) {
  const Duration whole = begun_ - begun_before_;
  longest_tick_.Add(begun_, {.whole = whole, .worked = worked_});
  metrics_.longest_tick.Set(Seconds(longest_tick_.longest().whole));
  metrics_.longest_tick_cpu.Set(Seconds(longest_tick_.longest().worked));
  if (whole <= kLongTick * ticks.tick_length() || begun_ < may_log_at_) return;
  may_log_at_ = begun_ + kLogDistance;
  spdlog::info("long tick={} ms={} cpu_ms={} stepping_ms={} waiting_ms={}", ticks.region().tick().value(), Ms(whole),
               Ms(worked_), Ms(stepping_), Ms(ticks.frame_wait()));
}

Duration TickMeter::End(TimePoint now) {
  stepping_ = now - begun_;
  const Duration work = stepping_ + std::exchange(receive_time_, Duration(0));
  metrics_.step.Observe(Seconds(work));
  return work;
}

}  // namespace tessera::worker

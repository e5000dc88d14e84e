#include "region_worker/core/game_log.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "telemetry/log_value.h"

namespace tessera::worker {

void GameLog::Take(std::vector<game::GameLine> lines, TimePoint now, Actions& actions) {
  if (lines.empty()) return;
  const double passed_s = refilled_ == TimePoint() ? 0 : std::chrono::duration<double>(now - refilled_).count();
  allowance_ = std::min(kBurst, allowance_ + passed_s * kLinesPerSecond);
  refilled_ = now;
  for (const game::GameLine& line : lines) {
    ++last_;
    // That a callback is off is said once for each, and is what an operator must see.
    if (allowance_ < 1 && !line.off) {
      ++left_out_;
      ++left_out_since_;
      continue;
    }
    allowance_ = std::max(0.0, allowance_ - 1);
    Write(line, actions);
  }
}

void GameLog::Write(const game::GameLine& line, Actions& actions) {
  if (const std::uint64_t count = std::exchange(left_out_since_, 0); count > 0) {
    LogWarning(actions, absl::StrCat("game lines left out count=", count));
  }
  std::string text = absl::StrCat(line.error ? "game error tick=" : "game tick=", line.tick.value());
  if (line.self != BodyId()) absl::StrAppend(&text, " body=", line.self.value());
  absl::StrAppend(&text, " text=", telemetry::LogValue(line.text));
  if (line.error) {
    LogWarning(actions, std::move(text));
  } else {
    LogInfo(actions, std::move(text));
  }
  v1::GameLine& kept = newest_.emplace_back();
  kept.set_number(last_);
  kept.set_tick(line.tick.value());
  kept.set_body(line.self.value());
  kept.set_error(line.error);
  kept.set_callback_off(line.off);
  kept.set_text(line.text);
  if (newest_.size() > kReported) newest_.pop_front();
}

void GameLog::Report(v1::WorkerReport& report) const {
  report.mutable_game_lines()->Add(newest_.begin(), newest_.end());
}

}  // namespace tessera::worker

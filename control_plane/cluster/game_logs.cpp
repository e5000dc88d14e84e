#include "control_plane/cluster/game_logs.h"

#include <algorithm>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/control_settings.h"
#include "control_plane/instance_record.h"
#include "control_plane/one_line.h"

namespace tessera::control {
namespace {

std::string EventOf(std::uint32_t region, const v1::GameLine& line) {
  return absl::StrCat("game in region ", region, ", tick ", line.tick(), ": ", line.text());
}

}  // namespace

void GameLogs::Take(InstanceEntry& instance, const v1::WorkerReport& report, Now now) {
  if (report.game_lines().empty() || instance.record.game_hash().empty()) return;
  Log& log = logs_[instance.number];
  const std::uint32_t region = report.identity().region();
  auto& [incarnation, heard] = log.heard[region];
  if (std::exchange(incarnation, report.identity().incarnation()) != report.identity().incarnation()) heard = 0;
  std::vector<std::string> events;
  for (const v1::GameLine& reported : report.game_lines()) {
    if (reported.number() <= heard) continue;
    heard = reported.number();
    v1::GameLogLine& line = log.lines.emplace_back();
    line.set_number(state_.NextRevision());
    *line.mutable_time() = ToTimestamp(now.unix_time);
    line.set_region(region);
    line.set_incarnation(incarnation);
    *line.mutable_line() = reported;
    line.mutable_line()->set_text(OneLine(reported.text(), kMaxGameLineBytes));
    if (Matters(line.line(), log, now)) events.push_back(EventOf(region, line.line()));
    if (log.lines.size() > kMaxGameLines) log.lines.pop_front();
  }
  if (events.empty()) return;
  records::Instance next = instance.record;
  for (const std::string& event : events) {
    state_.Log(absl::StrCat("game id=", next.id(), ": ", event));
    AddEvent(next, now, event);
  }
  if (absl::Status status = state_.StoreInstance(instance, next); !status.ok()) {
    LogTrouble(state_, instance, "events of the game cannot be stored for now", status);
  }
}

bool GameLogs::Matters(const v1::GameLine& line, Log& log, Now now) {
  if (!line.error()) return false;
  const bool first = !log.last_error || now.steady - *log.last_error >= kGameErrorSilence;
  log.last_error = now.steady;
  return first || (line.callback_off() && ++log.callbacks_off <= kMaxCallbacksOff);
}

std::vector<v1::GameLogLine> GameLogs::After(const InstanceEntry& instance, std::uint64_t number) const {
  const auto log = logs_.find(instance.number);
  if (log == logs_.end()) return {};
  const auto& lines = log->second.lines;
  const auto first = std::ranges::upper_bound(lines, number, {}, [](const auto& line) { return line.number(); });
  return {first, lines.end()};
}

}  // namespace tessera::control

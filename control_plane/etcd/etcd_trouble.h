// EtcdTrouble: says once, in words that name what to do, that etcd has been of no use for some seconds.
//
// Each new reason is a warning at once, since most pass by themselves: etcd's members elect their leader, a control
// plane starts before etcd does. A reason that stays is an error after `patience`, once, until etcd answers again.
//
//   EtcdTrouble trouble(std::chrono::seconds(5));
//   if (const auto line = trouble.Note(status, now)) spdlog::log(line->level, "{}", line->text);
//
// Thread rule: none of its own. Time is passed in.
#pragma once

#include <spdlog/common.h>

#include <chrono>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace tessera::control {

class EtcdTrouble {
 public:
  using Clock = std::chrono::steady_clock;
  struct Line {
    spdlog::level::level_enum level;
    std::string text;
  };

  explicit EtcdTrouble(std::chrono::nanoseconds patience) : patience_(patience) {}

  // The line to be logged after an attempt that came to `status`, if there is one. ABORTED is no trouble: etcd has
  // answered that another was faster.
  std::optional<Line> Note(const absl::Status& status, Clock::time_point now);

 private:
  const std::chrono::nanoseconds patience_;
  std::string reason_;                      // that was logged last; empty: none
  std::optional<Clock::time_point> since_;  // etcd has been of no use; nothing: it is not so
  bool said_ = false;                       // as an error
};

// The thing to do for an operator, so that this error of a call to etcd goes away.
std::string EtcdRemedy(const absl::Status& status);

}  // namespace tessera::control

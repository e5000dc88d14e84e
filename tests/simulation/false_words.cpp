#include "tests/simulation/false_words.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace tessera::simulation {
namespace {

std::string InSeconds(Micros time) { return absl::StrFormat("%.3f s", static_cast<double>(time) / 1e6); }

}  // namespace

bool FalseWords::Stretch::Note(bool goes_on, Micros span, Micros at_most) {
  const Micros before = now;
  now = goes_on ? now + span : 0;
  longest = std::max(longest, now);
  return before <= at_most && now > at_most;
}

void FalseWords::Problem(Micros now, const std::string& what) {
  problems_.push_back(absl::StrCat(InSeconds(now), ": ", what));
}

void FalseWords::Stepped(RegionId region, Incarnation life, Tick tick, Micros now) {
  Steps& newest = steps_[region];
  const bool later = newest.made && life > newest.life;
  const bool earlier = newest.made && life < newest.life;
  if (earlier || (later && tick.value() + bounds_.set_back_ticks <= newest.last.value())) {
    if (doubled_.emplace(region, life).second) {
      ++two_owners_;
      Problem(now, absl::StrCat("region ", region.value(), "#", life.value(), " makes tick ", tick.value(), ", #",
                                newest.life.value(), " made tick ", newest.last.value(), " at ", InSeconds(newest.at)));
    }
    if (earlier) return;
  }
  if (newest.made && !later) tick = std::max(tick, newest.last);
  newest = {life, tick, now, true};
}

void FalseWords::Look(Micros now, std::span<const RegionId> world, std::span<const Word> words) {
  const Micros span = now - std::exchange(looked_at_, now);
  const Steps* stands = nullptr;
  RegionId which;
  for (const RegionId region : world) {
    const Steps& steps = steps_.try_emplace(region, Steps{.at = now}).first->second;
    if (now - steps.at < bounds_.no_step || stands != nullptr) continue;
    stands = &steps;
    which = region;
  }
  all_step_ = stands == nullptr;
  standing_.Note(!all_step_, span);
  silent_.Note(words.empty(), span);
  for (const Word& word : words) {
    Speaker& speaker = speakers_[word.reign];
    if (speaker.running.Note(word.said == Said::kRunning && !all_step_, span, bounds_.at_most)) {
      ++lies_;
      Problem(now, absl::StrCat("RUNNING is said for ", InSeconds(speaker.running.now), ", region ", which.value(),
                                " stands since ", InSeconds(stands->at)));
    }
    if (speaker.degraded.Note(word.said == Said::kDegraded && all_step_ && word.sees, span, bounds_.at_most)) {
      ++lies_;
      Problem(now, absl::StrCat("DEGRADED is said for ", InSeconds(speaker.degraded.now), ", all regions step"));
    }
    if (word.said == Said::kOver && !std::exchange(speaker.over, true)) {
      ++lies_;
      ++ended_;
      Problem(now, "the world is said to be over, and nobody ended it");
    }
    running_ = std::max(running_, speaker.running.longest);
    degraded_ = std::max(degraded_, speaker.degraded.longest);
  }
}

void FalseWords::CheckKept(Micros now, const std::set<std::string>& there) {
  std::erase_if(acknowledged_, [&](const std::string& change) {
    if (there.contains(change)) return false;
    ++lost_changes_;
    Problem(now, absl::StrCat(change, " was acknowledged and is lost"));
    return true;
  });
}

void FalseWords::PutBack(const std::set<std::string>& kept) {
  std::erase_if(acknowledged_, [&](const std::string& change) { return !kept.contains(change); });
}

}  // namespace tessera::simulation

// FalseWords: holds what control planes say against what is so. It knows nothing of how either comes about, so it
// cannot share a fault with what it checks.
//
//   FalseWords words;
//   words.Stepped(RegionId(2), Incarnation(2), Tick(60), now);           // each step of each worker
//   words.Look(now, world, {{{.reign = 1, .said = Said::kRunning}}});    // every few milliseconds
//   words.Acknowledged("token-7");
//   words.CheckKept(now, {"token-7"});                                   // what the leader has now
//   EXPECT_THAT(words.lies(), IsEmpty());
//
// Lies:
//   RUNNING    is said of a world of which a region has made no step for `no_step`, for longer than `at_most` on end
//   DEGRADED   is said of one that steps, by a control plane that can see so, for longer than `at_most` on end
//   over       is said of one that nobody ended
// Each reign has that time for itself: whoever begins to lead has first to hear, and no longer for that. While a
// control plane answers nobody it says nothing, true or false, and its time stands.
//
// Two owners: once a later life of a region has stepped an earlier one never does, and the later one begins no further
// back than a death may set it. So a world that was set back by a backup is two owners as well. Lost: a change that was
// acknowledged and is not there.
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/world/ids.h"
#include "tests/simulation/timeline.h"

namespace tessera::simulation {

// A world's state, by one control plane. kOther: that it starts, or anything else that is no matter here.
enum class Said : std::uint8_t { kOther, kRunning, kDegraded, kOver };

struct Word {
  std::uint64_t reign = 0;  // another number whenever one begins to lead, or goes on after it was stopped
  Said said = Said::kOther;
  bool sees = true;  // nothing keeps it from seeing that the world steps, and nothing else is amiss with the world
};

struct WordBounds {
  Micros no_step = Milliseconds(250);   // a region without a step for so long does not step
  Micros at_most = Milliseconds(2000);  // the goal of the figures about a cluster's faults
  // A death sets back poses, which are told before the standby has them (core/region/output_commit.h): so many ticks at
  // most may be made again by the life that takes the place.
  std::uint64_t set_back_ticks = 30;
};

class FalseWords {
 public:
  // `begin`: nothing before it counts.
  explicit FalseWords(const WordBounds& bounds = {}, Micros begin = 0) : bounds_(bounds), looked_at_(begin) {}

  void Stepped(RegionId region, Incarnation life, Tick tick, Micros now);
  // All is taken to have been since the last look as it is now. `world`: the regions that it consists of.
  void Look(Micros now, std::span<const RegionId> world, std::span<const Word> words);

  void Acknowledged(const std::string& change) { acknowledged_.insert(change); }
  // All that is there. Each loss is counted once.
  void CheckKept(Micros now, const std::set<std::string>& there);
  // The store is that of a backup now: what is not in it is lost rightly.
  void PutBack(const std::set<std::string>& kept);

  // The longest time on end: in which RUNNING was said while a region did not step; DEGRADED while all did; in which
  // nobody answered; in which not all regions stepped.
  Micros false_running() const { return running_; }
  Micros false_degraded() const { return degraded_; }
  Micros silent() const { return silent_.longest; }
  Micros stood() const { return standing_.longest == 0 ? 0 : standing_.longest + bounds_.no_step; }
  // As of the last look.
  bool all_step() const { return all_step_; }

  std::uint64_t two_owners() const { return two_owners_; }
  std::uint64_t lost_changes() const { return lost_changes_; }
  std::uint64_t lies() const { return lies_; }
  // Reigns that said of the world that it is over; among the lies.
  std::uint64_t ended() const { return ended_; }
  // All of it for a person: "12.340 s: RUNNING is said for 2.010 s, region 3 stands since 10.080 s".
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  struct Stretch {
    Micros now = 0, longest = 0;
    // True: it has just become longer than `at_most`.
    bool Note(bool goes_on, Micros span, Micros at_most = ~Micros{0});
  };
  struct Steps {
    Incarnation life{};
    Tick last{};
    Micros at = 0;
    bool made = false;  // one step at least
  };
  struct Speaker {
    Stretch running, degraded;
    bool over = false;
  };
  void Problem(Micros now, const std::string& what);

  WordBounds bounds_;
  Micros looked_at_ = 0;
  bool all_step_ = true;
  std::map<RegionId, Steps> steps_;  // those of the newest life
  std::set<std::pair<RegionId, Incarnation>> doubled_;
  std::map<std::uint64_t, Speaker> speakers_;  // by reign
  Stretch silent_, standing_;
  Micros running_ = 0, degraded_ = 0;
  std::set<std::string> acknowledged_;
  std::uint64_t two_owners_ = 0, lost_changes_ = 0, lies_ = 0, ended_ = 0;
  std::vector<std::string> problems_;
};

}  // namespace tessera::simulation

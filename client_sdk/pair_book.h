// PairBook: which bodies touch, or overlap with a trigger, as the game is told: each begin once, each end once, and no
// end without its begin.
//
// A pair is told of by the region that owns its lower moving body, and that changes; connections to two regions are
// not in step, and one may break. So what comes is put in the order of its ticks: a begin of what has begun, or an end
// of what has not, waits kHold for what must have happened between. (Two
// touches closer together than two regions' connections are apart may come out as one.) A region that begins anew says
// which pairs there are, and what it does not name is over. The game hears of pairs while both bodies are in its sight.
//
//   book.Told(now, region, tick, {a, b, trigger}, begin);                  // as regions tell
//   book.Settle(now, [&](BodyId id) { return in_sight(id); }, events);     // once a poll, after the world
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <compare>
#include <functional>
#include <map>
#include <set>
#include <vector>

#include "client_sdk/client.h"

namespace tessera::client {

struct BodyPair {
  BodyId a, b;  // a < b
  bool trigger = false;
  friend auto operator<=>(const BodyPair&, const BodyPair&) = default;
};

class PairBook {
 public:
  using Seen = std::function<bool(BodyId)>;

  // How long news wait for news from before them.
  static constexpr std::chrono::milliseconds kHold{2000};
  // How long a pair out of sight is remembered: it may come into sight still touching.
  static constexpr std::chrono::milliseconds kUnseen{10'000};

  void Told(TimePoint now, RegionId from, Tick tick, const BodyPair& pair, bool begin);
  // `from` begins anew: at `tick` these pairs are all that it tells of. What it told of before is over, but for pairs
  // that `elsewhere` says another region tells of by now.
  void ToldAll(TimePoint now, RegionId from, Tick tick, const std::vector<BodyPair>& pairs,
               const std::function<bool(const BodyPair&)>& elsewhere);
  void Settle(TimePoint now, const Seen& in_sight, std::vector<ClientEvent>& events);
  std::size_t size() const { return pairs_.size(); }

 private:
  struct News {
    Tick tick;
    bool begin = false;
    RegionId from;
    TimePoint until;
    friend bool operator<(const News& x, const News& y) {
      return x.tick != y.tick ? x.tick < y.tick : x.begin < y.begin;
    }
  };
  struct Entry {
    bool touches = false;  // as far as is known
    bool told = false;     // to the game
    Tick tick;             // of what is known
    RegionId from;
    std::set<News> waiting;
    TimePoint idle_since{};  // nothing is waited for, and nothing to be seen of it
  };

  static void Tell(const BodyPair& pair, Entry& entry, bool begin, std::vector<ClientEvent>& events);

  std::map<BodyPair, Entry> pairs_;
};

}  // namespace tessera::client

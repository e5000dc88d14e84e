// PairBook: the pairs of bodies that touch, or overlap with a trigger, as events for the game: each begin once, each
// end once, and no end without its begin.
//
// A pair is reported by the region that owns its lower moving body, and that changes; connections to two regions are
// not in step, and one may break. So updates are put in the order of their ticks: a begin of a pair that has begun, or
// an end of one that has not, waits kHold for the update that must have happened between. (Two touches closer together
// than two regions' connections are apart may come out as one.) A region that begins anew sends all its pairs; others
// that it had sent before are over. The game gets events of a pair while both bodies are in its sight.
//
//   book.Take(now, region, tick, {a, b, trigger}, begin);                  // updates of regions
//   book.Settle(now, [&](BodyId id) { return in_sight(id); }, events);     // once a poll, after the world
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <compare>
#include <functional>
#include <map>
#include <optional>
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

  // How long an update waits for earlier ones.
  static constexpr std::chrono::milliseconds kHold{2000};
  // How long a pair out of sight is remembered: it may come into sight still touching.
  static constexpr std::chrono::milliseconds kUnseen{10'000};

  void Take(TimePoint now, RegionId from, Tick tick, const BodyPair& pair, bool begin,
            const std::optional<MeetingPoint>& contact = std::nullopt, bool since_before = false);
  // `from` begins anew: at `tick` these are all its pairs. Others that it had sent before are over, but for those that
  // another region has by now, as `elsewhere` says.
  void TakeAll(TimePoint now, RegionId from, Tick tick, const std::vector<BodyPair>& pairs,
               const std::function<bool(const BodyPair&)>& elsewhere);
  void Settle(TimePoint now, const Seen& in_sight, std::vector<ClientEvent>& events);
  std::size_t size() const { return pairs_.size(); }

 private:
  struct Update {
    Tick tick;
    bool begin = false;
    RegionId from;
    TimePoint until;
    std::optional<MeetingPoint> contact;
    bool since_before = false;  // the region had it when it was connected to
    friend bool operator<(const Update& x, const Update& y) {
      return x.tick != y.tick ? x.tick < y.tick : x.begin < y.begin;
    }
  };
  struct Entry {
    bool touches = false;   // as far as is known
    bool reported = false;  // to the game
    Tick tick;              // time of the known state
    RegionId from;
    std::optional<MeetingPoint> contact;  // from the last begin
    bool since_before = false;            // the last begin was before there was a connection to hear of it
    std::set<Update> waiting;
    TimePoint idle_since{};  // since when nothing waits and nothing is reported
  };

  static void Report(const BodyPair& pair, Entry& entry, bool begin, std::vector<ClientEvent>& events);

  std::map<BodyPair, Entry> pairs_;
};

}  // namespace tessera::client

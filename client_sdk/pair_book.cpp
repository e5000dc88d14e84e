#include "client_sdk/pair_book.h"

namespace tessera::client {

void PairBook::Take(TimePoint now, RegionId from, Tick tick, const BodyPair& pair, bool begin,
                    const std::optional<MeetingPoint>& contact, bool since_before) {
  const auto [at, fresh] = pairs_.try_emplace(pair);
  Entry& entry = at->second;
  if (fresh) entry.idle_since = now;
  // Ignore an update that is known already, or older than the present state.
  if (!fresh && (tick < entry.tick || (tick == entry.tick && begin == entry.touches))) return;
  entry.waiting.insert({tick, begin, from, now + kHold, contact, since_before});
}

void PairBook::TakeAll(TimePoint now, RegionId from, Tick tick, const std::vector<BodyPair>& pairs,
                       const std::function<bool(const BodyPair&)>& elsewhere) {
  const std::set<BodyPair> named(pairs.begin(), pairs.end());
  for (auto& [pair, entry] : pairs_) {
    if (entry.from != from || named.contains(pair) || elsewhere(pair)) continue;
    if (entry.tick > tick) entry.tick = tick;  // the world has gone back to an earlier state
    entry.waiting.clear();
    if (entry.touches) entry.waiting.insert({tick, false, from, now, {}, false});
  }
  for (const BodyPair& pair : named) {
    const auto known = pairs_.find(pair);
    if (known == pairs_.end() || !known->second.touches) {
      Take(now, from, tick, pair, true, std::nullopt, true);
    } else {
      known->second.from = from;
      known->second.tick = tick;
      known->second.waiting.clear();
    }
  }
}

void PairBook::Report(const BodyPair& pair, Entry& entry, bool begin, std::vector<ClientEvent>& events) {
  using Kind = ClientEvent::Kind;
  const Kind contact = begin ? Kind::kContactBegan : Kind::kContactEnded;
  const Kind trigger = begin ? Kind::kTriggerEntered : Kind::kTriggerLeft;
  entry.reported = begin;
  events.push_back({.kind = pair.trigger ? trigger : contact, .body = pair.a, .other = pair.b, .region = entry.from});
  if (!begin) return;
  events.back().contact = entry.contact;
  events.back().since_before = entry.since_before;
}

void PairBook::Settle(TimePoint now, const Seen& in_sight, std::vector<ClientEvent>& events) {
  for (auto at = pairs_.begin(); at != pairs_.end();) {
    const BodyPair& pair = at->first;
    Entry& entry = at->second;
    const bool seen = in_sight(pair.a) && in_sight(pair.b);
    if (entry.reported && !seen) Report(pair, entry, false, events);
    while (!entry.waiting.empty()) {
      const Update update = *entry.waiting.begin();
      const bool fits = update.begin != entry.touches;
      if (!fits && now < update.until) break;
      entry.waiting.erase(entry.waiting.begin());
      if (!fits) continue;  // the update between is lost
      entry.touches = update.begin;
      entry.tick = update.tick;
      entry.from = update.from;
      entry.contact = update.contact;
      entry.since_before = update.since_before;
      if (seen && update.begin != entry.reported) Report(pair, entry, update.begin, events);
    }
    if (seen && entry.touches && !entry.reported) Report(pair, entry, true, events);
    if (entry.reported || !entry.waiting.empty()) entry.idle_since = now;
    const bool forgotten = now - entry.idle_since >= (entry.touches ? kUnseen : kHold);
    at = forgotten ? pairs_.erase(at) : std::next(at);
  }
}

}  // namespace tessera::client

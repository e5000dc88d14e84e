// GuestBook: who came in through a door, found by what a stranger shows, and what of a door is due when. Whatever asks
// it takes no longer with thousands inside than with one.
//
//   book.Enter(number, {from, nonce}, token_id, player);  // came in, and leads nowhere yet
//   book.GreetedAs({from, nonce});  book.UnsettledOf(token_id);  book.CountFrom(host);  book.CountOf(player);
//   book.Settle(number, token_id);                        // it does now
//   book.Leave(number, {from, nonce}, token_id, player);
//   agenda.Move(number, due, new_due);  while (agenda.first() && agenda.first()->at <= now) ...
//
// Thread rule: one thread.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "net/door.h"

namespace tessera::net {

using TokenId = std::array<std::uint8_t, 24>;

// What a guest's first words are known by.
struct Greeting {
  Address from;
  Nonce nonce{};
  friend bool operator==(const Greeting&, const Greeting&) = default;
  template <class H>
  friend H AbslHashValue(H h, const Greeting& g) {
    return H::combine(std::move(h), g.from.host, g.from.port, g.nonce);
  }
};

class GuestBook {
 public:
  // Requires that nobody inside has that greeting, nor an unsettled session by that token.
  void Enter(SessionNumber number, const Greeting& greeting, const TokenId& token, PlayerNumber player) {
    greeted_[greeting] = number;
    unsettled_[token] = number;
    ++from_[greeting.from.host];
    ++of_[player];
  }
  void Settle(SessionNumber number, const TokenId& token) {
    const auto found = unsettled_.find(token);
    if (found != unsettled_.end() && found->second == number) unsettled_.erase(found);
  }
  void Leave(SessionNumber number, const Greeting& greeting, const TokenId& token, PlayerNumber player) {
    Settle(number, token);
    greeted_.erase(greeting);
    const auto from = from_.find(greeting.from.host);
    if (--from->second == 0) from_.erase(from);
    const auto of = of_.find(player);
    if (--of->second == 0) of_.erase(of);
  }

  std::optional<SessionNumber> GreetedAs(const Greeting& greeting) const { return In(greeted_, greeting); }
  std::optional<SessionNumber> UnsettledOf(const TokenId& token) const { return In(unsettled_, token); }
  std::size_t CountFrom(std::uint32_t host) const {
    const auto found = from_.find(host);
    return found == from_.end() ? 0 : found->second;
  }
  std::size_t CountOf(PlayerNumber player) const {
    const auto found = of_.find(player);
    return found == of_.end() ? 0 : found->second;
  }

 private:
  template <class Key>
  static std::optional<SessionNumber> In(const absl::flat_hash_map<Key, SessionNumber>& map, const Key& key) {
    const auto found = map.find(key);
    return found == map.end() ? std::nullopt : std::optional(found->second);
  }

  absl::flat_hash_map<Greeting, SessionNumber> greeted_;
  absl::flat_hash_map<TokenId, SessionNumber> unsettled_;
  absl::flat_hash_map<std::uint32_t, std::size_t> from_;  // by host
  absl::flat_hash_map<PlayerNumber, std::size_t> of_;     // by player; PlayerNumber(): of regions
};

class Agenda {
 public:
  using TimePoint = Door::TimePoint;
  struct Entry {
    TimePoint at;
    SessionNumber session;
    friend auto operator<=>(const Entry&, const Entry&) = default;
  };

  // Of a session, from when it was due to when it is now; nothing: never.
  void Move(SessionNumber session, std::optional<TimePoint>& due, std::optional<TimePoint> to) {
    if (due) entries_.erase({*due, session});
    due = to;
    if (due) entries_.insert({*due, session});
  }
  std::optional<Entry> first() const { return entries_.empty() ? std::nullopt : std::optional(*entries_.begin()); }

 private:
  std::set<Entry> entries_;
};

}  // namespace tessera::net

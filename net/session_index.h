// SessionIndex: the accepted sessions of an acceptor, found by what a datagram of an unproven peer shows. Each question
// takes as long with thousands of sessions as with one.
//
//   index.Enter(number, {from, nonce}, token_id, player);  // accepted, but no connection uses it yet
//   index.GreetedAs({from, nonce});  index.UnsettledOf(token_id);  index.CountFrom(host);  index.CountOf(player);
//   index.Settle(number, token_id);                        // a connection uses it now
//   index.Leave(number, {from, nonce}, token_id, player);
//
// Thread rule: one thread.
#pragma once

#include <array>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "net/acceptor.h"

namespace tessera::net {

using TokenId = std::array<std::uint8_t, 24>;

// Identifies a handshake: the address and the nonce of its Hello.
struct Greeting {
  Address from;
  Nonce nonce{};
  friend bool operator==(const Greeting&, const Greeting&) = default;
  template <class H>
  friend H AbslHashValue(H h, const Greeting& g) {
    return H::combine(std::move(h), g.from.host, g.from.port, g.nonce);
  }
};

class SessionIndex {
 public:
  // Requires that no session here has that greeting, and no unsettled one that token.
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
  absl::flat_hash_map<PlayerNumber, std::size_t> of_;     // by player; PlayerNumber() counts those of regions
};

}  // namespace tessera::net

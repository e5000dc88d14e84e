// SessionIndex: the accepted sessions of an acceptor, found by what a datagram of an unproven peer shows. Each question
// takes as long with thousands of sessions as with one.
//
//   index.Enter(number, {from, nonce}, holder, player);  // accepted, but no connection uses it yet
//   index.GreetedAs({from, nonce});  index.UnsettledOf(holder);  index.CountFrom(host);  index.CountOf(player);
//   index.Settle(number, holder);                        // a connection uses it now
//   index.Leave(number, {from, nonce}, holder, player);
//
// Thread rule: one thread.
#pragma once

#include <array>
#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "net/acceptor.h"

namespace tessera::net {

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
  // Requires that no session here has that greeting, and no unsettled one that holder.
  void Enter(SessionNumber number, const Greeting& greeting, const VerificationKey& holder, PlayerNumber player) {
    greeted_[greeting] = number;
    unsettled_[holder] = number;
    ++from_[greeting.from.host];
    ++of_[player];
  }
  void Settle(SessionNumber number, const VerificationKey& holder) {
    const auto found = unsettled_.find(holder);
    if (found != unsettled_.end() && found->second == number) unsettled_.erase(found);
  }
  void Leave(SessionNumber number, const Greeting& greeting, const VerificationKey& holder, PlayerNumber player) {
    Settle(number, holder);
    greeted_.erase(greeting);
    const auto from = from_.find(greeting.from.host);
    if (--from->second == 0) from_.erase(from);
    const auto of = of_.find(player);
    if (--of->second == 0) of_.erase(of);
  }

  std::optional<SessionNumber> GreetedAs(const Greeting& greeting) const { return In(greeted_, greeting); }
  std::optional<SessionNumber> UnsettledOf(const VerificationKey& holder) const { return In(unsettled_, holder); }
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
  absl::flat_hash_map<VerificationKey, SessionNumber> unsettled_;  // by the key of who holds it
  absl::flat_hash_map<std::uint32_t, std::size_t> from_;           // by host
  absl::flat_hash_map<PlayerNumber, std::size_t> of_;              // by player; PlayerNumber() counts those of regions
};

}  // namespace tessera::net

// Inside of Door. Not for others.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "net/door.h"
#include "net/guest_book.h"

namespace tessera::net {

// Requires a token that opened.
TokenId TokenIdOf(std::span<const std::uint8_t> token);

struct Door::Session {
  SessionNumber number;
  Address address;
  bool dialled = false;
  std::uint32_t peer = 0;  // how the other end calls it
  Nonce nonce{};           // the dialler's
  // Came in: when it ends unless it is settled. Dialled: when to say again what was said. Nothing: never.
  std::optional<TimePoint> due;    // by Door::SetDue alone
  std::vector<std::uint8_t> said;  // the handshake datagram that may have been lost
  std::optional<Channel> channel;

  // Came in.
  ConnectToken token;
  TokenId token_id{};
  bool heard = false;  // something sealed has come: the other end knows that it was accepted

  // Dialled, until it is open.
  RegionId region;
  std::optional<Incarnation> incarnation;  // from the challenge
  Credentials credentials;
  Duration retry = kFirstRetry;
  int tries = 0;
  std::optional<Refusal> refusal;

  Greeting greeting() const { return {address, nonce}; }
};

}  // namespace tessera::net

// Acceptor::Session: one session of an acceptor. Only the acceptor includes this.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "net/acceptor.h"
#include "net/session_budget.h"
#include "net/session_index.h"

namespace tessera::net {

struct Acceptor::Session {
  SessionNumber number;
  Address address;
  bool dialled = false;
  std::uint32_t peer = 0;  // the session's number at the other end
  Nonce nonce{};           // the dialler's
  // Accepted: when the session ends unless it is settled. Dialled: when the last datagram is sent again. Nothing:
  // never.
  std::optional<TimePoint> due;    // written by Acceptor::SetDue alone
  std::vector<std::uint8_t> sent;  // the handshake datagram that may have been lost
  std::optional<Channel> channel;

  // Fields of an accepted session.
  PeerIdentity who;
  VerificationKey holder{};      // the credential's
  bool heard = false;            // a sealed datagram has come, so the other end knows that it was accepted
  std::uint64_t credential = 0;  // its hash, for HeldOff
  SessionBudget budget;
  std::uint64_t received = 0;  // sealed datagrams, those beyond the budget too

  // Fields of a dialled session until it is open.
  RegionId region;
  Incarnation least;                       // an earlier life of the region is not dialled
  std::optional<Incarnation> incarnation;  // from the challenge
  Credentials credentials;
  std::optional<EphemeralKey> ephemeral;  // from the challenge on
  Duration retry = kFirstRetry;
  int tries = 0;
  std::optional<Refusal> refusal;

  Greeting greeting() const { return {address, nonce}; }
};

}  // namespace tessera::net

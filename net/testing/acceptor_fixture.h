// AcceptorTest: two acceptors without sockets: the test carries the datagrams, time is a number.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "net/acceptor.h"
#include "net/protocol.h"
#include "net/testing/test_identity.h"

namespace tessera::net {

using Bytes = std::vector<std::uint8_t>;
using Kind = Acceptor::Received::Kind;
using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr Address kServer{.host = 0x0100007f, .port = 7777}, kDialler{.host = 0x0200007f, .port = 5000};

class AcceptorTest : public testing::Test {
 protected:
  AcceptorTest() { server_.Open(Identity()); }
  EndpointIdentity Identity(std::uint64_t incarnation = 5) const {
    return TestWorker(key_, "plaza-1", RegionId(2), Incarnation(incarnation));
  }
  Credentials Player(std::uint32_t player = 7) const {
    return IssuePlayer("plaza-1", PlayerNumber(player), Generation(1), key_);
  }
  Acceptor::Received AtServer(Bytes& bytes, const Address& from = kDialler) {
    return server_.Receive(now_, from, bytes);
  }
  Acceptor::Received AtDialler(Bytes& bytes) { return dialler_.Receive(now_, kServer, bytes); }
  static Bytes Copy(const Acceptor::Received& received) { return {received.bytes.begin(), received.bytes.end()}; }

  // The datagrams of a dial, one after the other, up to the one named; each is what the other side is to get.
  Bytes HelloOf(const Credentials& credentials, RegionId region = RegionId(2)) {
    dial_ = *dialler_.Dial(now_, kServer, region, Incarnation(), credentials);
    auto due = dialler_.Due(now_);
    EXPECT_EQ(due.size(), 1u);
    return due.at(0).bytes;
  }
  Bytes LoginOf(const Credentials& credentials, RegionId region = RegionId(2), const Address& from = kDialler) {
    Bytes hello = HelloOf(credentials, region);
    Bytes challenge = Copy(AtServer(hello, from));
    return Copy(AtDialler(challenge));
  }
  // The server's number of the session, once both sides have it.
  SessionNumber Enter(const Credentials& credentials) {
    Bytes login = LoginOf(credentials);
    const Acceptor::Received answer = AtServer(login);
    EXPECT_EQ(answer.kind, Kind::kReply);
    Bytes accept = Copy(answer);
    EXPECT_EQ(AtDialler(accept).kind, Kind::kDialled);
    Bytes sealed = Sealed(dialler_, dial_, {1, 2, 3});
    const Acceptor::Received payload = AtServer(sealed);
    EXPECT_EQ(payload.kind, Kind::kPayload);
    EXPECT_EQ(Copy(payload), (Bytes{1, 2, 3}));
    return payload.session;
  }
  std::optional<Refusal> RefusalOf(const Credentials& credentials, RegionId region = RegionId(2)) {
    Bytes login = LoginOf(credentials, region);
    Bytes refusal = Copy(AtServer(login));
    EXPECT_LT(refusal.size(), login.size());
    if (AtDialler(refusal).kind != Kind::kRefused) return std::nullopt;
    const auto result = dialler_.RefusalOf(dial_);
    dialler_.Forget(dial_);
    return result;
  }
  static Bytes Sealed(Acceptor& from, SessionNumber session, const Bytes& payload,
                      DatagramKind kind = DatagramKind::kSealed) {
    Bytes datagram(kSealHeaderBytes + payload.size() + kSealTagBytes);
    std::copy(payload.begin(), payload.end(), datagram.begin() + kSealHeaderBytes);
    from.Seal(session, kind, datagram, payload.size());
    return datagram;
  }

  // Dials `server` from `dialler`; whether it came in.
  static bool ComesIn(Acceptor& dialler, Acceptor& server, Acceptor::TimePoint now, RegionId region, Incarnation least,
                      const Credentials& credentials) {
    const SessionNumber dial = *dialler.Dial(now, kServer, region, least, credentials);
    Bytes bytes = dialler.Due(now).at(0).bytes;
    for (Acceptor* at = &server; !bytes.empty(); at = at == &server ? &dialler : &server) {
      const Acceptor::Received received = at->Receive(now, at == &server ? kDialler : kServer, bytes);
      bytes = received.kind == Kind::kReply ? Copy(received) : Bytes();
    }
    return dialler.IsOpen(dial);
  }

  SigningKey key_ = SigningKey::Make();
  Acceptor::TimePoint now_{seconds(1000)};
  Acceptor server_{{.max_sessions = 8, .max_per_address = 4, .max_per_player = 3}}, dialler_{{.max_sessions = 64}};
  SessionNumber dial_;
};

}  // namespace tessera::net

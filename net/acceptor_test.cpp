// Acceptors without sockets: the test carries the datagrams, time is a number.
#include "net/acceptor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "net/protocol.h"

namespace tessera::net {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = Acceptor::Received::Kind;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kUnix_s = 1'700'000'000;
constexpr Address kServer{.host = 0x0100007f, .port = 7777}, kDialler{.host = 0x0200007f, .port = 5000};

class AcceptorTest : public testing::Test {
 protected:
  AcceptorTest() { server_.Open(Identity()); }
  EndpointIdentity Identity(std::uint64_t incarnation = 5) const {
    return {.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(incarnation), .key = key_};
  }
  Credentials Token(std::uint32_t player = 7) const {
    return Issue({.instance_id = "plaza-1", .player = PlayerNumber(player), .expires_unix_s = kUnix_s + 60}, key_);
  }
  Acceptor::Received AtServer(Bytes& bytes, const Address& from = kDialler) {
    return server_.Receive(now_, kUnix_s, from, bytes);
  }
  Acceptor::Received AtDialler(Bytes& bytes) { return dialler_.Receive(now_, kUnix_s, kServer, bytes); }
  static Bytes Copy(const Acceptor::Received& received) { return {received.bytes.begin(), received.bytes.end()}; }

  // The datagrams of a dial, one after the other, up to the one named; each is what the other side is to get.
  Bytes HelloOf(const Credentials& credentials, RegionId region = RegionId(2)) {
    dial_ = *dialler_.Dial(now_, kServer, region, credentials);
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

  InstanceKey key_ = MakeInstanceKey();
  Acceptor::TimePoint now_{seconds(1000)};
  Acceptor server_{{.max_sessions = 8, .max_per_address = 4, .max_per_player = 3}}, dialler_{{.max_sessions = 64}};
  SessionNumber dial_;
};

TEST_F(AcceptorTest, WhoHoldsATokenComesInAndIsKnown) {
  const SessionNumber session = Enter(Token(7));
  EXPECT_EQ(server_.TokenOf(session).player, PlayerNumber(7));
  EXPECT_EQ(server_.AddressOf(session), kDialler);
  Bytes down = Sealed(server_, session, {4, 5});
  const Acceptor::Received at_dialler = AtDialler(down);
  EXPECT_EQ(at_dialler.kind, Kind::kPayload);
  EXPECT_EQ(Copy(at_dialler), (Bytes{4, 5}));
}

TEST_F(AcceptorTest, NothingIsKeptOfOneThatHasNotProvenItself) {
  for (int i = 0; i < 1000; ++i) {
    Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = 1, .nonce = {static_cast<std::uint8_t>(i)}});
    EXPECT_EQ(AtServer(hello, {.host = static_cast<std::uint32_t>(i), .port = 9}).kind, Kind::kReply);
  }
  EXPECT_EQ(server_.sessions(), 0u);
  EXPECT_LT(server_.stats().bytes_to_unproven, server_.stats().bytes_from_unproven);
}

TEST_F(AcceptorTest, IsSilentUntilItIsOpened) {
  Acceptor closed({.max_sessions = 8});
  Bytes hello = HelloOf(Token());
  EXPECT_EQ(closed.Receive(now_, kUnix_s, kDialler, hello).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, RefusalsSayWhy) {
  EXPECT_EQ(
      RefusalOf(Issue({.instance_id = "plaza-1", .player = PlayerNumber(1), .expires_unix_s = kUnix_s}, key_))->reason,
      Refused::kExpired);
  const auto elsewhere =
      RefusalOf(Issue({.instance_id = "plaza-9", .player = PlayerNumber(1), .expires_unix_s = kUnix_s + 9}, key_));
  EXPECT_EQ(elsewhere->reason, Refused::kWrongInstance);
  EXPECT_EQ(elsewhere->detail, "connect token is for instance plaza-9, this is plaza-1");
  const auto region = RefusalOf(Token(), RegionId(3));
  EXPECT_EQ(region->reason, Refused::kWrongRegion);
  EXPECT_EQ(region->detail, "this is region 2, not 3");
  Credentials stolen = Token();
  stolen.key = MakeInstanceKey();
  EXPECT_EQ(RefusalOf(stolen)->reason, Refused::kBadToken);
  Credentials forged = Token();
  forged.token.back() ^= 1;
  EXPECT_EQ(RefusalOf(forged)->reason, Refused::kBadToken);
  EXPECT_EQ(RefusalOf({})->reason, Refused::kBadToken);
  server_.Close("the instance ends");
  EXPECT_EQ(RefusalOf(Token())->reason, Refused::kStopping);
  EXPECT_EQ(server_.sessions(), 0u);
}

TEST_F(AcceptorTest, AnotherProtocolIsToldBoth) {
  Bytes hello = Write(Hello{.protocol = 999, .session = 1, .nonce = {}});
  const auto refusal = ReadRefusal(Copy(AtServer(hello)));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kProtocol);
  EXPECT_NE(refusal->detail.find("999"), std::string::npos);
}

TEST_F(AcceptorTest, OnePlayerDoesNotTakeAllPlaces) {
  for (int i = 0; i < 3; ++i) server_.Settle(Enter(Token(7)));
  const auto refusal = RefusalOf(Token(7));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 3 places of one player are taken");
  server_.Forget(Enter(Token(8)));
  EXPECT_EQ(server_.sessions(), 3u);
}

TEST_F(AcceptorTest, OneAddressHasItsShareOfPlacesAndAllHaveAnEnd) {
  for (std::uint32_t player = 1; player <= 4; ++player) Enter(Token(player));
  const auto refusal = RefusalOf(Token(5));
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 4 places of one address are taken");
  for (std::uint32_t player = 5; player <= 8; ++player) {
    const Address other{.host = kDialler.host + player, .port = 1};
    Bytes login = LoginOf(Token(player), RegionId(2), other);
    Bytes accept = Copy(AtServer(login, other));
    EXPECT_TRUE(ReadAccept(accept).has_value());
  }
  const Address other{.host = 1, .port = 1};
  Bytes login = LoginOf(Token(9), RegionId(2), other);
  const auto full = ReadRefusal(Copy(AtServer(login, other)));
  ASSERT_TRUE(full.has_value());
  EXPECT_EQ(full->detail, "all 8 places are taken");
}

TEST_F(AcceptorTest, ASessionThatNobodyUsesEnds) {
  const SessionNumber idle = Enter(Token(1)), used = Enter(Token(2));
  server_.Settle(used);
  now_ += Acceptor::kUnsettled;
  server_.Due(now_);
  EXPECT_FALSE(server_.Has(idle));
  EXPECT_TRUE(server_.Has(used));
}

// Otherwise one token could take all sessions.
TEST_F(AcceptorTest, ATokenHasOneUnusedSessionAtATime) {
  const Credentials credentials = Token();
  for (int i = 0; i < 20; ++i) Enter(credentials);
  EXPECT_EQ(server_.sessions(), 1u);
}

TEST_F(AcceptorTest, ALoginFromAnotherAddressIsNotHeard) {
  Bytes login = LoginOf(Token());
  EXPECT_EQ(AtServer(login, {.host = kDialler.host, .port = 5001}).kind, Kind::kNothing);
  EXPECT_EQ(server_.stats().stale, 1u);
}

TEST_F(AcceptorTest, ALoginIsNotHeardWhenItsCookieIsOld) {
  Bytes login = LoginOf(Token());
  now_ += seconds(2 * CookieJar::kPeriod_s);
  EXPECT_EQ(AtServer(login).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, ALoginSaidAgainIsAnsweredAgainUntilTheAnswerIsKnown) {
  const Bytes login = LoginOf(Token());
  Bytes first = login, second = login;
  Bytes accept = Copy(AtServer(first));
  EXPECT_EQ(Copy(AtServer(second)), accept);
  EXPECT_EQ(server_.sessions(), 1u);
  EXPECT_EQ(AtDialler(accept).kind, Kind::kDialled);
  Bytes sealed = Sealed(dialler_, dial_, {1});
  EXPECT_EQ(AtServer(sealed).kind, Kind::kPayload);
  Bytes third = login;
  EXPECT_EQ(AtServer(third).kind, Kind::kNothing);
  EXPECT_EQ(server_.sessions(), 1u);
}

TEST_F(AcceptorTest, AReplayedLoginGetsOtherKeys) {
  const Bytes login = LoginOf(Token());
  Bytes first = login, again = login;
  const auto accept = ReadAccept(Copy(AtServer(first)));
  server_.Forget(SessionNumber(accept->peer));
  const auto other = ReadAccept(Copy(AtServer(again)));
  ASSERT_TRUE(other.has_value());
  EXPECT_NE(accept->nonce, other->nonce);
}

TEST_F(AcceptorTest, LoginsOfOneAddressAreLimited) {
  Acceptor acceptor({.max_sessions = 8, .logins_per_s = 10, .login_burst = 5});
  acceptor.Open(Identity());
  Credentials bad = Token();
  bad.key = MakeInstanceKey();
  const auto try_once = [&] {
    Bytes hello = HelloOf(bad);
    Bytes challenge = Copy(acceptor.Receive(now_, kUnix_s, kDialler, hello));
    Bytes login = Copy(AtDialler(challenge));
    dialler_.Forget(dial_);
    return acceptor.Receive(now_, kUnix_s, kDialler, login).kind == Kind::kReply;
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
  now_ += milliseconds(101);
  EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
}

TEST_F(AcceptorTest, ADialGoesOnAtTheNextLifeOfTheRegion) {
  Bytes hello = HelloOf(Token());
  Bytes challenge = Copy(AtServer(hello));
  AtDialler(challenge);  // the login is lost, and the region dies
  Acceptor next({.max_sessions = 8});
  next.Open(Identity(6));
  bool in = false;
  for (int i = 0; i < 100 && !in; ++i) {
    now_ += milliseconds(100);
    for (Acceptor::Outgoing& out : dialler_.Due(now_)) {
      Bytes bytes = std::move(out.bytes);
      for (Acceptor* at = &next; !bytes.empty(); at = at == &next ? &dialler_ : &next) {
        const Acceptor::Received received = at->Receive(now_, kUnix_s, at == &next ? kDialler : kServer, bytes);
        in = in || received.kind == Kind::kDialled;
        bytes = received.kind == Kind::kReply ? Copy(received) : Bytes();
      }
    }
  }
  EXPECT_TRUE(in);
}

TEST_F(AcceptorTest, ARefusalByOneThatDidNotSeeTheHelloIsNotHeard) {
  HelloOf(Token());
  Bytes refusal = Write(Refusal{.reason = Refused::kFull, .session = dial_.value(), .nonce = {}, .detail = ""}, 100);
  EXPECT_EQ(AtDialler(refusal).kind, Kind::kNothing);
  EXPECT_FALSE(dialler_.RefusalOf(dial_).has_value());
}

TEST_F(AcceptorTest, AnAcceptWithoutTheKeyIsNotHeard) {
  LoginOf(Token());
  Bytes accept = Write(Accept{.session = dial_.value(), .peer = 4096, .nonce = {}}, MakeInstanceKey());
  EXPECT_EQ(AtDialler(accept).kind, Kind::kNothing);
  EXPECT_FALSE(dialler_.IsOpen(dial_));
}

TEST_F(AcceptorTest, SealedDatagramsOfAnotherAddressAreNotHeard) {
  Enter(Token());
  Bytes sealed = Sealed(dialler_, dial_, {1});
  EXPECT_EQ(AtServer(sealed, {.host = 9, .port = 9}).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, WhatIsInsideIsPartOfTheSeal) {
  const SessionNumber session = Enter(Token());
  Bytes direct = Sealed(dialler_, dial_, {1, 2}, DatagramKind::kDirect);
  Bytes other = direct;
  other[0] = static_cast<std::uint8_t>(DatagramKind::kSealed);
  EXPECT_EQ(AtServer(other).kind, Kind::kNothing);
  const Acceptor::Received received = AtServer(direct);
  EXPECT_EQ(received.kind, Kind::kDirect);
  EXPECT_EQ(received.session, session);
  EXPECT_EQ(Copy(received), (Bytes{1, 2}));
}

// A session that ends, in whatever way, no longer counts for its address or its token.
TEST_F(AcceptorTest, PlacesComeBackAfterAnyComingAndGoing) {
  struct Accepted {
    SessionNumber number;
    std::size_t credentials;
    Acceptor::TimePoint ends;
  };
  std::mt19937_64 random(5);
  const std::vector<Credentials> all_credentials = {Token(1), Token(2), Token(3), Token(4), Token(5), Token(6)};
  std::vector<Accepted> inside;  // the expected sessions
  const auto never = Acceptor::TimePoint::max();
  for (int i = 0; i < 3000; ++i) {
    now_ += milliseconds(random() % 900);
    server_.Due(now_);
    std::erase_if(inside, [&](const Accepted& g) { return g.ends <= now_; });
    if (!inside.empty() && random() % 3 == 0) {
      Accepted& one = inside[random() % inside.size()];
      one.ends = never;
      server_.Settle(one.number);
    }
    if (!inside.empty() && random() % 4 == 0) {
      const auto one = inside.begin() + static_cast<std::ptrdiff_t>(random() % inside.size());
      server_.Forget(one->number);
      inside.erase(one);
    }
    const std::size_t credentials = random() % all_credentials.size();
    Bytes login = LoginOf(all_credentials[credentials]);
    std::erase_if(inside, [&](const Accepted& g) { return g.credentials == credentials && g.ends != never; });
    const auto accept = ReadAccept(Copy(AtServer(login)));
    ASSERT_EQ(accept.has_value(), inside.size() < 4) << i;
    if (accept) inside.push_back({SessionNumber(accept->peer), credentials, now_ + Acceptor::kUnsettled});
    ASSERT_EQ(server_.sessions(), inside.size()) << i;
    ASSERT_EQ(server_.next_due().has_value(),
              std::any_of(inside.begin(), inside.end(), [&](const Accepted& g) { return g.ends != never; }));
    dialler_.Forget(dial_);
  }
}

// Damaged, repeated and made-up datagrams are never taken.
TEST_F(AcceptorTest, NothingForgedIsTaken) {
  Enter(Token());
  const SessionNumber entered = dial_;
  const Bytes login = LoginOf(Token(8));
  std::mt19937_64 random(3);
  const std::uint64_t before = server_.stats().payloads, accepted = server_.stats().accepted;
  for (int i = 0; i < 100'000; ++i) {
    Bytes bytes;
    switch (random() % 4) {
      case 0:
        bytes.resize(random() % 1300);
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
        if (!bytes.empty()) bytes[0] = static_cast<std::uint8_t>(0xd0 + random() % 8);
        break;
      case 1:
        bytes = login;
        break;
      default:
        bytes = Sealed(dialler_, entered, {1, 2, 3, 4});
        break;
    }
    if (!bytes.empty() && random() % 3 != 0) bytes.resize(random() % bytes.size());
    if (!bytes.empty()) bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    AtServer(bytes);
  }
  EXPECT_EQ(server_.stats().payloads, before);
  EXPECT_EQ(server_.stats().accepted, accepted);
  EXPECT_EQ(server_.sessions(), 1u);
}

TEST_F(AcceptorTest, NumbersOfSessionsDoNotComeBackSoon) {
  Acceptor acceptor({.max_sessions = 1});
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 4000; ++i) {
    const SessionNumber number = *acceptor.Dial(now_, kServer, RegionId(1), {});
    EXPECT_TRUE(seen.insert(number.value()).second);
    EXPECT_LE(number.value(), kMaxSessionNumber);
    acceptor.Forget(number);
    EXPECT_FALSE(acceptor.Has(number));
  }
}

}  // namespace
}  // namespace tessera::net

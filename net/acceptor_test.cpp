#include "net/acceptor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "net/testing/acceptor_fixture.h"

namespace tessera::net {
namespace {

TEST_F(AcceptorTest, WhoHoldsACredentialComesInAndIsKnown) {
  const SessionNumber session = Enter(Player(7));
  EXPECT_EQ(server_.WhoIs(session), (PeerIdentity{.player = PlayerNumber(7), .generation = Generation(1)}));
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
  Bytes hello = HelloOf(Player());
  EXPECT_EQ(closed.Receive(now_, kDialler, hello).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, RefusalsSayWhy) {
  const auto elsewhere = RefusalOf(IssuePlayer("plaza-9", PlayerNumber(1), Generation(1), key_));
  EXPECT_EQ(elsewhere->reason, Refused::kWrongInstance);
  EXPECT_EQ(elsewhere->detail, "the player credential is for instance plaza-9, this is plaza-1");
  const auto region = RefusalOf(Player(), RegionId(3));
  EXPECT_EQ(region->reason, Refused::kWrongRegion);
  EXPECT_EQ(region->detail, "this is region 2, not 3");
  Credentials stolen = Player();  // from the wire: without the key that goes with it
  stolen.key = SigningKey::Make();
  EXPECT_EQ(RefusalOf(stolen)->reason, Refused::kBadCredential);
  Credentials forged = Player();
  forged.statement.back() ^= 1;
  EXPECT_EQ(RefusalOf(forged)->reason, Refused::kBadCredential);
  EXPECT_EQ(RefusalOf({})->reason, Refused::kBadCredential);
  server_.Close("the instance ends");
  EXPECT_EQ(RefusalOf(Player())->reason, Refused::kStopping);
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
  for (int i = 0; i < 3; ++i) server_.Settle(Enter(Player(7)));
  const auto refusal = RefusalOf(Player(7));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 3 places of one player are taken");
  server_.Forget(Enter(Player(8)));
  EXPECT_EQ(server_.sessions(), 3u);
}

TEST_F(AcceptorTest, OneAddressHasItsShareOfPlacesAndAllHaveAnEnd) {
  for (std::uint32_t player = 1; player <= 4; ++player) Enter(Player(player));
  const auto refusal = RefusalOf(Player(5));
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 4 places of one address are taken");
  for (std::uint32_t player = 5; player <= 8; ++player) {
    const Address other{.host = kDialler.host + player, .port = 1};
    Bytes login = LoginOf(Player(player), RegionId(2), other);
    Bytes accept = Copy(AtServer(login, other));
    EXPECT_TRUE(ReadAccept(accept).has_value());
  }
  const Address other{.host = 1, .port = 1};
  Bytes login = LoginOf(Player(9), RegionId(2), other);
  const auto full = ReadRefusal(Copy(AtServer(login, other)));
  ASSERT_TRUE(full.has_value());
  EXPECT_EQ(full->detail, "all 8 places are taken");
}

TEST_F(AcceptorTest, ASessionThatNobodyUsesEnds) {
  const SessionNumber idle = Enter(Player(1)), used = Enter(Player(2));
  server_.Settle(used);
  now_ += Acceptor::kUnsettled;
  server_.Due(now_);
  EXPECT_FALSE(server_.Has(idle));
  EXPECT_TRUE(server_.Has(used));
}

// Otherwise one credential could take all sessions.
TEST_F(AcceptorTest, ACredentialHasOneUnusedSessionAtATime) {
  const Credentials credentials = Player();
  for (int i = 0; i < 20; ++i) Enter(credentials);
  EXPECT_EQ(server_.sessions(), 1u);
}

TEST_F(AcceptorTest, ALoginFromAnotherAddressIsNotHeard) {
  Bytes login = LoginOf(Player());
  EXPECT_EQ(AtServer(login, {.host = kDialler.host, .port = 5001}).kind, Kind::kNothing);
  EXPECT_EQ(server_.stats().stale, 1u);
}

TEST_F(AcceptorTest, ALoginIsNotHeardWhenItsCookieIsOld) {
  Bytes login = LoginOf(Player());
  now_ += seconds(2 * CookieJar::kPeriod_s);
  EXPECT_EQ(AtServer(login).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, ALoginSaidAgainIsAnsweredAgainUntilTheAnswerIsKnown) {
  const Bytes login = LoginOf(Player());
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

// A peer that replays it cannot use them without the ephemeral key.
TEST_F(AcceptorTest, AReplayedLoginGetsOtherKeys) {
  const Bytes login = LoginOf(Player());
  Bytes first = login, again = login;
  const auto accept = ReadAccept(Copy(AtServer(first)));
  server_.Forget(SessionNumber(accept->peer));
  const Bytes second = Copy(AtServer(again));
  const auto other = ReadAccept(second);
  ASSERT_TRUE(other.has_value());
  EXPECT_NE(accept->ephemeral, other->ephemeral);
}

TEST_F(AcceptorTest, LoginsOfOneAddressAreLimited) {
  Acceptor acceptor({.max_sessions = 8, .logins_of_an_address = {.per_s = 10, .burst = 5}});
  acceptor.Open(Identity());
  Credentials bad = Player();
  bad.key = SigningKey::Make();
  const auto try_once = [&] {
    Bytes hello = HelloOf(bad);
    Bytes challenge = Copy(acceptor.Receive(now_, kDialler, hello));
    Bytes login = Copy(AtDialler(challenge));
    dialler_.Forget(dial_);
    return acceptor.Receive(now_, kDialler, login).kind == Kind::kReply;
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
  now_ += milliseconds(101);
  EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
}

TEST_F(AcceptorTest, HellosOfOneAddressAndOfAllAreLimited) {
  Acceptor acceptor({.max_sessions = 8,
                     .hellos = {.per_s = 100, .burst = 50},
                     .strangers_hellos = {.per_s = 30, .burst = 8},
                     .hellos_of_an_address = {.per_s = 10, .burst = 5}});
  acceptor.Open(Identity());
  const Nonce ours = MakeNonce(KnockOf(key_.verification_key()));
  const auto answered = [&](std::uint32_t first, std::uint32_t addresses, int each, const Nonce& nonce) {
    int replies = 0;
    for (std::uint32_t host = first; host < first + addresses; ++host) {
      for (int i = 0; i < each; ++i) {
        Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = 1, .nonce = nonce});
        replies += acceptor.Receive(now_, {.host = host, .port = 9}, hello).kind == Kind::kReply ? 1 : 0;
      }
    }
    return replies;
  };
  // Strangers are answered by a share of their own, and where that is used up they take nothing of any address's.
  EXPECT_EQ(answered(1, 1, 5, {}), 5);
  EXPECT_EQ(answered(2, 1, 20, {}), 3);
  EXPECT_EQ(answered(2, 1, 20, ours), 2);
  EXPECT_EQ(acceptor.unproven().strangers, 25u);
  EXPECT_EQ(answered(3, 1, 20, ours), 5);
  EXPECT_EQ(answered(1'000'000, 1000, 1, ours), 43);  // in all
  EXPECT_EQ(acceptor.stats().hellos, 58u);
  EXPECT_EQ(acceptor.stats().hellos_limited, 1007u);
  EXPECT_EQ(acceptor.unproven().hellos, 1040u);
  now_ += milliseconds(100);
  EXPECT_EQ(answered(2'000'000, 1000, 1, ours), 10);
  EXPECT_EQ(answered(3'000'000, 1000, 1, {}), 3);
}

TEST_F(AcceptorTest, AHelloWithoutAnswerIsSaidSeveralTimesAndALoginOnce) {
  Bytes hello = HelloOf(Player());
  std::vector<std::size_t> copies;
  for (int i = 0; i < 5; ++i) {
    now_ = *dialler_.next_due();
    copies.push_back(dialler_.Due(now_).size());
  }
  EXPECT_EQ(copies, (std::vector<std::size_t>{2, 4, 8, 8, 8}));
  Bytes challenge = Copy(AtServer(hello));
  ASSERT_EQ(AtDialler(challenge).kind, Kind::kReply);
  now_ = *dialler_.next_due();
  EXPECT_EQ(dialler_.Due(now_).size(), 1u);
}

TEST_F(AcceptorTest, ADialGoesOnAtTheNextLifeOfTheRegion) {
  Bytes hello = HelloOf(Player());
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
        const Acceptor::Received received = at->Receive(now_, at == &next ? kDialler : kServer, bytes);
        in = in || received.kind == Kind::kDialled;
        bytes = received.kind == Kind::kReply ? Copy(received) : Bytes();
      }
    }
  }
  EXPECT_TRUE(in);
}

TEST_F(AcceptorTest, ARefusalByOneThatDidNotSeeTheHelloIsNotHeard) {
  HelloOf(Player());
  Bytes refusal = Write(Refusal{.reason = Refused::kFull, .session = dial_.value(), .nonce = {}, .detail = ""}, 100);
  EXPECT_EQ(AtDialler(refusal).kind, Kind::kNothing);
  EXPECT_FALSE(dialler_.RefusalOf(dial_).has_value());
}

// --- Sealed datagrams.

TEST_F(AcceptorTest, SealedDatagramsOfAnotherAddressAreNotHeard) {
  Enter(Player());
  Bytes sealed = Sealed(dialler_, dial_, {1});
  EXPECT_EQ(AtServer(sealed, {.host = 9, .port = 9}).kind, Kind::kNothing);
}

TEST_F(AcceptorTest, WhatIsInsideIsPartOfTheSeal) {
  const SessionNumber session = Enter(Player());
  Bytes direct = Sealed(dialler_, dial_, {1, 2}, DatagramKind::kDirect);
  Bytes other = direct;
  other[0] = static_cast<std::uint8_t>(DatagramKind::kSealed);
  EXPECT_EQ(AtServer(other).kind, Kind::kNothing);
  const Acceptor::Received received = AtServer(direct);
  EXPECT_EQ(received.kind, Kind::kDirect);
  EXPECT_EQ(received.session, session);
  EXPECT_EQ(Copy(received), (Bytes{1, 2}));
}

// A session that ends, in whatever way, no longer counts for its address or its credential.
TEST_F(AcceptorTest, PlacesComeBackAfterAnyComingAndGoing) {
  struct Accepted {
    SessionNumber number;
    std::size_t credentials;
    Acceptor::TimePoint ends;
  };
  std::mt19937_64 random(5);
  const std::vector<Credentials> all_credentials = {Player(1), Player(2), Player(3), Player(4), Player(5), Player(6)};
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
  Enter(Player());
  const SessionNumber entered = dial_;
  const Bytes login = LoginOf(Player(8));
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
    const SessionNumber number = *acceptor.Dial(now_, kServer, RegionId(1), Incarnation(), {});
    EXPECT_TRUE(seen.insert(number.value()).second);
    EXPECT_LE(number.value(), kMaxSessionNumber);
    acceptor.Forget(number);
    EXPECT_FALSE(acceptor.Has(number));
  }
}

}  // namespace
}  // namespace tessera::net

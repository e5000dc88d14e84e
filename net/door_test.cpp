// Doors without sockets: datagrams are carried by hand, time is a number.
#include "net/door.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "net/protocol.h"

namespace tessera::net {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = Door::Received::Kind;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kUnix_s = 1'700'000'000;
constexpr Address kHouse{.host = 0x0100007f, .port = 7777}, kGuest{.host = 0x0200007f, .port = 5000};

class DoorTest : public testing::Test {
 protected:
  DoorTest() { house_.Open(Plate()); }
  Doorplate Plate(std::uint64_t incarnation = 5) const {
    return {.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(incarnation), .key = key_};
  }
  Credentials Pass(std::uint32_t player = 7) const {
    return Issue({.instance_id = "plaza-1", .player = PlayerNumber(player), .expires_unix_s = kUnix_s + 60}, key_);
  }
  Door::Received AtHouse(Bytes& bytes, const Address& from = kGuest) {
    return house_.Receive(now_, kUnix_s, from, bytes);
  }
  Door::Received AtGuest(Bytes& bytes) { return guest_.Receive(now_, kUnix_s, kHouse, bytes); }
  static Bytes Copy(const Door::Received& received) { return {received.bytes.begin(), received.bytes.end()}; }

  // The datagrams of a dial, one after the other, up to the one named; each is what the other side is to get.
  Bytes HelloOf(const Credentials& pass, RegionId region = RegionId(2)) {
    dial_ = *guest_.Dial(now_, kHouse, region, pass);
    auto due = guest_.Due(now_);
    EXPECT_EQ(due.size(), 1u);
    return due.at(0).bytes;
  }
  Bytes LoginOf(const Credentials& pass, RegionId region = RegionId(2), const Address& from = kGuest) {
    Bytes hello = HelloOf(pass, region);
    Bytes challenge = Copy(AtHouse(hello, from));
    return Copy(AtGuest(challenge));
  }
  // The house's number of the session, once both sides have it.
  SessionNumber Enter(const Credentials& pass) {
    Bytes login = LoginOf(pass);
    const Door::Received answer = AtHouse(login);
    EXPECT_EQ(answer.kind, Kind::kReply);
    Bytes accept = Copy(answer);
    EXPECT_EQ(AtGuest(accept).kind, Kind::kDialled);
    Bytes sealed = Sealed(guest_, dial_, {1, 2, 3});
    const Door::Received payload = AtHouse(sealed);
    EXPECT_EQ(payload.kind, Kind::kPayload);
    EXPECT_EQ(Copy(payload), (Bytes{1, 2, 3}));
    return payload.session;
  }
  std::optional<Refusal> RefusalOf(const Credentials& pass, RegionId region = RegionId(2)) {
    Bytes login = LoginOf(pass, region);
    Bytes refusal = Copy(AtHouse(login));
    EXPECT_LT(refusal.size(), login.size());
    if (AtGuest(refusal).kind != Kind::kRefused) return std::nullopt;
    const auto result = guest_.RefusalOf(dial_);
    guest_.Forget(dial_);
    return result;
  }
  static Bytes Sealed(Door& from, SessionNumber session, const Bytes& payload,
                      DatagramKind kind = DatagramKind::kSealed) {
    Bytes datagram(kSealHeaderBytes + payload.size() + kSealTagBytes);
    std::copy(payload.begin(), payload.end(), datagram.begin() + kSealHeaderBytes);
    from.Seal(session, kind, datagram, payload.size());
    return datagram;
  }

  InstanceKey key_ = MakeInstanceKey();
  Door::TimePoint now_{seconds(1000)};
  Door house_{{.max_sessions = 8, .max_per_address = 4, .max_per_player = 3}}, guest_{{.max_sessions = 64}};
  SessionNumber dial_;
};

TEST_F(DoorTest, WhoHoldsATokenComesInAndIsKnown) {
  const SessionNumber session = Enter(Pass(7));
  EXPECT_EQ(house_.TokenOf(session).player, PlayerNumber(7));
  EXPECT_EQ(house_.AddressOf(session), kGuest);
  Bytes down = Sealed(house_, session, {4, 5});
  const Door::Received at_guest = AtGuest(down);
  EXPECT_EQ(at_guest.kind, Kind::kPayload);
  EXPECT_EQ(Copy(at_guest), (Bytes{4, 5}));
}

TEST_F(DoorTest, NothingIsKeptOfOneThatHasNotProvenItself) {
  for (int i = 0; i < 1000; ++i) {
    Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = 1, .nonce = {static_cast<std::uint8_t>(i)}});
    EXPECT_EQ(AtHouse(hello, {.host = static_cast<std::uint32_t>(i), .port = 9}).kind, Kind::kReply);
  }
  EXPECT_EQ(house_.sessions(), 0u);
  EXPECT_LT(house_.stats().bytes_to_strangers, house_.stats().bytes_from_strangers);
}

TEST_F(DoorTest, IsSilentUntilItIsOpened) {
  Door closed({.max_sessions = 8});
  Bytes hello = HelloOf(Pass());
  EXPECT_EQ(closed.Receive(now_, kUnix_s, kGuest, hello).kind, Kind::kNothing);
}

TEST_F(DoorTest, RefusalsSayWhy) {
  EXPECT_EQ(
      RefusalOf(Issue({.instance_id = "plaza-1", .player = PlayerNumber(1), .expires_unix_s = kUnix_s}, key_))->reason,
      Refused::kExpired);
  const auto elsewhere =
      RefusalOf(Issue({.instance_id = "plaza-9", .player = PlayerNumber(1), .expires_unix_s = kUnix_s + 9}, key_));
  EXPECT_EQ(elsewhere->reason, Refused::kWrongInstance);
  EXPECT_EQ(elsewhere->detail, "connect token is for instance plaza-9, this is plaza-1");
  const auto region = RefusalOf(Pass(), RegionId(3));
  EXPECT_EQ(region->reason, Refused::kWrongRegion);
  EXPECT_EQ(region->detail, "this is region 2, not 3");
  Credentials stolen = Pass();
  stolen.key = MakeInstanceKey();
  EXPECT_EQ(RefusalOf(stolen)->reason, Refused::kBadToken);
  Credentials forged = Pass();
  forged.token.back() ^= 1;
  EXPECT_EQ(RefusalOf(forged)->reason, Refused::kBadToken);
  EXPECT_EQ(RefusalOf({})->reason, Refused::kBadToken);
  house_.Close("the instance ends");
  EXPECT_EQ(RefusalOf(Pass())->reason, Refused::kStopping);
  EXPECT_EQ(house_.sessions(), 0u);
}

TEST_F(DoorTest, AnotherProtocolIsToldBoth) {
  Bytes hello = Write(Hello{.protocol = 999, .session = 1, .nonce = {}});
  const auto refusal = ReadRefusal(Copy(AtHouse(hello)));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kProtocol);
  EXPECT_NE(refusal->detail.find("999"), std::string::npos);
}

TEST_F(DoorTest, OnePlayerDoesNotTakeAllPlaces) {
  for (int i = 0; i < 3; ++i) house_.Settle(Enter(Pass(7)));
  const auto refusal = RefusalOf(Pass(7));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 3 places of one player are taken");
  house_.Forget(Enter(Pass(8)));
  EXPECT_EQ(house_.sessions(), 3u);
}

TEST_F(DoorTest, OneAddressHasItsShareOfPlacesAndAllHaveAnEnd) {
  for (std::uint32_t player = 1; player <= 4; ++player) Enter(Pass(player));
  const auto refusal = RefusalOf(Pass(5));
  EXPECT_EQ(refusal->reason, Refused::kFull);
  EXPECT_EQ(refusal->detail, "all 4 places of one address are taken");
  for (std::uint32_t player = 5; player <= 8; ++player) {
    const Address other{.host = kGuest.host + player, .port = 1};
    Bytes login = LoginOf(Pass(player), RegionId(2), other);
    Bytes accept = Copy(AtHouse(login, other));
    EXPECT_TRUE(ReadAccept(accept).has_value());
  }
  const Address other{.host = 1, .port = 1};
  Bytes login = LoginOf(Pass(9), RegionId(2), other);
  const auto full = ReadRefusal(Copy(AtHouse(login, other)));
  ASSERT_TRUE(full.has_value());
  EXPECT_EQ(full->detail, "all 8 places are taken");
}

TEST_F(DoorTest, ASessionThatNobodyUsesEnds) {
  const SessionNumber idle = Enter(Pass(1)), used = Enter(Pass(2));
  house_.Settle(used);
  now_ += Door::kUnsettled;
  house_.Due(now_);
  EXPECT_FALSE(house_.Has(idle));
  EXPECT_TRUE(house_.Has(used));
}

// Otherwise one token could take every place.
TEST_F(DoorTest, ATokenHasOneUnusedSessionAtATime) {
  const Credentials pass = Pass();
  for (int i = 0; i < 20; ++i) Enter(pass);
  EXPECT_EQ(house_.sessions(), 1u);
}

TEST_F(DoorTest, ALoginFromAnotherAddressIsNotHeard) {
  Bytes login = LoginOf(Pass());
  EXPECT_EQ(AtHouse(login, {.host = kGuest.host, .port = 5001}).kind, Kind::kNothing);
  EXPECT_EQ(house_.stats().stale, 1u);
}

TEST_F(DoorTest, ALoginIsNotHeardWhenItsCookieIsOld) {
  Bytes login = LoginOf(Pass());
  now_ += seconds(2 * CookieJar::kPeriod_s);
  EXPECT_EQ(AtHouse(login).kind, Kind::kNothing);
}

TEST_F(DoorTest, ALoginSaidAgainIsAnsweredAgainUntilTheAnswerIsKnown) {
  const Bytes login = LoginOf(Pass());
  Bytes first = login, second = login;
  Bytes accept = Copy(AtHouse(first));
  EXPECT_EQ(Copy(AtHouse(second)), accept);
  EXPECT_EQ(house_.sessions(), 1u);
  EXPECT_EQ(AtGuest(accept).kind, Kind::kDialled);
  Bytes sealed = Sealed(guest_, dial_, {1});
  EXPECT_EQ(AtHouse(sealed).kind, Kind::kPayload);
  Bytes third = login;
  EXPECT_EQ(AtHouse(third).kind, Kind::kNothing);
  EXPECT_EQ(house_.sessions(), 1u);
}

TEST_F(DoorTest, AReplayedLoginGetsOtherKeys) {
  const Bytes login = LoginOf(Pass());
  Bytes first = login, again = login;
  const auto accept = ReadAccept(Copy(AtHouse(first)));
  house_.Forget(SessionNumber(accept->peer));
  const auto other = ReadAccept(Copy(AtHouse(again)));
  ASSERT_TRUE(other.has_value());
  EXPECT_NE(accept->nonce, other->nonce);
}

TEST_F(DoorTest, LoginsOfOneAddressAreLimited) {
  Door house({.max_sessions = 8, .logins_per_s = 10, .login_burst = 5});
  house.Open(Plate());
  Credentials bad = Pass();
  bad.key = MakeInstanceKey();
  const auto try_once = [&] {
    Bytes hello = HelloOf(bad);
    Bytes challenge = Copy(house.Receive(now_, kUnix_s, kGuest, hello));
    Bytes login = Copy(AtGuest(challenge));
    guest_.Forget(dial_);
    return house.Receive(now_, kUnix_s, kGuest, login).kind == Kind::kReply;
  };
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
  now_ += milliseconds(101);
  EXPECT_TRUE(try_once());
  EXPECT_FALSE(try_once());
}

TEST_F(DoorTest, ADialGoesOnAtTheNextLifeOfTheRegion) {
  Bytes hello = HelloOf(Pass());
  Bytes challenge = Copy(AtHouse(hello));
  AtGuest(challenge);  // the login is lost, and the region dies
  Door next({.max_sessions = 8});
  next.Open(Plate(6));
  bool in = false;
  for (int i = 0; i < 100 && !in; ++i) {
    now_ += milliseconds(100);
    for (Door::Outgoing& out : guest_.Due(now_)) {
      Bytes bytes = std::move(out.bytes);
      for (Door* at = &next; !bytes.empty(); at = at == &next ? &guest_ : &next) {
        const Door::Received received = at->Receive(now_, kUnix_s, at == &next ? kGuest : kHouse, bytes);
        in = in || received.kind == Kind::kDialled;
        bytes = received.kind == Kind::kReply ? Copy(received) : Bytes();
      }
    }
  }
  EXPECT_TRUE(in);
}

TEST_F(DoorTest, ARefusalByOneThatDidNotSeeTheHelloIsNotHeard) {
  HelloOf(Pass());
  Bytes refusal = Write(Refusal{.reason = Refused::kFull, .session = dial_.value(), .nonce = {}, .detail = ""}, 100);
  EXPECT_EQ(AtGuest(refusal).kind, Kind::kNothing);
  EXPECT_FALSE(guest_.RefusalOf(dial_).has_value());
}

TEST_F(DoorTest, AnAcceptWithoutTheKeyIsNotHeard) {
  LoginOf(Pass());
  Bytes accept = Write(Accept{.session = dial_.value(), .peer = 4096, .nonce = {}}, MakeInstanceKey());
  EXPECT_EQ(AtGuest(accept).kind, Kind::kNothing);
  EXPECT_FALSE(guest_.IsOpen(dial_));
}

TEST_F(DoorTest, SealedDatagramsOfAnotherAddressAreNotHeard) {
  Enter(Pass());
  Bytes sealed = Sealed(guest_, dial_, {1});
  EXPECT_EQ(AtHouse(sealed, {.host = 9, .port = 9}).kind, Kind::kNothing);
}

TEST_F(DoorTest, WhatIsInsideIsPartOfTheSeal) {
  const SessionNumber session = Enter(Pass());
  Bytes direct = Sealed(guest_, dial_, {1, 2}, DatagramKind::kDirect);
  Bytes other = direct;
  other[0] = static_cast<std::uint8_t>(DatagramKind::kSealed);
  EXPECT_EQ(AtHouse(other).kind, Kind::kNothing);
  const Door::Received received = AtHouse(direct);
  EXPECT_EQ(received.kind, Kind::kDirect);
  EXPECT_EQ(received.session, session);
  EXPECT_EQ(Copy(received), (Bytes{1, 2}));
}

// Whoever leaves, in whatever way, leaves nothing behind that counts for an address or a token.
TEST_F(DoorTest, PlacesComeBackAfterAnyComingAndGoing) {
  struct Guest {
    SessionNumber number;
    std::size_t pass;
    Door::TimePoint ends;
  };
  std::mt19937_64 random(5);
  const std::vector<Credentials> passes = {Pass(1), Pass(2), Pass(3), Pass(4), Pass(5), Pass(6)};
  std::vector<Guest> inside;  // as it should be
  const auto never = Door::TimePoint::max();
  for (int i = 0; i < 3000; ++i) {
    now_ += milliseconds(random() % 900);
    house_.Due(now_);
    std::erase_if(inside, [&](const Guest& g) { return g.ends <= now_; });
    if (!inside.empty() && random() % 3 == 0) {
      Guest& guest = inside[random() % inside.size()];
      guest.ends = never;
      house_.Settle(guest.number);
    }
    if (!inside.empty() && random() % 4 == 0) {
      const auto guest = inside.begin() + static_cast<std::ptrdiff_t>(random() % inside.size());
      house_.Forget(guest->number);
      inside.erase(guest);
    }
    const std::size_t pass = random() % passes.size();
    Bytes login = LoginOf(passes[pass]);
    std::erase_if(inside, [&](const Guest& g) { return g.pass == pass && g.ends != never; });
    const auto accept = ReadAccept(Copy(AtHouse(login)));
    ASSERT_EQ(accept.has_value(), inside.size() < 4) << i;
    if (accept) inside.push_back({SessionNumber(accept->peer), pass, now_ + Door::kUnsettled});
    ASSERT_EQ(house_.sessions(), inside.size()) << i;
    ASSERT_EQ(house_.next_due().has_value(),
              std::any_of(inside.begin(), inside.end(), [&](const Guest& g) { return g.ends != never; }));
    guest_.Forget(dial_);
  }
}

// What the wire may make of genuine datagrams, and what a stranger may make up: nothing of it is taken.
TEST_F(DoorTest, NothingForgedIsTaken) {
  Enter(Pass());
  const SessionNumber entered = dial_;
  const Bytes login = LoginOf(Pass(8));
  std::mt19937_64 random(3);
  const std::uint64_t before = house_.stats().payloads, accepted = house_.stats().accepted;
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
        bytes = Sealed(guest_, entered, {1, 2, 3, 4});
        break;
    }
    if (!bytes.empty() && random() % 3 != 0) bytes.resize(random() % bytes.size());
    if (!bytes.empty()) bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
    AtHouse(bytes);
  }
  EXPECT_EQ(house_.stats().payloads, before);
  EXPECT_EQ(house_.stats().accepted, accepted);
  EXPECT_EQ(house_.sessions(), 1u);
}

TEST_F(DoorTest, NumbersOfSessionsDoNotComeBackSoon) {
  Door house({.max_sessions = 1});
  std::set<std::uint32_t> seen;
  for (int i = 0; i < 4000; ++i) {
    const SessionNumber number = *house.Dial(now_, kHouse, RegionId(1), {});
    EXPECT_TRUE(seen.insert(number.value()).second);
    EXPECT_LE(number.value(), kMaxSessionNumber);
    house.Forget(number);
    EXPECT_FALSE(house.Has(number));
  }
}

}  // namespace
}  // namespace tessera::net

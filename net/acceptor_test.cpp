// Acceptors without sockets: the test carries the datagrams, time is a number.
#include "net/acceptor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "net/protocol.h"
#include "net/testing/test_identity.h"

namespace tessera::net {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = Acceptor::Received::Kind;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Address kServer{.host = 0x0100007f, .port = 7777}, kDialler{.host = 0x0200007f, .port = 5000};

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
  Acceptor acceptor(
      {.max_sessions = 8, .hellos = {.per_s = 100, .burst = 50}, .hellos_of_an_address = {.per_s = 10, .burst = 5}});
  acceptor.Open(Identity());
  const auto answered = [&](std::uint32_t first, std::uint32_t addresses, int each) {
    int replies = 0;
    for (std::uint32_t host = first; host < first + addresses; ++host) {
      for (int i = 0; i < each; ++i) {
        Bytes hello = Write(Hello{.protocol = kProtocolVersion, .session = 1, .nonce = {}});
        replies += acceptor.Receive(now_, {.host = host, .port = 9}, hello).kind == Kind::kReply ? 1 : 0;
      }
    }
    return replies;
  };
  EXPECT_EQ(answered(1, 1, 20), 5);
  EXPECT_EQ(answered(1'000'000, 1000, 1), 45);  // in all
  EXPECT_EQ(acceptor.stats().hellos, 50u);
  EXPECT_EQ(acceptor.stats().hellos_limited, 970u);
  EXPECT_EQ(acceptor.unproven().hellos, 1020u);
  now_ += milliseconds(100);
  EXPECT_EQ(answered(2'000'000, 1000, 1), 10);
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

// --- What a region proves to who dials it.

TEST_F(AcceptorTest, AnAcceptThatIsDamagedAnywhereIsNotHeard) {
  Bytes login = LoginOf(Player());
  const Bytes accept = Copy(AtServer(login));
  for (std::size_t byte = 0; byte < accept.size(); ++byte) {
    Bytes damaged = accept;
    damaged[byte] ^= 1;
    EXPECT_EQ(AtDialler(damaged).kind, Kind::kNothing) << byte;
    EXPECT_FALSE(dialler_.IsOpen(dial_)) << byte;
  }
  Bytes genuine = accept;
  EXPECT_EQ(AtDialler(genuine).kind, Kind::kDialled);
}

TEST_F(AcceptorTest, ALoginThatIsDamagedAnywhereMakesNoSession) {
  const Bytes login = LoginOf(Player());
  for (std::size_t byte = 0; byte < login.size(); ++byte) {
    Bytes damaged = login;
    damaged[byte] ^= 1;
    AtServer(damaged);
    now_ += milliseconds(4);  // within the share of an address, and the cookie's life
    EXPECT_EQ(server_.sessions(), 0u) << byte;
  }
  EXPECT_EQ(server_.stats().accepted, 0u);
}

// Whoever sits at an address of a region, be it one that was evicted, another instance's, or a player: it is not taken
// for the region.
TEST_F(AcceptorTest, NobodyElseIsTakenForTheRegionThatWasDialled) {
  const EndpointIdentity genuine = Identity();
  const EndpointIdentity other_region = TestWorker(key_, "plaza-1", RegionId(3), Incarnation(5));
  const EndpointIdentity other_life = TestWorker(key_, "plaza-1", RegionId(2), Incarnation(4));
  const EndpointIdentity other_instance = TestWorker(key_, "plaza-2", RegionId(2), Incarnation(5));
  const EndpointIdentity other_signer = TestWorker(SigningKey::Make(), "plaza-1", RegionId(2), Incarnation(5));
  struct Case {
    const char* what;
    std::vector<std::uint8_t> certificate;
    SigningKey key;
  };
  const Case cases[] = {
      {"another region's certificate and key", other_region.certificate, other_region.key},
      {"an earlier life's certificate and key", other_life.certificate, other_life.key},
      {"another instance's certificate and key", other_instance.certificate, other_instance.key},
      {"a certificate by another signer", other_signer.certificate, other_signer.key},
      {"the region's certificate without its key", genuine.certificate, other_region.key},
      {"a player's credential and key", Player().statement, Player().key},
      {"no certificate", {}, genuine.key},
  };
  for (const Case& impostor : cases) {
    Acceptor server({.max_sessions = 8});
    EndpointIdentity self = genuine;  // its Challenge, and all that it takes, is as the genuine one's
    self.certificate = impostor.certificate;
    self.key = impostor.key;
    server.Open(self);
    EXPECT_FALSE(ComesIn(dialler_, server, now_, RegionId(2), Incarnation(), Player())) << impostor.what;
  }
  Acceptor server({.max_sessions = 8});
  server.Open(genuine);
  EXPECT_TRUE(ComesIn(dialler_, server, now_, RegionId(2), Incarnation(), Player()));
}

TEST_F(AcceptorTest, AnEarlierLifeOfARegionIsNotDialled) {
  EXPECT_FALSE(ComesIn(dialler_, server_, now_, RegionId(2), Incarnation(6), Player()));
  EXPECT_TRUE(ComesIn(dialler_, server_, now_, RegionId(2), Incarnation(5), Player()));
  EXPECT_TRUE(ComesIn(dialler_, server_, now_, RegionId(2), Incarnation(4), Player(8)));
}

// The dialler's own datagram, with its form changed, is no answer to it; nor is what it said to another region.
TEST_F(AcceptorTest, AReflectedHandshakeIsNotHeard) {
  const EndpointIdentity two = TestWorker(key_, "plaza-1", RegionId(2), Incarnation(5), true);
  Acceptor one({.max_sessions = 8}), both({.max_sessions = 8});
  one.Open(TestWorker(key_, "plaza-1", RegionId(2), Incarnation(5), true));
  both.Open(two);
  // `both` dials `one`, and whoever sits between brings its Login back as an Accept.
  const SessionNumber dial = *both.Dial(now_, kServer, RegionId(2), Incarnation(), CredentialsOf(two));
  Bytes hello = both.Due(now_).at(0).bytes;
  Bytes challenge = Copy(one.Receive(now_, kDialler, hello));
  const Bytes login = Copy(both.Receive(now_, kServer, challenge));
  const Login said = *ReadLogin(login);
  Bytes mirrored = Write(
      Accept{
          .session = dial.value(), .peer = said.session, .ephemeral = said.ephemeral, .certificate = said.credential},
      login, SigningKey::Make());
  std::copy(login.end() - 64, login.end(), mirrored.end() - 64);  // with the signature that it has
  EXPECT_EQ(both.Receive(now_, kServer, mirrored).kind, Kind::kNothing);
  EXPECT_FALSE(both.IsOpen(dial));
  // Its Login comes back to itself: its cookies are its own.
  Bytes returned = login;
  EXPECT_EQ(both.Receive(now_, kServer, returned).kind, Kind::kNothing);
  EXPECT_EQ(both.sessions(), 1u);
}

TEST_F(AcceptorTest, AnAcceptOfAnotherHandshakeIsNotHeard) {
  Bytes first = LoginOf(Player());
  Bytes accept = Copy(AtServer(first));
  dialler_.Forget(dial_);
  LoginOf(Player());
  Bytes moved = accept;
  for (int i = 0; i < 4; ++i)
    moved[1 + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(dial_.value() >> (8 * i));
  EXPECT_EQ(AtDialler(moved).kind, Kind::kNothing);
  EXPECT_FALSE(dialler_.IsOpen(dial_));
}

// --- What somebody cannot do who has the keys of a region, or who has recorded everything.

TEST_F(AcceptorTest, ARegionsKeyMakesNoPlayerAndNoOtherRegion) {
  const EndpointIdentity taken_over = TestWorker(key_, "plaza-1", RegionId(3), Incarnation(8));
  // Its certificate is none of a player.
  EXPECT_EQ(RefusalOf(CredentialsOf(taken_over))->reason, Refused::kBadCredential);
  // A player that its key has signed is none.
  EXPECT_EQ(RefusalOf(IssuePlayer("plaza-1", PlayerNumber(7), Generation(9), taken_over.key))->reason,
            Refused::kBadCredential);
  // It cannot show a credential that a player showed to it: the key that goes with it never came there.
  Credentials seen = Player();
  seen.key = taken_over.key;
  EXPECT_EQ(RefusalOf(seen)->reason, Refused::kBadCredential);

  server_.Open(TestWorker(key_, "plaza-1", RegionId(2), Incarnation(5), true));  // a link port
  EXPECT_EQ(RefusalOf(Player())->reason, Refused::kBadCredential);
  Credentials forged = CredentialsOf(taken_over);
  forged.statement = Sign(WorkerCertificate{.instance_id = "plaza-1",
                                            .region = RegionId(1),
                                            .incarnation = Incarnation(9),
                                            .key = taken_over.key.verification_key()},
                          taken_over.key);
  EXPECT_EQ(RefusalOf(forged)->reason, Refused::kBadCredential);
  Credentials borrowed = CredentialsOf(TestWorker(key_, "plaza-1", RegionId(1), Incarnation(7)));
  borrowed.key = taken_over.key;
  EXPECT_EQ(RefusalOf(borrowed)->reason, Refused::kBadCredential);
  // It comes in as what it is.
  const SessionNumber session = Enter(CredentialsOf(taken_over));
  EXPECT_EQ(server_.WhoIs(session), (PeerIdentity{.region = RegionId(3), .incarnation = Incarnation(8)}));
}

TEST_F(AcceptorTest, AnEphemeralKeyOfLowOrderIsRefused) {
  const Credentials player = Player();
  Bytes genuine = LoginOf(player);
  Login login = *ReadLogin(genuine);
  login.ephemeral = {};
  Bytes bytes = Write(login, player.key);
  const auto refusal = ReadRefusal(Copy(AtServer(bytes)));
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Refused::kBadCredential);
  EXPECT_EQ(server_.sessions(), 0u);
}

// Everything that is kept goes into both handshakes, and all that was on the wire is known; still the second one's keys
// are not those of the first, and nothing but the two ephemeral secrets, which are gone, leads to either.
TEST_F(AcceptorTest, ARecordingIsNotReadWithTheKeysOfBothSides) {
  const EndpointIdentity region = Identity();
  const Credentials player = Player();
  server_.Open(region);
  struct Recording {
    Bytes login, accept, sealed;
  };
  const auto record = [&] {
    Recording recording;
    recording.login = LoginOf(player);
    Bytes login = recording.login;
    recording.accept = Copy(AtServer(login));
    Bytes accept = recording.accept;
    EXPECT_EQ(AtDialler(accept).kind, Kind::kDialled);
    recording.sealed = Sealed(dialler_, dial_, {1, 2, 3});
    Bytes sealed = recording.sealed;
    EXPECT_EQ(AtServer(sealed).kind, Kind::kPayload);
    return recording;
  };
  const Recording first = record(), second = record();
  EXPECT_EQ(ReadLogin(first.login)->credential, ReadLogin(second.login)->credential);
  EXPECT_EQ(ReadAccept(first.accept)->certificate, ReadAccept(second.accept)->certificate);

  // The keys of both sides, and of the instance, put in the place of the ephemeral ones. (An Ed25519 seed is the scalar
  // of an X25519 key, too, once it has been hashed: both forms are tried.)
  std::vector<SharedSecret> guesses;
  for (const SigningKey& kept : {key_, region.key, player.key}) {
    const Seed seed = kept.seed();
    std::array<std::uint8_t, 64> secret_key{};
    std::copy_n(seed.data(), 32, secret_key.begin());
    std::copy_n(kept.verification_key().begin(), 32, secret_key.begin() + 32);
    Secret<32> converted;
    ASSERT_EQ(crypto_sign_ed25519_sk_to_curve25519(converted.data(), secret_key.data()), 0);
    for (const Recording& recording : {first, second}) {
      for (const EphemeralPublic& theirs :
           {ReadLogin(recording.login)->ephemeral, ReadAccept(recording.accept)->ephemeral}) {
        for (const Secret<32>& mine : {seed, converted}) {
          SharedSecret shared;
          ASSERT_EQ(crypto_scalarmult(shared.data(), mine.data(), theirs.data()), 0);
          guesses.push_back(shared);
        }
      }
    }
    guesses.push_back(seed);
  }
  guesses.emplace_back();
  for (const Recording& recording : {first, second}) {
    for (const SharedSecret& guess : guesses) {
      const DirectionKeys keys = DeriveKeys(guess, recording.login, recording.accept);
      Channel eavesdropper(keys.to_dialler, keys.to_acceptor);
      Bytes sealed = recording.sealed;
      Channel::Fault fault{};
      EXPECT_FALSE(eavesdropper.Open(sealed, &fault).has_value());
    }
  }
  // The first connection's datagram under the second's session and address: its keys differ.
  Bytes moved = first.sealed;
  std::copy_n(second.sealed.begin(), kSealHeaderBytes, moved.begin());
  const std::uint64_t forged = server_.stats().forged + server_.stats().replayed;
  EXPECT_EQ(AtServer(moved).kind, Kind::kNothing);
  EXPECT_EQ(server_.stats().forged + server_.stats().replayed, forged + 1);
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

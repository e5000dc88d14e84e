// Proofs in the handshake of an acceptor: damaged, forged, replayed and recorded ones lead nowhere.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "net/testing/acceptor_fixture.h"

namespace tessera::net {
namespace {

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

}  // namespace
}  // namespace tessera::net

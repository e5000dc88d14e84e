#include "net/handshake.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "net/protocol.h"
#include "net/testing/test_identity.h"

namespace tessera::net {
namespace {

Nonce NonceOf(std::uint8_t byte) {
  Nonce nonce;
  nonce.fill(byte);
  return nonce;
}

struct HandshakeTest : testing::Test {
  HandshakeTest() {
    login.credential = player.statement;
    login.ephemeral = ours.public_key();
    accept.certificate = region.certificate;
    accept.ephemeral = theirs.public_key();
  }

  const SigningKey instance = SigningKey::Make();
  const Credentials player = IssuePlayer("plaza-1", PlayerNumber(7), Generation(1), instance);
  const EndpointIdentity region = TestWorker(instance, "plaza-1", RegionId(2), Incarnation(5));
  const EphemeralKey ours, theirs;
  const Hello hello{.protocol = kProtocolVersion, .session = 0x1234, .nonce = NonceOf(1)};
  const Challenge challenge{.session = 0x1234,
                            .nonce = NonceOf(1),
                            .incarnation = Incarnation(5),
                            .cookie = {.period = 9, .mac = NonceOf(2)}};
  Login login{.session = 0x1234,
              .nonce = NonceOf(1),
              .cookie = challenge.cookie,
              .region = RegionId(2),
              .incarnation = Incarnation(5),
              .credential = {}};
  Accept accept{.session = 0x1234, .peer = 0x5678, .certificate = {}};
};

TEST_F(HandshakeTest, EachFormReadsAsItWasWritten) {
  EXPECT_EQ(ReadHello(Write(hello)), hello);
  EXPECT_EQ(ReadChallenge(Write(challenge)), challenge);
  const auto login_bytes = Write(login, player.key);
  EXPECT_EQ(ReadLogin(login_bytes), login);
  EXPECT_EQ(ReadAccept(Write(accept, login_bytes, region.key)), accept);
  const Refusal refusal{.reason = Refused::kFull, .session = 3, .nonce = NonceOf(1), .detail = "all 64 places"};
  EXPECT_EQ(ReadRefusal(Write(refusal, 1000)), refusal);
}

TEST_F(HandshakeTest, ANonceBeginsWithTheInstancesKnockAndIsRandomElse) {
  const Knock knock = KnockOf(instance.verification_key());
  const Nonce one = MakeNonce(knock), other = MakeNonce(knock);
  EXPECT_TRUE(std::equal(knock.begin(), knock.end(), one.begin()));
  EXPECT_TRUE(std::equal(knock.begin(), knock.end(), other.begin()));
  EXPECT_NE(one, other);
  EXPECT_NE(KnockOf(SigningKey::Make().verification_key()), knock);
  const auto bytes = Write(Hello{.protocol = kProtocolVersion, .session = 7, .nonce = one});
  EXPECT_TRUE(std::equal(knock.begin(), knock.end(), bytes.begin() + kKnockAt)) << "where the filter looks";
  // docs/protocol.md, "Handshake", gives this one for who writes another end.
  VerificationKey counted;
  for (std::size_t i = 0; i < counted.size(); ++i) counted[i] = static_cast<std::uint8_t>(i);
  EXPECT_EQ(KnockOf(counted), (Knock{0x06, 0xe1, 0xcb, 0x1c}));
}

TEST_F(HandshakeTest, EachAnswerIsShorterThanItsQuestion) {
  EXPECT_LT(Write(challenge).size(), Write(hello).size());
  for (const std::size_t id_bytes : {std::size_t{0}, std::size_t{7}, kMaxInstanceIdBytes}) {
    const std::string id(id_bytes, 'i');
    login.credential = IssuePlayer(id, PlayerNumber(7), Generation(1), instance).statement;
    accept.certificate = TestWorker(instance, id, RegionId(2), Incarnation(5)).certificate;
    const auto login_bytes = Write(login, player.key);
    EXPECT_LT(Write(accept, login_bytes, region.key).size(), login_bytes.size());
    EXPECT_LE(login_bytes.size(), kMaxHandshakeBytes);
  }
  const Refusal wordy{.reason = Refused::kFull, .session = 3, .nonce = {}, .detail = std::string(500, 'x')};
  for (const std::size_t question : {Write(hello).size(), Write(Login{}, player.key).size(), kMaxHandshakeBytes}) {
    EXPECT_LT(Write(wordy, question).size(), question);
    EXPECT_TRUE(ReadRefusal(Write(wordy, question)).has_value());
  }
}

TEST_F(HandshakeTest, AnyOtherLengthIsRefused) {
  const auto check = [](std::vector<std::uint8_t> bytes, auto read) {
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      EXPECT_FALSE(read(std::span(bytes).first(length)).has_value()) << length;
    }
    bytes.push_back(0);
    EXPECT_FALSE(read(std::span<const std::uint8_t>(bytes)).has_value());
  };
  const auto login_bytes = Write(login, player.key);
  check(Write(hello), ReadHello);
  check(Write(challenge), ReadChallenge);
  check(login_bytes, ReadLogin);
  check(Write(accept, login_bytes, region.key), ReadAccept);
}

TEST_F(HandshakeTest, OneFormIsNotTakenForAnother) {
  const auto login_bytes = Write(login, player.key);
  for (const auto& bytes :
       {Write(hello), Write(challenge), login_bytes, Write(accept, login_bytes, region.key), Write(Refusal{}, 100)}) {
    const int taken = ReadHello(bytes).has_value() + ReadChallenge(bytes).has_value() + ReadLogin(bytes).has_value() +
                      ReadAccept(bytes).has_value() + ReadRefusal(bytes).has_value();
    EXPECT_LE(taken, 1);
  }
}

TEST_F(HandshakeTest, ALoginIsSignedByItsHolderAloneAndInEveryBit) {
  const VerificationKey holder = player.key.verification_key();
  const std::vector<std::uint8_t> bytes = Write(login, player.key);
  EXPECT_TRUE(IsSigned(bytes, holder));
  EXPECT_FALSE(IsSigned(bytes, region.key.verification_key()));
  EXPECT_FALSE(IsSigned(bytes, VerificationKey()));
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(IsSigned(damaged, holder)) << "bit " << bit;
  }
}

TEST_F(HandshakeTest, AnAcceptIsSignedForItsLoginByItsWorkerAloneAndInEveryBit) {
  const VerificationKey worker = region.key.verification_key();
  const std::vector<std::uint8_t> login_bytes = Write(login, player.key);
  const std::vector<std::uint8_t> bytes = Write(accept, login_bytes, region.key);
  EXPECT_TRUE(IsSigned(bytes, login_bytes, worker));
  EXPECT_FALSE(IsSigned(bytes, login_bytes, player.key.verification_key()));
  EXPECT_FALSE(IsSigned(bytes, worker)) << "it does not pass for a Login";
  EXPECT_FALSE(IsSigned(login_bytes, login_bytes, player.key.verification_key())) << "nor a Login for it";
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(IsSigned(damaged, login_bytes, worker)) << "bit " << bit;
  }
  for (std::size_t byte = 0; byte < login_bytes.size(); ++byte) {
    std::vector<std::uint8_t> other = login_bytes;
    other[byte] ^= 1;
    EXPECT_FALSE(IsSigned(bytes, other, worker)) << "byte " << byte;
  }
}

TEST_F(HandshakeTest, RefusalsWithWhatCannotBePrintedAreDropped) {
  const Refusal refusal{.reason = Refused::kFull, .session = 3, .nonce = {}, .detail = "a\nb"};
  EXPECT_FALSE(ReadRefusal(Write(refusal, 100)).has_value());
}

TEST_F(HandshakeTest, BothSidesComeToTheSameKeysAndEachDirectionHasItsOwn) {
  const auto login_bytes = Write(login, player.key);
  const auto accept_bytes = Write(accept, login_bytes, region.key);
  const DirectionKeys dialler = DeriveKeys(*ours.SharedWith(theirs.public_key()), login_bytes, accept_bytes);
  const DirectionKeys acceptor = DeriveKeys(*theirs.SharedWith(ours.public_key()), login_bytes, accept_bytes);
  EXPECT_EQ(dialler.to_acceptor, acceptor.to_acceptor);
  EXPECT_EQ(dialler.to_dialler, acceptor.to_dialler);
  EXPECT_FALSE(dialler.to_acceptor == dialler.to_dialler);
}

TEST_F(HandshakeTest, KeysDependOnTheSharedSecretAndAllThatWasSaid) {
  const auto login_bytes = Write(login, player.key);
  const auto accept_bytes = Write(accept, login_bytes, region.key);
  const SharedSecret shared = *ours.SharedWith(theirs.public_key());
  const DirectionKeys keys = DeriveKeys(shared, login_bytes, accept_bytes);
  const auto differ = [&](const DirectionKeys& other) {
    return !(other.to_acceptor == keys.to_acceptor) && !(other.to_dialler == keys.to_dialler);
  };
  EXPECT_TRUE(differ(DeriveKeys(*ours.SharedWith(EphemeralKey().public_key()), login_bytes, accept_bytes)));
  for (std::size_t byte = 0; byte < login_bytes.size(); ++byte) {
    std::vector<std::uint8_t> other = login_bytes;
    other[byte] ^= 1;
    EXPECT_TRUE(differ(DeriveKeys(shared, other, accept_bytes))) << byte;
  }
  for (std::size_t byte = 0; byte < accept_bytes.size() - sizeof(Signature); ++byte) {
    std::vector<std::uint8_t> other = accept_bytes;
    other[byte] ^= 1;
    EXPECT_TRUE(differ(DeriveKeys(shared, login_bytes, other))) << byte;
  }
}

// With each of them everybody would come to the same secret, zero (RFC 7748, section 6.1; the points of
// https://cr.yp.to/ecdh.html, "validate").
TEST(EphemeralKeyTest, PointsOfLowOrderAreRefused) {
  EphemeralPublic zero{}, one{}, minus_one{}, p{}, above_p{};
  one[0] = 1;
  p.fill(0xff);
  p[0] = 0xed;
  p[31] = 0x7f;
  minus_one = above_p = p;
  minus_one[0] = 0xec;
  above_p[0] = 0xee;
  const EphemeralPublic order_8 = {0xe0, 0xeb, 0x7a, 0x7c, 0x3b, 0x41, 0xb8, 0xae, 0x16, 0x56, 0xe3,
                                   0xfa, 0xf1, 0x9f, 0xc4, 0x6a, 0xda, 0x09, 0x8d, 0xeb, 0x9c, 0x32,
                                   0xb1, 0xfd, 0x86, 0x62, 0x05, 0x16, 0x5f, 0x49, 0xb8, 0x00};
  const EphemeralPublic other_of_order_8 = {0x5f, 0x9c, 0x95, 0xbc, 0xa3, 0x50, 0x8c, 0x24, 0xb1, 0xd0, 0xb1,
                                            0x55, 0x9c, 0x83, 0xef, 0x5b, 0x04, 0x44, 0x5c, 0xc4, 0x58, 0x1c,
                                            0x8e, 0x86, 0xd8, 0x22, 0x4e, 0xdd, 0xd0, 0x9f, 0x11, 0x57};
  for (const EphemeralPublic& point : {zero, one, minus_one, p, above_p, order_8, other_of_order_8}) {
    EXPECT_FALSE(EphemeralKey().SharedWith(point).has_value()) << static_cast<int>(point[0]);
  }
  EXPECT_TRUE(EphemeralKey().SharedWith(EphemeralKey().public_key()).has_value());
}

TEST(CookieJarTest, IsGoodForItsAddressAndNonceAndOneToTwoPeriods) {
  const CookieJar jar;
  const Address address{.host = 0x0100007f, .port = 7777};
  const Cookie cookie = jar.Bake(address, NonceOf(1), 400);
  EXPECT_TRUE(jar.Good(cookie, address, NonceOf(1), 400));
  EXPECT_TRUE(jar.Good(cookie, address, NonceOf(1), 407));
  EXPECT_FALSE(jar.Good(cookie, address, NonceOf(1), 408));
  EXPECT_FALSE(jar.Good(cookie, address, NonceOf(1), 399));
  EXPECT_FALSE(jar.Good(cookie, address, NonceOf(2), 400));
  EXPECT_FALSE(jar.Good(cookie, {.host = address.host, .port = 7778}, NonceOf(1), 400));
  EXPECT_FALSE(jar.Good(cookie, {.host = address.host + 1, .port = 7777}, NonceOf(1), 400));
  EXPECT_FALSE(CookieJar().Good(cookie, address, NonceOf(1), 400));  // another jar, as after a restart
}

}  // namespace
}  // namespace tessera::net

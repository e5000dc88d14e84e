#include "net/handshake.h"

#include <gtest/gtest.h>

#include "net/protocol.h"

namespace tessera::net {
namespace {

Nonce NonceOf(std::uint8_t byte) {
  Nonce nonce;
  nonce.fill(byte);
  return nonce;
}

struct HandshakeTest : testing::Test {
  const InstanceKey key = MakeInstanceKey();
  const Credentials pass = Issue({.instance_id = "plaza-1", .player = PlayerNumber(7), .expires_unix_s = 99}, key);
  const Hello hello{.protocol = kProtocolVersion, .session = 0x1234, .nonce = NonceOf(1)};
  const Challenge challenge{.session = 0x1234,
                            .nonce = NonceOf(1),
                            .incarnation = Incarnation(5),
                            .cookie = {.period = 9, .mac = NonceOf(2)}};
  const Login login{.session = 0x1234,
                    .nonce = NonceOf(1),
                    .cookie = challenge.cookie,
                    .region = RegionId(2),
                    .incarnation = Incarnation(5),
                    .token = pass.token};
  const Accept accept{.session = 0x1234, .peer = 0x5678, .nonce = NonceOf(3)};
};

TEST_F(HandshakeTest, EachFormReadsAsItWasWritten) {
  EXPECT_EQ(ReadHello(Write(hello)), hello);
  EXPECT_EQ(ReadChallenge(Write(challenge)), challenge);
  EXPECT_EQ(ReadLogin(Write(login, pass.key)), login);
  EXPECT_EQ(ReadAccept(Write(accept, pass.key)), accept);
  const Refusal refusal{.reason = Refused::kFull, .session = 3, .nonce = NonceOf(1), .detail = "all 64 places"};
  EXPECT_EQ(ReadRefusal(Write(refusal, 1000)), refusal);
}

TEST_F(HandshakeTest, EachAnswerIsShorterThanItsQuestion) {
  EXPECT_LT(Write(challenge).size(), Write(hello).size());
  EXPECT_LT(Write(accept, pass.key).size(), Write(Login{}, pass.key).size());
  const Refusal wordy{.reason = Refused::kFull, .session = 3, .nonce = {}, .detail = std::string(500, 'x')};
  for (const std::size_t question : {Write(hello).size(), Write(Login{}, pass.key).size(), kMaxHandshakeBytes}) {
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
  check(Write(hello), ReadHello);
  check(Write(challenge), ReadChallenge);
  check(Write(login, pass.key), ReadLogin);
  check(Write(accept, pass.key), ReadAccept);
}

TEST_F(HandshakeTest, OneFormIsNotTakenForAnother) {
  for (const auto& bytes :
       {Write(hello), Write(challenge), Write(login, pass.key), Write(accept, pass.key), Write(Refusal{}, 100)}) {
    const int taken = ReadHello(bytes).has_value() + ReadChallenge(bytes).has_value() + ReadLogin(bytes).has_value() +
                      ReadAccept(bytes).has_value() + ReadRefusal(bytes).has_value();
    EXPECT_LE(taken, 1);
  }
}

TEST_F(HandshakeTest, ALoginIsProvenByItsKeyAloneAndInEveryBit) {
  const std::vector<std::uint8_t> bytes = Write(login, pass.key);
  EXPECT_TRUE(IsProven(bytes, pass.key));
  EXPECT_FALSE(IsProven(bytes, SessionKey()));
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(IsProven(damaged, pass.key)) << "bit " << bit;
  }
}

TEST_F(HandshakeTest, RefusalsWithWhatCannotBePrintedAreDropped) {
  const Refusal refusal{.reason = Refused::kFull, .session = 3, .nonce = {}, .detail = "a\nb"};
  EXPECT_FALSE(ReadRefusal(Write(refusal, 100)).has_value());
}

TEST_F(HandshakeTest, KeysDependOnEverythingTheyAreOf) {
  const auto derive = [&](const SessionKey& session, std::uint32_t region, std::uint64_t incarnation, std::uint8_t ours,
                          std::uint8_t theirs) {
    return DeriveKeys(session, RegionId(region), Incarnation(incarnation), NonceOf(ours), NonceOf(theirs));
  };
  const DirectionKeys keys = derive(pass.key, 2, 5, 1, 3);
  EXPECT_EQ(derive(pass.key, 2, 5, 1, 3).to_acceptor, keys.to_acceptor);
  EXPECT_EQ(derive(pass.key, 2, 5, 1, 3).to_dialler, keys.to_dialler);
  EXPECT_FALSE(keys.to_acceptor == keys.to_dialler);
  for (const DirectionKeys& other :
       {derive(MakeInstanceKey(), 2, 5, 1, 3), derive(pass.key, 3, 5, 1, 3), derive(pass.key, 2, 6, 1, 3),
        derive(pass.key, 2, 5, 2, 3), derive(pass.key, 2, 5, 1, 4), derive(pass.key, 2, 5, 3, 1)}) {
    EXPECT_FALSE(other.to_acceptor == keys.to_acceptor);
    EXPECT_FALSE(other.to_dialler == keys.to_dialler);
  }
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

#include "net/credential.h"

#include <gtest/gtest.h>

#include <sstream>

namespace tessera::net {
namespace {

using StatementBytes = std::vector<std::uint8_t>;

struct CredentialTest : testing::Test {
  const SigningKey instance = SigningKey::Make(), holder = SigningKey::Make();
  const VerificationKey by = instance.verification_key();
  const PlayerCredential player{.instance_id = "plaza-1",
                                .player = PlayerNumber(7),
                                .generation = Generation(1ull << 40),
                                .key = holder.verification_key()};
  const WorkerCertificate worker{.instance_id = "plaza-1",
                                 .region = RegionId(3),
                                 .incarnation = Incarnation(1ull << 40),
                                 .key = holder.verification_key()};
};

TEST_F(CredentialTest, SaysWhatWasSigned) {
  const auto read = ReadPlayerCredential(Sign(player, instance), "plaza-1", by);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, player);
  const auto certificate = ReadWorkerCertificate(Sign(worker, instance), "plaza-1", by);
  ASSERT_TRUE(certificate.ok()) << certificate.status();
  EXPECT_EQ(*certificate, worker);
}

TEST_F(CredentialTest, HasTheSizesThatAreToldOfIt) {
  EXPECT_EQ(Sign(player, instance).size(), PlayerCredentialBytes(7));
  EXPECT_EQ(Sign(worker, instance).size(), WorkerCertificateBytes(7));
  WorkerCertificate longest = worker;
  longest.instance_id = std::string(kMaxInstanceIdBytes, 'i');
  EXPECT_EQ(Sign(longest, instance).size(), kMaxCredentialBytes);
  EXPECT_TRUE(ReadWorkerCertificate(Sign(longest, instance), longest.instance_id, by).ok());
}

TEST_F(CredentialTest, AnyChangedBitIsRefused) {
  for (const StatementBytes& genuine : {Sign(player, instance), Sign(worker, instance)}) {
    for (std::size_t bit = 0; bit < genuine.size() * 8; ++bit) {
      StatementBytes damaged = genuine;
      damaged[bit / 8] = static_cast<std::uint8_t>(damaged[bit / 8] ^ (1u << (bit % 8)));
      EXPECT_FALSE(ReadPlayerCredential(damaged, "plaza-1", by).ok()) << "bit " << bit;
      EXPECT_FALSE(ReadWorkerCertificate(damaged, "plaza-1", by).ok()) << "bit " << bit;
    }
  }
}

TEST_F(CredentialTest, AnyOtherLengthIsRefused) {
  StatementBytes bytes = Sign(player, instance);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto read = ReadPlayerCredential(std::span(bytes).first(length), "plaza-1", by);
    EXPECT_EQ(read.status().code(), absl::StatusCode::kUnauthenticated) << length;
  }
  bytes.push_back(0);
  EXPECT_EQ(ReadPlayerCredential(bytes, "plaza-1", by).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(CredentialTest, AnotherSignerIsRefused) {
  const auto read = ReadPlayerCredential(Sign(player, SigningKey::Make()), "plaza-1", by);
  EXPECT_EQ(read.status().code(), absl::StatusCode::kUnauthenticated);
  // The holder itself, too: a region's key signs no players.
  EXPECT_FALSE(ReadPlayerCredential(Sign(player, holder), "plaza-1", by).ok());
  EXPECT_FALSE(ReadPlayerCredential(Sign(player, SigningKey()), "plaza-1", by).ok());
  EXPECT_FALSE(ReadPlayerCredential(Sign(player, SigningKey()), "plaza-1", VerificationKey()).ok());
}

TEST_F(CredentialTest, AnotherInstanceIsRefusedAndBothAreNamed) {
  const auto read = ReadPlayerCredential(Sign(player, instance), "plaza-2", by);
  EXPECT_EQ(read.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(read.status().message(), "the player credential is for instance plaza-1, this is plaza-2");
  EXPECT_EQ(ReadWorkerCertificate(Sign(worker, instance), "plaza-2", by).status().code(), absl::StatusCode::kNotFound);
}

// Each kind has a label of its own in what is signed, so a first byte that is changed does not help either.
TEST_F(CredentialTest, OneKindIsNotTakenForAnother) {
  EXPECT_EQ(ReadPlayerCredential(Sign(worker, instance), "plaza-1", by).status().message(),
            "this is no player credential");
  EXPECT_EQ(ReadWorkerCertificate(Sign(player, instance), "plaza-1", by).status().message(),
            "this is no worker certificate");
  StatementBytes bytes = Sign(player, instance);
  ASSERT_EQ(bytes.size(), WorkerCertificateBytes(7));
  bytes[0] = 2;
  EXPECT_EQ(ReadWorkerCertificate(bytes, "plaza-1", by).status().code(), absl::StatusCode::kUnauthenticated);
}

TEST_F(CredentialTest, EachIssuedPlayerHasAKeyOfItsOwn) {
  const Credentials one = IssuePlayer("plaza-1", PlayerNumber(7), Generation(3), instance);
  const Credentials two = IssuePlayer("plaza-1", PlayerNumber(7), Generation(3), instance);
  EXPECT_NE(one.key.verification_key(), two.key.verification_key());
  EXPECT_EQ(one.instance_key, by);
  const auto read = ReadPlayerCredential(one.statement, "plaza-1", by);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->player, PlayerNumber(7));
  EXPECT_EQ(read->generation, Generation(3));
  EXPECT_EQ(read->key, one.key.verification_key());
}

TEST(SigningKeyTest, ComesBackFromItsSeed) {
  const SigningKey key = SigningKey::Make();
  const Seed seed = key.seed();
  const auto again = SigningKey::FromSeed({reinterpret_cast<const char*>(seed.data()), seed.size()}, "seed");
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->verification_key(), key.verification_key());
  const StatementBytes bytes = {1, 2, 3};
  EXPECT_EQ(again->Sign("a", bytes), key.Sign("a", bytes));
}

// RFC 8032, section 7.1, test 1: the public half of that seed.
TEST(SigningKeyTest, IsEd25519) {
  const unsigned char seed[] = {0x9d, 0x61, 0xb1, 0x9d, 0xef, 0xfd, 0x5a, 0x60, 0xba, 0x84, 0x4a,
                                0xf4, 0x92, 0xec, 0x2c, 0xc4, 0x44, 0x49, 0xc5, 0x69, 0x7b, 0x32,
                                0x69, 0x19, 0x70, 0x3b, 0xac, 0x03, 0x1c, 0xae, 0x7f, 0x60};
  const auto key = SigningKey::FromSeed({reinterpret_cast<const char*>(seed), sizeof seed}, "seed");
  ASSERT_TRUE(key.ok());
  const VerificationKey expected = {0xd7, 0x5a, 0x98, 0x01, 0x82, 0xb1, 0x0a, 0xb7, 0xd5, 0x4b, 0xfe,
                                    0xd3, 0xc9, 0x64, 0x07, 0x3a, 0x0e, 0xe1, 0x72, 0xf3, 0xda, 0xa6,
                                    0x23, 0x25, 0xaf, 0x02, 0x1a, 0x68, 0xf7, 0x07, 0x51, 0x1a};
  EXPECT_EQ(key->verification_key(), expected);
}

TEST(SigningKeyTest, ASignatureIsForItsLabelItsBytesAndItsKey) {
  const SigningKey key = SigningKey::Make();
  const StatementBytes bytes = {1, 2, 3}, more = {'b', 1, 2, 3};
  const Signature signature = key.Sign("ab", bytes);
  EXPECT_TRUE(Verifies(key.verification_key(), "ab", bytes, signature));
  EXPECT_FALSE(Verifies(key.verification_key(), "ac", bytes, signature));
  EXPECT_FALSE(Verifies(key.verification_key(), "a", more, signature)) << "where the label ends is signed as well";
  EXPECT_FALSE(Verifies(key.verification_key(), "ab", more, signature));
  EXPECT_FALSE(Verifies(SigningKey::Make().verification_key(), "ab", bytes, signature));
}

TEST(SigningKeyTest, KeysHaveExactly32Bytes) {
  EXPECT_TRUE(SigningKey::FromSeed(std::string(32, 'k'), "seed").ok());
  EXPECT_EQ(SigningKey::FromSeed(std::string(31, 'k'), "seed").status().message(), "seed has 31 bytes; it needs 32");
  EXPECT_TRUE(VerificationKeyFrom(std::string(32, 'k'), "key").ok());
  EXPECT_EQ(VerificationKeyFrom("", "key").status().message(), "key has 0 bytes; it needs 32");
}

TEST(SecretTest, IsNotPrinted) {
  std::ostringstream out;
  out << SigningKey::Make().seed();
  EXPECT_EQ(out.str(), "(secret)");
}

}  // namespace
}  // namespace tessera::net

// The handshake by which an unproven peer becomes a peer, before ENet hears of it: the form of its datagrams, its
// cookies, and the keys that follow from it (docs/protocol.md, "The acceptor").
//
//   dialler                                                    acceptor
//   Hello      nonce                                     ->          keeps nothing
//              <-   Challenge   cookie of (time, address, nonce), incarnation
//   Login      cookie, ephemeral key, credential, signature  ->      makes a session, and no sooner
//              <-   Accept      ephemeral key, certificate, signature over Login and Accept
//   or at either step  <-   Refusal   reason
//
// A Login holds all fields of the Hello and the Challenge before it, so it stands for both in what is signed and
// hashed. Long-lived keys only sign; the keys of a connection come from two ephemeral ones, which are wiped, so nobody
// who has recorded a connection and gets hold of all other keys later can read it.
//
// Every answer is shorter than its question, so the acceptor amplifies nothing. Readers take bytes off a wire: they
// give a value only when size, kind and every field are right, and never read out of bounds. Thread rule: free
// functions; a CookieJar belongs to one thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/world/ids.h"
#include "net/address.h"
#include "net/channel.h"
#include "net/credential.h"
#include "net/datagram_kind.h"
#include "net/signing_key.h"

namespace tessera::net {

// Why a login is refused. The numbers are those of tessera.v1.RefusalReason.
enum class Refused : std::uint8_t {
  kProtocol = 1,
  kBadCredential = 2,
  kWrongInstance = 3,
  kFull = 6,
  kStopping = 7,
  kWrongRegion = 8,
};
std::string_view WordOf(Refused reason);  // "FULL"

using Nonce = std::array<std::uint8_t, 16>;
// The first bytes of a dialler's nonce. Only who has the instance's public key, which is in grants and orders, can work
// them out, so a port that is flooded by strangers looks at those that have them first (flood_filter.h). They prove
// nothing, for whoever sees a Hello can repeat them.
using Knock = std::array<std::uint8_t, 4>;
Knock KnockOf(const VerificationKey& instance_key);
// Random but for its knock.
Nonce MakeNonce(const Knock& knock);
using EphemeralPublic = std::array<std::uint8_t, 32>;  // X25519
using SharedSecret = Secret<32>;

struct Hello {
  std::uint32_t protocol = 0;
  std::uint32_t session = 0;  // the dialler's number of the session
  Nonce nonce{};
  friend bool operator==(const Hello&, const Hello&) = default;
};

struct Cookie {
  std::uint32_t period = 0;
  std::array<std::uint8_t, 16> mac{};
  friend bool operator==(const Cookie&, const Cookie&) = default;
};

struct Challenge {
  std::uint32_t session = 0;  // the dialler's
  Nonce nonce{};              // the dialler's, so that only a peer that saw the Hello can answer it
  Incarnation incarnation{};
  Cookie cookie;
  friend bool operator==(const Challenge&, const Challenge&) = default;
};

struct Login {
  std::uint32_t session = 0;
  Nonce nonce{};
  Cookie cookie;
  RegionId region{};  // the region that the dialler means
  Incarnation incarnation{};
  EphemeralPublic ephemeral{};
  std::vector<std::uint8_t> credential;  // a PlayerCredential or a WorkerCertificate, not checked
  friend bool operator==(const Login&, const Login&) = default;
};

struct Accept {
  std::uint32_t session = 0;  // the dialler's
  std::uint32_t peer = 0;     // the acceptor's number of the session
  EphemeralPublic ephemeral{};
  std::vector<std::uint8_t> certificate;  // a WorkerCertificate, not checked
  friend bool operator==(const Accept&, const Accept&) = default;
};

struct Refusal {
  Refused reason{};
  std::uint32_t session = 0;
  Nonce nonce{};
  std::string detail;  // one line for a person
  friend bool operator==(const Refusal&, const Refusal&) = default;
};

inline constexpr std::size_t kHelloBytes = 96;
inline constexpr std::size_t kKnockAt = 9;  // in a Hello's bytes, where its nonce begins
inline constexpr std::size_t kMaxHandshakeBytes = 576;

std::vector<std::uint8_t> Write(const Hello& hello);
std::vector<std::uint8_t> Write(const Challenge& challenge);
// Ends in the signature of the credential's holder over all before it.
std::vector<std::uint8_t> Write(const Login& login, const SigningKey& key);
// Ends in the signature of the certificate's holder over the Login that it answers and all before it.
std::vector<std::uint8_t> Write(const Accept& accept, std::span<const std::uint8_t> login, const SigningKey& key);
// Gives fewer bytes than `question_bytes`, whatever the detail.
std::vector<std::uint8_t> Write(const Refusal& refusal, std::size_t question_bytes);

std::optional<Hello> ReadHello(std::span<const std::uint8_t> bytes);
std::optional<Challenge> ReadChallenge(std::span<const std::uint8_t> bytes);
std::optional<Login> ReadLogin(std::span<const std::uint8_t> bytes);    // does not check its signature
std::optional<Accept> ReadAccept(std::span<const std::uint8_t> bytes);  // likewise
std::optional<Refusal> ReadRefusal(std::span<const std::uint8_t> bytes);

// Require the bytes that the reader took.
bool IsSigned(std::span<const std::uint8_t> login, const VerificationKey& holder);
bool IsSigned(std::span<const std::uint8_t> accept, std::span<const std::uint8_t> login, const VerificationKey& holder);

// One side's half of the keys of one connection. It is used once, and wiped when it ends.
class EphemeralKey {
 public:
  EphemeralKey();  // random
  const EphemeralPublic& public_key() const { return public_; }
  // Nothing for a point of low order, with which everybody would have the same secret.
  std::optional<SharedSecret> SharedWith(const EphemeralPublic& theirs) const;

 private:
  Secret<32> secret_;
  EphemeralPublic public_{};
};

// One key for each direction of one connection: they are of the shared secret and of all bytes of Login and Accept but
// the Accept's signature.
struct DirectionKeys {
  Key to_acceptor, to_dialler;
};
DirectionKeys DeriveKeys(const SharedSecret& shared, std::span<const std::uint8_t> login,
                         std::span<const std::uint8_t> accept);

// Cookies prove that the peer which uses an address has seen an answer, without anything kept about it. A cookie is
// SipHash-2-4-128 by a key that lives as long as the jar, and is good for one to two periods.
class CookieJar {
 public:
  static constexpr std::uint64_t kPeriod_s = 4;
  CookieJar();
  // `now_s` counts from any fixed moment.
  Cookie Bake(const Address& address, const Nonce& nonce, std::uint64_t now_s) const;
  bool Good(const Cookie& cookie, const Address& address, const Nonce& nonce, std::uint64_t now_s) const;

 private:
  Cookie Make(const Address& address, const Nonce& nonce, std::uint32_t period) const;
  Secret<16> key_;
};

}  // namespace tessera::net

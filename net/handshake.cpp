#include "net/handshake.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

constexpr std::size_t kChallengeBytes = 1 + 4 + 16 + 8 + 4 + 16;
// Without credential and certificate.
constexpr std::size_t kLoginFixedBytes = 1 + 4 + 16 + 4 + 16 + 4 + 8 + 32 + 2 + sizeof(Signature);
constexpr std::size_t kAcceptFixedBytes = 1 + 4 + 4 + 32 + 2 + sizeof(Signature);
constexpr std::size_t kRefusalFixedBytes = 1 + 1 + 4 + 16;
constexpr std::size_t kMaxDetailBytes = 160;
static_assert(kChallengeBytes < kHelloBytes, "a challenge must not amplify");
// A certificate has the instance's id, as the credential that it answers has.
static_assert(kAcceptFixedBytes + WorkerCertificateBytes(0) < kLoginFixedBytes + PlayerCredentialBytes(0),
              "an acceptance must not amplify");
static_assert(kRefusalFixedBytes < kHelloBytes, "a refusal must not amplify");
static_assert(kLoginFixedBytes + kMaxCredentialBytes <= kMaxHandshakeBytes);
static_assert(kMaxHandshakeBytes < kMaxUdpBytes);

ByteWriter Begin(DatagramKind kind) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(kind));
  return out;
}

bool IsKind(ByteReader& in, DatagramKind kind) { return in.U8() == static_cast<std::uint8_t>(kind); }

constexpr std::string_view kLoginLabel = "tessera login", kAcceptLabel = "tessera accept",
                           kTranscriptLabel = "tessera handshake", kKeysLabel = "tessera channel",
                           kKnockLabel = "tessera knock";

// BLAKE2b-512 of both. `accept` is without its signature.
using Transcript = std::array<std::uint8_t, 64>;
Transcript TranscriptOf(std::span<const std::uint8_t> login, std::span<const std::uint8_t> accept) {
  ByteWriter input;
  input.Text(kTranscriptLabel);
  input.U32(kProtocolVersion);
  input.U16(static_cast<std::uint16_t>(login.size()));
  input.Bytes(login);
  input.Bytes(accept);
  Transcript transcript;
  crypto_generichash(transcript.data(), transcript.size(), input.bytes().data(), input.size(), nullptr, 0);
  return transcript;
}

std::span<const std::uint8_t> WithoutSignature(std::span<const std::uint8_t> bytes) {
  assert(bytes.size() > sizeof(Signature));
  return bytes.first(bytes.size() - sizeof(Signature));
}

// Reads a block whose length comes before it as u16; what is left after it must be a signature.
bool ReadSigned(ByteReader& in, std::vector<std::uint8_t>& block) {
  const auto bytes = in.Bytes(in.U16());
  block.assign(bytes.begin(), bytes.end());
  return in.ok() && in.remaining() == sizeof(Signature) && block.size() <= kMaxCredentialBytes;
}

void WriteBlock(ByteWriter& out, std::span<const std::uint8_t> block) {
  out.U16(static_cast<std::uint16_t>(block.size()));
  out.Bytes(block);
}

}  // namespace

std::string ToText(const Address& address) {
  std::array<std::uint8_t, 4> part;
  std::memcpy(part.data(), &address.host, part.size());
  return absl::StrCat(part[0], ".", part[1], ".", part[2], ".", part[3], ":", address.port);
}

std::string_view WordOf(Refused reason) {
  switch (reason) {
    case Refused::kProtocol:
      return "PROTOCOL";
    case Refused::kBadCredential:
      return "BAD_CREDENTIAL";
    case Refused::kWrongInstance:
      return "WRONG_INSTANCE";
    case Refused::kFull:
      return "FULL";
    case Refused::kStopping:
      return "STOPPING";
    case Refused::kWrongRegion:
      return "WRONG_REGION";
  }
  return "UNKNOWN";
}

Knock KnockOf(const VerificationKey& instance_key) {
  ByteWriter input;
  input.Text(kKnockLabel);
  input.Bytes(instance_key);
  std::array<std::uint8_t, crypto_generichash_BYTES_MIN> hash;
  crypto_generichash(hash.data(), hash.size(), input.bytes().data(), input.size(), nullptr, 0);
  Knock knock;
  std::copy_n(hash.begin(), knock.size(), knock.begin());
  return knock;
}

Nonce MakeNonce(const Knock& knock) {
  Nonce nonce;
  randombytes_buf(nonce.data(), nonce.size());
  std::copy(knock.begin(), knock.end(), nonce.begin());
  return nonce;
}

std::vector<std::uint8_t> Write(const Hello& hello) {
  ByteWriter out = Begin(DatagramKind::kHello);
  out.U32(hello.protocol);
  out.U32(hello.session);
  assert(out.size() == kKnockAt);
  out.Bytes(hello.nonce);
  out.PadTo(kHelloBytes);
  return out.Take();
}

std::optional<Hello> ReadHello(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kHelloBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kHello)) return std::nullopt;
  Hello hello;
  hello.protocol = in.U32();
  hello.session = in.U32();
  in.Fill(hello.nonce);
  const bool padded = std::all_of(in.rest().begin(), in.rest().end(), [](std::uint8_t byte) { return byte == 0; });
  return padded && hello.session <= kMaxSessionNumber ? std::optional(hello) : std::nullopt;
}

std::vector<std::uint8_t> Write(const Challenge& challenge) {
  ByteWriter out = Begin(DatagramKind::kChallenge);
  out.U32(challenge.session);
  out.Bytes(challenge.nonce);
  out.U64(challenge.incarnation.value());
  out.U32(challenge.cookie.period);
  out.Bytes(challenge.cookie.mac);
  assert(out.size() == kChallengeBytes);
  return out.Take();
}

std::optional<Challenge> ReadChallenge(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kChallengeBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kChallenge)) return std::nullopt;
  Challenge challenge;
  challenge.session = in.U32();
  in.Fill(challenge.nonce);
  challenge.incarnation = Incarnation(in.U64());
  challenge.cookie.period = in.U32();
  in.Fill(challenge.cookie.mac);
  return challenge;
}

std::vector<std::uint8_t> Write(const Login& login, const SigningKey& key) {
  ByteWriter out = Begin(DatagramKind::kLogin);
  out.U32(login.session);
  out.Bytes(login.nonce);
  out.U32(login.cookie.period);
  out.Bytes(login.cookie.mac);
  out.U32(login.region.value());
  out.U64(login.incarnation.value());
  out.Bytes(login.ephemeral);
  WriteBlock(out, login.credential);
  out.Bytes(key.Sign(kLoginLabel, out.bytes()));
  return out.Take();
}

std::optional<Login> ReadLogin(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kLoginFixedBytes || bytes.size() > kMaxHandshakeBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kLogin)) return std::nullopt;
  Login login;
  login.session = in.U32();
  in.Fill(login.nonce);
  login.cookie.period = in.U32();
  in.Fill(login.cookie.mac);
  login.region = RegionId(in.U32());
  login.incarnation = Incarnation(in.U64());
  in.Fill(login.ephemeral);
  const bool fits = ReadSigned(in, login.credential);
  return fits && login.session <= kMaxSessionNumber ? std::optional(std::move(login)) : std::nullopt;
}

bool IsSigned(std::span<const std::uint8_t> login, const VerificationKey& holder) {
  return Verifies(holder, kLoginLabel, WithoutSignature(login), login.last<sizeof(Signature)>());
}

std::vector<std::uint8_t> Write(const Accept& accept, std::span<const std::uint8_t> login, const SigningKey& key) {
  ByteWriter out = Begin(DatagramKind::kAccept);
  out.U32(accept.session);
  out.U32(accept.peer);
  out.Bytes(accept.ephemeral);
  WriteBlock(out, accept.certificate);
  out.Bytes(key.Sign(kAcceptLabel, TranscriptOf(login, out.bytes())));
  return out.Take();
}

std::optional<Accept> ReadAccept(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kAcceptFixedBytes || bytes.size() > kMaxHandshakeBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kAccept)) return std::nullopt;
  Accept accept;
  accept.session = in.U32();
  accept.peer = in.U32();
  in.Fill(accept.ephemeral);
  const bool fits = ReadSigned(in, accept.certificate);
  return fits && accept.peer <= kMaxSessionNumber ? std::optional(std::move(accept)) : std::nullopt;
}

bool IsSigned(std::span<const std::uint8_t> accept, std::span<const std::uint8_t> login,
              const VerificationKey& holder) {
  return Verifies(holder, kAcceptLabel, TranscriptOf(login, WithoutSignature(accept)),
                  accept.last<sizeof(Signature)>());
}

std::vector<std::uint8_t> Write(const Refusal& refusal, std::size_t question_bytes) {
  assert(question_bytes > kRefusalFixedBytes);
  ByteWriter out = Begin(DatagramKind::kRefusal);
  out.U8(static_cast<std::uint8_t>(refusal.reason));
  out.U32(refusal.session);
  out.Bytes(refusal.nonce);
  const std::size_t room = std::min(question_bytes - kRefusalFixedBytes - 1, kMaxDetailBytes);
  out.Text(std::string_view(refusal.detail).substr(0, room));
  return out.Take();
}

std::optional<Refusal> ReadRefusal(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < kRefusalFixedBytes || bytes.size() > kRefusalFixedBytes + kMaxDetailBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kRefusal)) return std::nullopt;
  Refusal refusal;
  refusal.reason = static_cast<Refused>(in.U8());
  if (WordOf(refusal.reason) == "UNKNOWN") return std::nullopt;
  refusal.session = in.U32();
  in.Fill(refusal.nonce);
  const auto printable = [](std::uint8_t byte) { return byte >= 0x20 && byte < 0x7f; };  // it goes into logs
  if (!std::all_of(in.rest().begin(), in.rest().end(), printable)) return std::nullopt;
  refusal.detail.assign(in.rest().begin(), in.rest().end());
  return refusal;
}

static_assert(sizeof(EphemeralPublic) == crypto_scalarmult_BYTES &&
              Secret<32>::size() == crypto_scalarmult_SCALARBYTES);

EphemeralKey::EphemeralKey() {
  InitializeSodium();
  randombytes_buf(secret_.data(), secret_.size());
  crypto_scalarmult_base(public_.data(), secret_.data());
}

std::optional<SharedSecret> EphemeralKey::SharedWith(const EphemeralPublic& theirs) const {
  SharedSecret shared;
  if (crypto_scalarmult(shared.data(), secret_.data(), theirs.data()) != 0) return std::nullopt;  // all zeros
  return shared;
}

DirectionKeys DeriveKeys(const SharedSecret& shared, std::span<const std::uint8_t> login,
                         std::span<const std::uint8_t> accept) {
  ByteWriter input;
  input.Text(kKeysLabel);
  input.U32(kProtocolVersion);
  input.Bytes(TranscriptOf(login, WithoutSignature(accept)));
  Secret<2 * Key::size()> both;
  crypto_generichash_state state;
  crypto_generichash_init(&state, shared.data(), shared.size(), both.size());
  crypto_generichash_update(&state, input.bytes().data(), input.size());
  crypto_generichash_final(&state, both.data(), both.size());
  sodium_memzero(&state, sizeof state);
  DirectionKeys keys;
  std::copy_n(both.data(), Key::size(), keys.to_acceptor.data());
  std::copy_n(both.data() + Key::size(), Key::size(), keys.to_dialler.data());
  return keys;
}

static_assert(Secret<16>::size() == crypto_shorthash_siphashx24_KEYBYTES);

CookieJar::CookieJar() { randombytes_buf(key_.data(), key_.size()); }

Cookie CookieJar::Make(const Address& address, const Nonce& nonce, std::uint32_t period) const {
  std::array<std::uint8_t, 4 + 4 + 2 + 16> input;
  for (std::size_t i = 0; i < 4; ++i) {
    input[i] = static_cast<std::uint8_t>(period >> (8 * i));
    input[4 + i] = static_cast<std::uint8_t>(address.host >> (8 * i));
  }
  input[8] = static_cast<std::uint8_t>(address.port);
  input[9] = static_cast<std::uint8_t>(address.port >> 8);
  std::copy(nonce.begin(), nonce.end(), input.begin() + 10);
  Cookie cookie{.period = period};
  static_assert(sizeof cookie.mac == crypto_shorthash_siphashx24_BYTES);
  crypto_shorthash_siphashx24(cookie.mac.data(), input.data(), input.size(), key_.data());
  return cookie;
}

Cookie CookieJar::Bake(const Address& address, const Nonce& nonce, std::uint64_t now_s) const {
  return Make(address, nonce, static_cast<std::uint32_t>(now_s / kPeriod_s));
}

bool CookieJar::Good(const Cookie& cookie, const Address& address, const Nonce& nonce, std::uint64_t now_s) const {
  const auto now = static_cast<std::uint32_t>(now_s / kPeriod_s);
  if (cookie.period != now && cookie.period + 1 != now) return false;
  const Cookie made = Make(address, nonce, cookie.period);
  return sodium_memcmp(made.mac.data(), cookie.mac.data(), made.mac.size()) == 0;
}

}  // namespace tessera::net

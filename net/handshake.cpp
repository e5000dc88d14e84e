#include "net/handshake.h"

#include <arpa/inet.h>
#include <sodium.h>

#include <algorithm>
#include <cassert>

#include "core/world/bytes.h"
#include "net/protocol.h"

namespace tessera::net {
namespace {

constexpr std::size_t kChallengeBytes = 1 + 4 + 16 + 8 + 4 + 16;
constexpr std::size_t kAcceptBytes = 1 + 4 + 4 + 16 + kProofBytes;
constexpr std::size_t kLoginFixedBytes = 1 + 4 + 16 + 4 + 16 + 4 + 8 + 2 + kProofBytes;
constexpr std::size_t kRefusalFixedBytes = 1 + 1 + 4 + 16;
constexpr std::size_t kMaxDetailBytes = 160;
static_assert(kChallengeBytes < kHelloBytes, "a challenge must not amplify");
static_assert(kAcceptBytes < kLoginFixedBytes, "an acceptance must not amplify");
static_assert(kRefusalFixedBytes < kHelloBytes, "a refusal must not amplify");
static_assert(kLoginFixedBytes + kMaxTokenBytes <= kMaxHandshakeBytes);

ByteWriter Begin(DatagramKind kind) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(kind));
  return out;
}

bool IsKind(ByteReader& in, DatagramKind kind) { return in.U8() == static_cast<std::uint8_t>(kind); }

// Keyed BLAKE2b over the name of its use and the bytes.
template <std::size_t kBytes>
void Mac(Secret<kBytes>& out, std::string_view use, std::span<const std::uint8_t> bytes, const Key& key) {
  crypto_generichash_state state;
  crypto_generichash_init(&state, key.data(), key.size(), kBytes);
  crypto_generichash_update(&state, reinterpret_cast<const std::uint8_t*>(use.data()), use.size());
  crypto_generichash_update(&state, bytes.data(), bytes.size());
  crypto_generichash_final(&state, out.data(), kBytes);
  sodium_memzero(&state, sizeof state);
}

constexpr std::string_view kLoginUse = "tessera login", kAcceptUse = "tessera accept", kKeysUse = "tessera channel";

void AppendProof(ByteWriter& out, std::string_view use, const Key& key) {
  Secret<kProofBytes> proof;
  Mac(proof, use, out.bytes(), key);
  out.Bytes({proof.data(), proof.size()});
}

bool EndsInProof(std::span<const std::uint8_t> bytes, std::string_view use, const Key& key) {
  assert(bytes.size() > kProofBytes);
  Secret<kProofBytes> proof;
  Mac(proof, use, bytes.first(bytes.size() - kProofBytes), key);
  return sodium_memcmp(proof.data(), bytes.last(kProofBytes).data(), kProofBytes) == 0;
}

}  // namespace

std::string ToText(const Address& address) {
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &address.host, text, sizeof text);
  return std::string(text) + ":" + std::to_string(address.port);
}

std::string_view WordOf(Refused reason) {
  switch (reason) {
    case Refused::kProtocol:
      return "PROTOCOL";
    case Refused::kBadToken:
      return "BAD_TOKEN";
    case Refused::kWrongInstance:
      return "WRONG_INSTANCE";
    case Refused::kExpired:
      return "EXPIRED";
    case Refused::kFull:
      return "FULL";
    case Refused::kStopping:
      return "STOPPING";
    case Refused::kWrongRegion:
      return "WRONG_REGION";
  }
  return "UNKNOWN";
}

std::vector<std::uint8_t> Write(const Hello& hello) {
  ByteWriter out = Begin(DatagramKind::kHello);
  out.U32(hello.protocol);
  out.U32(hello.session);
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

std::vector<std::uint8_t> Write(const Login& login, const SessionKey& key) {
  ByteWriter out = Begin(DatagramKind::kLogin);
  out.U32(login.session);
  out.Bytes(login.nonce);
  out.U32(login.cookie.period);
  out.Bytes(login.cookie.mac);
  out.U32(login.region.value());
  out.U64(login.incarnation.value());
  out.U16(static_cast<std::uint16_t>(login.token.size()));
  out.Bytes(login.token);
  AppendProof(out, kLoginUse, key);
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
  const auto token = in.Bytes(in.U16());
  login.token.assign(token.begin(), token.end());
  const bool fits = in.ok() && in.rest().size() == kProofBytes && token.size() <= kMaxTokenBytes;
  return fits && login.session <= kMaxSessionNumber ? std::optional(std::move(login)) : std::nullopt;
}

bool IsProven(std::span<const std::uint8_t> login, const SessionKey& key) { return EndsInProof(login, kLoginUse, key); }

std::vector<std::uint8_t> Write(const Accept& accept, const Key& to_dialler) {
  ByteWriter out = Begin(DatagramKind::kAccept);
  out.U32(accept.session);
  out.U32(accept.peer);
  out.Bytes(accept.nonce);
  AppendProof(out, kAcceptUse, to_dialler);
  assert(out.size() == kAcceptBytes);
  return out.Take();
}

std::optional<Accept> ReadAccept(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kAcceptBytes) return std::nullopt;
  ByteReader in(bytes);
  if (!IsKind(in, DatagramKind::kAccept)) return std::nullopt;
  Accept accept;
  accept.session = in.U32();
  accept.peer = in.U32();
  in.Fill(accept.nonce);
  return accept.peer <= kMaxSessionNumber ? std::optional(accept) : std::nullopt;
}

bool IsAccepted(std::span<const std::uint8_t> accept, const Key& to_dialler) {
  return EndsInProof(accept, kAcceptUse, to_dialler);
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

DirectionKeys DeriveKeys(const SessionKey& key, RegionId region, Incarnation incarnation, const Nonce& dialler,
                         const Nonce& acceptor) {
  ByteWriter input;
  input.U32(kProtocolVersion);
  input.U32(region.value());
  input.U64(incarnation.value());
  input.Bytes(dialler);
  input.Bytes(acceptor);
  Secret<2 * Key::size()> both;
  Mac(both, kKeysUse, input.bytes(), key);
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

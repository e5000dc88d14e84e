#include "net/credential.h"

#include <cassert>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/world/bytes.h"

namespace tessera::net {
namespace {

// The first byte.
enum class Kind : std::uint8_t { kPlayer = 1, kWorker = 2 };

constexpr std::size_t kMaxShownIdBytes = 64;  // the most of a stranger's instance id in an error

std::string_view LabelOf(Kind kind) {
  return kind == Kind::kPlayer ? "tessera player credential" : "tessera worker certificate";
}
const char* NameOf(Kind kind) { return kind == Kind::kPlayer ? "player credential" : "worker certificate"; }

ByteWriter Begin(Kind kind, std::string_view instance_id) {
  assert(instance_id.size() <= kMaxInstanceIdBytes);
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(kind));
  out.U8(static_cast<std::uint8_t>(instance_id.size()));
  out.Text(instance_id);
  return out;
}

std::vector<std::uint8_t> End(Kind kind, const VerificationKey& key, ByteWriter out, const SigningKey& instance_key) {
  out.Bytes(key);
  out.Bytes(instance_key.Sign(LabelOf(kind), out.bytes()));
  return out.Take();
}

// Everything between the instance id and the signature, once that has been verified.
absl::StatusOr<std::span<const std::uint8_t>> Open(std::span<const std::uint8_t> bytes, Kind kind,
                                                   std::string_view instance_id, const VerificationKey& instance_key) {
  const absl::Status bad = absl::UnauthenticatedError(
      absl::StrCat("the ", NameOf(kind), " is damaged, or not signed by the instance's key in this protocol"));
  ByteReader in(bytes);
  if (in.U8() != static_cast<std::uint8_t>(kind)) {
    return absl::UnauthenticatedError(absl::StrCat("this is no ", NameOf(kind)));
  }
  const std::span<const std::uint8_t> id = in.Bytes(in.U8());
  const std::size_t size = kind == Kind::kPlayer ? PlayerCredentialBytes(id.size()) : WorkerCertificateBytes(id.size());
  if (!in.ok() || bytes.size() != size) return bad;
  const std::string named(id.begin(), id.end());
  // Each instance has a key of its own, so another's statement does not verify here; the name is only for the error.
  if (named != instance_id) {
    return absl::NotFoundError(absl::StrCat("the ", NameOf(kind), " is for instance ",
                                            absl::CHexEscape(named.substr(0, kMaxShownIdBytes)), ", this is ",
                                            absl::string_view(instance_id.data(), instance_id.size())));
  }
  const std::span<const std::uint8_t> stated = bytes.first(bytes.size() - sizeof(Signature));
  if (!Verifies(instance_key, LabelOf(kind), stated, bytes.last<sizeof(Signature)>())) return bad;
  return stated.subspan(2 + id.size());
}

}  // namespace

std::vector<std::uint8_t> Sign(const PlayerCredential& credential, const SigningKey& instance_key) {
  ByteWriter out = Begin(Kind::kPlayer, credential.instance_id);
  out.U32(credential.player.value());
  out.U64(credential.generation.value());
  return End(Kind::kPlayer, credential.key, std::move(out), instance_key);
}

std::vector<std::uint8_t> Sign(const WorkerCertificate& certificate, const SigningKey& instance_key) {
  ByteWriter out = Begin(Kind::kWorker, certificate.instance_id);
  out.U32(certificate.region.value());
  out.U64(certificate.incarnation.value());
  return End(Kind::kWorker, certificate.key, std::move(out), instance_key);
}

Credentials IssuePlayer(std::string_view instance_id, PlayerNumber player, Generation generation,
                        const SigningKey& instance_key) {
  Credentials credentials{.instance_id = std::string(instance_id),
                          .statement = {},
                          .key = SigningKey::Make(),
                          .instance_key = instance_key.verification_key()};
  credentials.statement = Sign(PlayerCredential{.instance_id = credentials.instance_id,
                                                .player = player,
                                                .generation = generation,
                                                .key = credentials.key.verification_key()},
                               instance_key);
  return credentials;
}

absl::StatusOr<PlayerCredential> ReadPlayerCredential(std::span<const std::uint8_t> bytes, std::string_view instance_id,
                                                      const VerificationKey& instance_key) {
  const auto stated = Open(bytes, Kind::kPlayer, instance_id, instance_key);
  if (!stated.ok()) return stated.status();
  ByteReader in(*stated);
  PlayerCredential credential{.instance_id = std::string(instance_id)};
  credential.player = PlayerNumber(in.U32());
  credential.generation = Generation(in.U64());
  in.Fill(credential.key);
  assert(in.ok() && in.remaining() == 0);
  return credential;
}

absl::StatusOr<WorkerCertificate> ReadWorkerCertificate(std::span<const std::uint8_t> bytes,
                                                        std::string_view instance_id,
                                                        const VerificationKey& instance_key) {
  const auto stated = Open(bytes, Kind::kWorker, instance_id, instance_key);
  if (!stated.ok()) return stated.status();
  ByteReader in(*stated);
  WorkerCertificate certificate{.instance_id = std::string(instance_id)};
  certificate.region = RegionId(in.U32());
  certificate.incarnation = Incarnation(in.U64());
  in.Fill(certificate.key);
  assert(in.ok() && in.remaining() == 0);
  return certificate;
}

}  // namespace tessera::net

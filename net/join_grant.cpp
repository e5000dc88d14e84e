#include "net/join_grant.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/world/byte_view.h"
#include "core/world/bytes.h"
#include "core/world/map_bytes.h"

namespace tessera::net {
namespace {

constexpr std::string_view kMagic = "TSRG";
constexpr std::size_t kSceneHashDigits = 64;
constexpr std::size_t kMinRegionBytes = 1 + 2 + 2 + 1;  // id, a host of one byte, port, incarnation
using Checksum = std::array<std::uint8_t, 16>;

Checksum ChecksumOf(std::span<const std::uint8_t> bytes) {
  InitializeSodium();
  Checksum sum{};
  crypto_generichash(sum.data(), sum.size(), bytes.data(), bytes.size(), nullptr, 0);
  return sum;
}

absl::Status BadField(const char* field, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat(field, ": ", what));
}

bool IsHostCharacter(char c) { return c > ' ' && c < '\x7f'; }
bool IsHexDigit(char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); }

std::string TextOf(std::span<const std::uint8_t> bytes) { return std::string(AsText(bytes)); }

absl::Status CheckRegionsOf(const JoinGrant& grant) {
  for (const GrantedRegion& region : grant.regions) {
    if (region.host.empty() || region.host.size() > kMaxHostBytes ||
        !std::all_of(region.host.begin(), region.host.end(), IsHostCharacter)) {
      return BadField("regions.host", absl::StrCat("region ", region.region.value(), " has no host"));
    }
    if (region.port == 0)
      return BadField("regions.port", absl::StrCat("region ", region.region.value(), " has port 0"));
  }
  const bool same =
      std::equal(grant.regions.begin(), grant.regions.end(), grant.map.regions().begin(), grant.map.regions().end(),
                 [](const GrantedRegion& a, const MapRegion& b) { return a.region == b.id; });
  return same ? absl::OkStatus() : BadField("regions", "not those of the map");
}

// The credential names a player and a key; both must be the grant's, or every region would refuse it later.
absl::Status CheckCredentialOf(const JoinGrant& grant) {
  const Credentials& credentials = grant.credentials;
  const auto stated = ReadPlayerCredential(credentials.statement, credentials.instance_id, credentials.instance_key);
  if (!stated.ok()) return BadField("credential", std::string(stated.status().message()));
  if (stated->player != grant.player) {
    return BadField("credential",
                    absl::StrCat("is of player ", stated->player.value(), ", the grant of ", grant.player.value()));
  }
  if (stated->key != credentials.key.verification_key()) return BadField("credential_key", "is not the credential's");
  return absl::OkStatus();
}

void WriteCredentials(const Credentials& credentials, ByteWriter& out) {
  out.Block(credentials.instance_id);
  out.Block(credentials.statement);
  const Seed seed = credentials.key.seed();
  out.Bytes({seed.data(), seed.size()});
  out.Bytes(credentials.instance_key);
}

Credentials ReadCredentials(ByteReader& in) {
  Credentials credentials;
  in.Field("instance_id");
  credentials.instance_id = TextOf(in.Block(kMaxInstanceIdBytes));
  in.Field("credential");
  const std::span<const std::uint8_t> statement = in.Block(kMaxCredentialBytes);
  credentials.statement.assign(statement.begin(), statement.end());
  in.Field("credential_key");
  const auto key = SigningKey::FromSeed(AsText(in.Bytes(kKeyBytes)), "credential_key");
  if (key.ok()) credentials.key = *key;  // it has the size, or the reader has failed
  in.Field("instance_key");
  in.Fill(credentials.instance_key);
  return credentials;
}

void WriteRegions(const std::vector<GrantedRegion>& regions, ByteWriter& out) {
  out.Varint(regions.size());
  for (const GrantedRegion& region : regions) {
    out.Varint(region.region.value());
    out.Block(region.host);
    out.U16(region.port);
    out.Varint(region.incarnation.value());
  }
}

std::vector<GrantedRegion> ReadRegions(ByteReader& in) {
  in.Field("regions");
  std::vector<GrantedRegion> regions(in.Count(kMinRegionBytes));
  for (GrantedRegion& region : regions) {
    in.Field("regions.region");
    region.region = RegionId(in.Varint32());
    in.Field("regions.host");
    region.host = TextOf(in.Block(kMaxHostBytes));
    in.Field("regions.port");
    region.port = in.U16();
    in.Field("regions.incarnation");
    region.incarnation = Incarnation(in.Varint());
  }
  return regions;
}

void ReadRates(ByteReader& in, JoinGrant& grant) {
  in.Field("scene_hash");
  grant.scene_hash = TextOf(in.Bytes(kSceneHashDigits));
  in.Field("tick_rate_hz");
  grant.tick_rate_hz = in.Varint32();
  in.Field("snapshot_rate_hz");
  grant.snapshot_rate_hz = in.Varint32();
  in.Field("expected_players");
  grant.expected_players = in.Varint32();
}

absl::StatusOr<ByteReader> Open(std::span<const std::uint8_t> bytes) {
  if (bytes.size() > kMaxJoinGrantBytes) return BadField("grant", absl::StrCat("has ", bytes.size(), " bytes"));
  ByteReader in(bytes);
  if (AsText(in.Bytes(kMagic.size())) != kMagic) return BadField("grant", "this is no join grant");
  const std::uint16_t version = in.U16();
  if (!in.ok()) return BadField("version", "truncated");
  if (version != kJoinGrantVersion)
    return BadField("grant", absl::StrCat("of version ", version, "; this library reads ", kJoinGrantVersion));
  return in;
}

}  // namespace

absl::Status CheckJoinGrant(const JoinGrant& grant) {
  if (grant.player == PlayerNumber()) return BadField("player", "is 0");
  if (grant.credentials.instance_id.empty() || grant.credentials.instance_id.size() > kMaxInstanceIdBytes)
    return BadField("instance_id", absl::StrCat("has ", grant.credentials.instance_id.size(), " bytes"));
  if (grant.credentials.statement.size() > kMaxCredentialBytes)
    return BadField("credential", absl::StrCat("has ", grant.credentials.statement.size(), " bytes"));
  if (grant.map.version() == MapVersion()) return BadField("map.version", "must not be 0");
  if (absl::Status status = CheckRegionsOf(grant); !status.ok()) return status;
  if (grant.scene_hash.size() != kSceneHashDigits ||
      !std::all_of(grant.scene_hash.begin(), grant.scene_hash.end(), IsHexDigit)) {
    return BadField("scene_hash", "is not 64 hexadecimal digits");
  }
  const auto is_rate = [](std::uint32_t rate) { return rate >= 1 && rate <= kMaxGrantedRateHz; };
  if (!is_rate(grant.tick_rate_hz)) return BadField("tick_rate_hz", absl::StrCat(grant.tick_rate_hz));
  if (!is_rate(grant.snapshot_rate_hz)) return BadField("snapshot_rate_hz", absl::StrCat(grant.snapshot_rate_hz));
  return CheckCredentialOf(grant);
}

std::vector<std::uint8_t> EncodeJoinGrant(const JoinGrant& grant) {
  ByteWriter out;
  out.Text(kMagic);
  out.U16(kJoinGrantVersion);
  out.Varint(grant.player.value());
  WriteCredentials(grant.credentials, out);
  WriteMap(grant.map, out);
  WriteRegions(grant.regions, out);
  out.Text(grant.scene_hash);
  out.Varint(grant.tick_rate_hz);
  out.Varint(grant.snapshot_rate_hz);
  out.Varint(grant.expected_players);
  out.Bytes(ChecksumOf(out.bytes()));
  return out.Take();
}

absl::StatusOr<JoinGrant> DecodeJoinGrant(std::span<const std::uint8_t> bytes) {
  absl::StatusOr<ByteReader> opened = Open(bytes);
  if (!opened.ok()) return opened.status();
  ByteReader& in = *opened;
  JoinGrant grant;
  in.Field("player");
  grant.player = PlayerNumber(in.Varint32());
  grant.credentials = ReadCredentials(in);
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  absl::StatusOr<PartitionMap> map = ReadMap(in);
  if (!map.ok()) return absl::InvalidArgumentError(absl::StrCat("map.", map.status().message()));
  grant.map = *std::move(map);
  grant.regions = ReadRegions(in);
  ReadRates(in, grant);
  in.Field("checksum");
  Checksum stated{};
  const std::span<const std::uint8_t> summed = bytes.first(bytes.size() - in.remaining());
  in.Fill(stated);
  if (in.ok() && in.remaining() > 0) in.Fail("more bytes follow");
  if (in.ok() && stated != ChecksumOf(summed)) in.Fail("the grant is damaged");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (absl::Status status = CheckJoinGrant(grant); !status.ok()) return status;
  return grant;
}

}  // namespace tessera::net

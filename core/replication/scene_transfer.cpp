#include "core/replication/scene_transfer.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/replication/datagram.h"
#include "core/world/byte_view.h"
#include "core/world/bytes.h"
#include "core/world/packed_scene.h"

namespace tessera::replication {
namespace {

// The wire type 7 does not exist, so no message of protobuf begins with it.
constexpr std::uint8_t kSceneMarker = 7;
enum class MessageKind : std::uint8_t { kChunk = 1, kRefusal = 2, kTile = 3 };
constexpr std::size_t kMaxWhyBytes = 200;

int DigitOf(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

absl::StatusOr<SceneMessage> ReadChunk(ByteReader in) {
  SceneChunk chunk;
  in.Field("scene_chunk.total_bytes");
  chunk.total_bytes = in.Varint();
  if (chunk.total_bytes == 0 || chunk.total_bytes > kMaxPackedSceneBytes) in.Fail("out of range");
  in.Field("scene_chunk.sha256");
  in.Fill(chunk.sha256);
  in.Field("scene_chunk.offset");
  chunk.offset = in.Varint();
  if (chunk.offset > chunk.total_bytes || in.remaining() > chunk.total_bytes - chunk.offset) {
    in.Fail("lies beyond the scene");
  }
  in.Field("scene_chunk.bytes");
  if (in.remaining() == 0 || in.remaining() > kMaxSceneChunkBytes) in.Fail("out of range");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  chunk.bytes = in.rest();
  return chunk;
}

absl::StatusOr<SceneMessage> ReadTileChunk(ByteReader in) {
  TileChunk chunk;
  in.Field("tile_chunk.tile");
  chunk.tile = in.Varint32();
  if (chunk.tile >= kMaxTiles) in.Fail("out of range");
  in.Field("tile_chunk.offset");
  chunk.offset = in.Varint();
  if (chunk.offset > kMaxTile_bytes) in.Fail("out of range");
  in.Field("tile_chunk.bytes");
  if (in.remaining() == 0 || in.remaining() > kMaxSceneChunkBytes) in.Fail("out of range");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  chunk.bytes = in.rest();
  return chunk;
}

}  // namespace

absl::StatusOr<Digest> DigestFrom(std::string_view hex) {
  Digest digest{};
  if (hex.size() != 2 * digest.size()) return absl::InvalidArgumentError("scene_hash: is not 64 hexadecimal digits");
  for (std::size_t i = 0; i < digest.size(); ++i) {
    const int high = DigitOf(hex[2 * i]), low = DigitOf(hex[2 * i + 1]);
    if (high < 0 || low < 0) return absl::InvalidArgumentError("scene_hash: is not 64 hexadecimal digits");
    digest[i] = static_cast<std::uint8_t>(16 * high + low);
  }
  return digest;
}

std::vector<std::uint8_t> EncodeSceneRequest(const SceneRequest& request) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kSceneRequest));
  out.U8(static_cast<std::uint8_t>(request.want));
  out.Bytes(request.scene_hash);
  out.Varint(request.offset);
  return out.Take();
}

absl::StatusOr<SceneRequest> DecodeSceneRequest(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("scene_request.kind");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kSceneRequest) && in.ok()) in.Fail("not of a request");
  in.Field("scene_request.want");
  const std::uint8_t want = in.U8();
  if (in.ok() && (want < 1 || want > static_cast<std::uint8_t>(SceneRequest::Want::kHave)))
    in.Fail("has no such choice");
  SceneRequest request{.want = static_cast<SceneRequest::Want>(want)};
  in.Field("scene_request.scene_hash");
  in.Fill(request.scene_hash);
  in.Field("scene_request.offset");
  request.offset = in.Varint();
  if (request.offset > kMaxPackedSceneBytes) in.Fail("out of range");
  if (in.ok() && in.remaining() > 0) in.Fail("trailing bytes");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  return request;
}

std::vector<std::uint8_t> EncodeTileRequest(const TileRequest& request) {
  assert(request.wishes.size() <= kMaxTileWishes);
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(DatagramKind::kTileRequest));
  out.Varint(request.number);
  out.Bytes(request.scene_hash);
  out.Varint(request.wishes.size());
  for (const TileRequest::Wish& wish : request.wishes) {
    out.Varint(wish.tile);
    out.Varint(wish.offset);
  }
  return out.Take();
}

absl::StatusOr<TileRequest> DecodeTileRequest(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram);
  in.Field("tile_request.kind");
  if (in.U8() != static_cast<std::uint8_t>(DatagramKind::kTileRequest) && in.ok()) in.Fail("not of a request");
  TileRequest request;
  in.Field("tile_request.number");
  request.number = in.Varint32();
  in.Field("tile_request.scene_hash");
  in.Fill(request.scene_hash);
  in.Field("tile_request.wishes");
  const std::size_t count = in.Count(2);
  if (count > kMaxTileWishes) in.Fail("too many");
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    TileRequest::Wish wish;
    in.Field("tile_request.wishes.tile");
    wish.tile = in.Varint32();
    if (wish.tile >= kMaxTiles) in.Fail("out of range");
    const auto same = [&](const TileRequest::Wish& other) { return other.tile == wish.tile; };
    if (std::ranges::any_of(request.wishes, same)) in.Fail("stands twice");
    in.Field("tile_request.wishes.offset");
    wish.offset = in.Varint();
    if (wish.offset > kMaxTile_bytes) in.Fail("out of range");
    request.wishes.push_back(wish);
  }
  if (in.ok() && in.remaining() > 0) in.Fail("trailing bytes");
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  return request;
}

bool IsSceneMessage(std::span<const std::uint8_t> message) { return !message.empty() && message[0] == kSceneMarker; }

std::vector<std::uint8_t> EncodeSceneChunk(const SceneChunk& chunk) {
  assert(chunk.bytes.size() <= kMaxSceneChunkBytes);
  ByteWriter out;
  out.Reserve(chunk.bytes.size() + 64);
  out.U8(kSceneMarker);
  out.U8(static_cast<std::uint8_t>(MessageKind::kChunk));
  out.Varint(chunk.total_bytes);
  out.Bytes(chunk.sha256);
  out.Varint(chunk.offset);
  out.Bytes(chunk.bytes);
  return out.Take();
}

std::vector<std::uint8_t> EncodeTileChunk(const TileChunk& chunk) {
  assert(chunk.bytes.size() <= kMaxSceneChunkBytes);
  ByteWriter out;
  out.Reserve(chunk.bytes.size() + 16);
  out.U8(kSceneMarker);
  out.U8(static_cast<std::uint8_t>(MessageKind::kTile));
  out.Varint(chunk.tile);
  out.Varint(chunk.offset);
  out.Bytes(chunk.bytes);
  return out.Take();
}

std::vector<std::uint8_t> EncodeSceneRefusal(const std::string& why) {
  ByteWriter out;
  out.U8(kSceneMarker);
  out.U8(static_cast<std::uint8_t>(MessageKind::kRefusal));
  out.Text(std::string_view(why).substr(0, kMaxWhyBytes));
  return out.Take();
}

absl::StatusOr<SceneMessage> DecodeSceneMessage(std::span<const std::uint8_t> message) {
  ByteReader in(message);
  in.Field("scene_message");
  if (in.U8() != kSceneMarker && in.ok()) in.Fail("not of a scene");
  const std::uint8_t kind = in.U8();
  if (!in.ok()) return absl::InvalidArgumentError(in.error());
  if (kind == static_cast<std::uint8_t>(MessageKind::kChunk)) return ReadChunk(in);
  if (kind == static_cast<std::uint8_t>(MessageKind::kTile)) return ReadTileChunk(in);
  if (kind != static_cast<std::uint8_t>(MessageKind::kRefusal)) {
    return absl::InvalidArgumentError(absl::StrCat("scene_message: of kind ", kind));
  }
  if (in.remaining() > kMaxWhyBytes) return absl::InvalidArgumentError("scene_refusal.why: too long");
  return SceneRefusal{std::string(AsText(in.rest()))};
}

}  // namespace tessera::replication

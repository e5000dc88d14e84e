// How a client gets the packed scene (core/world/packed_scene.h) from a region: it asks by datagrams, the region sends
// chunks on the reliable channel.
//
// A request states what the client wants from now on and where it is, so it may be lost or come twice; it is repeated
// until what it asks for has come. While a client waits for the scene, a region sends it no snapshots, for which it
// would have no use. Chunks say where they belong and of what they are a part, so a client goes on at another region
// from where it was. docs/protocol.md, "The scene from a region", has the bytes.
//
// Tiles of a level (core/world/level_tiles.h) come in the same way once the scene is here, beside the snapshots: a
// request names the tiles that the client wants now, the first ones first. A region that is asked for a tile no more
// forgets what it has sent of it.
//
// Thread rule: free functions; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"

namespace tessera::replication {

using Digest = std::array<std::uint8_t, 32>;

struct SceneRequest {
  enum class Want : std::uint8_t {
    kHold = 1,  // no snapshots; another region sends the scene
    kSend = 2,  // no snapshots, and the scene from `offset` on, all before which has come
    kHave = 3,  // snapshots: the scene is here
  };
  Want want = Want::kHold;
  Digest scene_hash{};  // named by the grant
  std::uint64_t offset = 0;
  friend bool operator==(const SceneRequest&, const SceneRequest&) = default;
};

// The tiles that a client wants from now on, the most wanted first; none: no more.
struct TileRequest {
  struct Wish {
    std::uint32_t tile = 0;    // its place in the scene's list
    std::uint64_t offset = 0;  // all before it has come
    friend bool operator==(const Wish&, const Wish&) = default;
  };
  std::uint32_t number = 0;  // one more with each request of a connection: one that was overtaken counts no more
  Digest scene_hash{};       // as in a SceneRequest
  std::vector<Wish> wishes;  // at most kMaxTileWishes, no tile twice
  friend bool operator==(const TileRequest&, const TileRequest&) = default;
};
// Enough that small tiles fill the window.
inline constexpr std::size_t kMaxTileWishes = 16;

// A part of a packed tile, which the scene's list says the size and hash of.
struct TileChunk {
  std::uint32_t tile = 0;
  std::uint64_t offset = 0;
  std::span<const std::uint8_t> bytes;  // a view into the message
};

// A part of the packed scene.
struct SceneChunk {
  std::uint64_t total_bytes = 0;  // size of the packed scene
  Digest sha256{};                // hash of the packed scene
  std::uint64_t offset = 0;
  std::span<const std::uint8_t> bytes;  // a view into the message
};
// The region will never send it: it has another scene.
struct SceneRefusal {
  std::string why;
};

inline constexpr std::size_t kMaxSceneChunkBytes = 16 * 1024;
// So many bytes beyond a client's offset, or beyond those of its tiles together, are under way at most: the client says
// where it is before it runs dry.
inline constexpr std::uint64_t kSceneWindowBytes = 256 * 1024;

// 64 hexadecimal digits, as SceneHash gives them. INVALID_ARGUMENT "scene_hash: is not 64 hexadecimal digits".
absl::StatusOr<Digest> DigestFrom(std::string_view hex);

std::vector<std::uint8_t> EncodeSceneRequest(const SceneRequest& request);
// INVALID_ARGUMENT naming the field: "scene_request.want: has no such choice".
absl::StatusOr<SceneRequest> DecodeSceneRequest(std::span<const std::uint8_t> datagram);

std::vector<std::uint8_t> EncodeTileRequest(const TileRequest& request);
// INVALID_ARGUMENT naming the field: "tile_request.wishes: too many".
absl::StatusOr<TileRequest> DecodeTileRequest(std::span<const std::uint8_t> datagram);

// Whether a message of the reliable channel is one of these. A RegionControl never is: no field of protobuf begins so.
bool IsSceneMessage(std::span<const std::uint8_t> message);
// At most kMaxSceneChunkBytes.
std::vector<std::uint8_t> EncodeSceneChunk(const SceneChunk& chunk);
std::vector<std::uint8_t> EncodeTileChunk(const TileChunk& chunk);
std::vector<std::uint8_t> EncodeSceneRefusal(const std::string& why);
// INVALID_ARGUMENT naming the field: "scene_chunk.offset: lies beyond the scene".
using SceneMessage = std::variant<SceneChunk, SceneRefusal, TileChunk>;
absl::StatusOr<SceneMessage> DecodeSceneMessage(std::span<const std::uint8_t> message);

}  // namespace tessera::replication

#include "core/replication/scene_transfer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "core/replication/datagram.h"
#include "core/world/packed_scene.h"

namespace tessera::replication {
namespace {

using TransferBytes = std::vector<std::uint8_t>;

Digest SomeDigest() {
  Digest digest{};
  std::iota(digest.begin(), digest.end(), std::uint8_t{3});
  return digest;
}

TEST(SceneTransferTest, ARequestComesBack) {
  for (const auto want : {SceneRequest::Want::kHold, SceneRequest::Want::kSend, SceneRequest::Want::kHave}) {
    const SceneRequest request{.want = want, .scene_hash = SomeDigest(), .offset = 123456};
    const TransferBytes bytes = EncodeSceneRequest(request);
    EXPECT_EQ(KindOf(bytes), DatagramKind::kSceneRequest);
    const auto read = DecodeSceneRequest(bytes);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(*read, request);
  }
}

TEST(SceneTransferTest, ARequestThatIsWrongIsRefusedByItsField) {
  TransferBytes bytes = EncodeSceneRequest({.want = SceneRequest::Want::kSend, .scene_hash = {}, .offset = 5});
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeSceneRequest(std::span(bytes).first(size)).ok()) << size;
  }
  bytes[1] = 4;
  EXPECT_EQ(DecodeSceneRequest(bytes).status().message(), "scene_request.want: has no such choice");
  bytes[1] = 0;
  EXPECT_FALSE(DecodeSceneRequest(bytes).ok());
  const TransferBytes far =
      EncodeSceneRequest({.want = SceneRequest::Want::kSend, .scene_hash = {}, .offset = kMaxPackedSceneBytes + 1});
  EXPECT_EQ(DecodeSceneRequest(far).status().message(), "scene_request.offset: out of range");
}

TEST(SceneTransferTest, AChunkComesBack) {
  const TransferBytes part(kMaxSceneChunkBytes, 9);
  const TransferBytes bytes =
      EncodeSceneChunk({.total_bytes = 1'000'000, .sha256 = SomeDigest(), .offset = 32768, .bytes = part});
  EXPECT_TRUE(IsSceneMessage(bytes));
  const auto read = DecodeSceneMessage(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  const auto& chunk = std::get<SceneChunk>(*read);
  EXPECT_EQ(chunk.total_bytes, 1'000'000u);
  EXPECT_EQ(chunk.sha256, SomeDigest());
  EXPECT_EQ(chunk.offset, 32768u);
  EXPECT_EQ(TransferBytes(chunk.bytes.begin(), chunk.bytes.end()), part);
}

TEST(SceneTransferTest, AChunkThatLiesBeyondTheSceneIsRefused) {
  const TransferBytes part(10, 9);
  const auto fault = [&](std::uint64_t total, std::uint64_t offset) {
    return std::string(DecodeSceneMessage(EncodeSceneChunk({total, SomeDigest(), offset, part})).status().message());
  };
  EXPECT_EQ(fault(100, 91), "scene_chunk.offset: lies beyond the scene");
  EXPECT_EQ(fault(100, ~0ull), "scene_chunk.offset: lies beyond the scene");
  EXPECT_EQ(fault(kMaxPackedSceneBytes + 1, 0), "scene_chunk.total_bytes: out of range");
  EXPECT_EQ(fault(0, 0), "scene_chunk.total_bytes: out of range");
  EXPECT_TRUE(DecodeSceneMessage(EncodeSceneChunk({100, SomeDigest(), 90, part})).ok());
  EXPECT_FALSE(DecodeSceneMessage(EncodeSceneChunk({100, SomeDigest(), 90, {}})).ok());
}

TEST(SceneTransferTest, ARequestForTilesComesBack) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kMaxTileWishes}) {
    TileRequest request{.number = 70'000, .scene_hash = SomeDigest(), .wishes = {}};
    for (std::uint32_t i = 0; i < count; ++i) request.wishes.push_back({100 - i, std::uint64_t{1000} * i});
    const TransferBytes bytes = EncodeTileRequest(request);
    EXPECT_EQ(KindOf(bytes), DatagramKind::kTileRequest);
    const auto read = DecodeTileRequest(bytes);
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(*read, request);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_FALSE(DecodeTileRequest(std::span(bytes).first(size)).ok()) << size;
    }
  }
}

TEST(SceneTransferTest, ARequestForTilesThatIsWrongIsRefusedByItsField) {
  const auto fault = [](std::vector<TileRequest::Wish> wishes) {
    return std::string(
        DecodeTileRequest(EncodeTileRequest({.number = 1, .scene_hash = {}, .wishes = std::move(wishes)}))
            .status()
            .message());
  };
  EXPECT_EQ(fault({{static_cast<std::uint32_t>(kMaxTiles), 0}}), "tile_request.wishes.tile: out of range");
  EXPECT_EQ(fault({{3, kMaxTile_bytes + 1}}), "tile_request.wishes.offset: out of range");
  EXPECT_EQ(fault({{3, 0}, {4, 0}, {3, 9}}), "tile_request.wishes.tile: stands twice");
  TransferBytes many = EncodeTileRequest({.number = 1, .scene_hash = {}, .wishes = {}});
  many.back() = static_cast<std::uint8_t>(kMaxTileWishes + 1);
  many.resize(many.size() + 3 * kMaxTileWishes + 3, 1);
  EXPECT_EQ(DecodeTileRequest(many).status().message(), "tile_request.wishes: too many");
}

TEST(SceneTransferTest, APartOfATileComesBackAndOneThatIsWrongIsRefused) {
  const TransferBytes part(kMaxSceneChunkBytes, 9);
  const TransferBytes bytes = EncodeTileChunk({.tile = 4711, .offset = 32768, .bytes = part});
  EXPECT_TRUE(IsSceneMessage(bytes));
  const auto read = DecodeSceneMessage(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  const auto& chunk = std::get<TileChunk>(*read);
  EXPECT_EQ(chunk.tile, 4711u);
  EXPECT_EQ(chunk.offset, 32768u);
  EXPECT_EQ(TransferBytes(chunk.bytes.begin(), chunk.bytes.end()), part);
  const auto fault = [&](const TileChunk& wrong) {
    return std::string(DecodeSceneMessage(EncodeTileChunk(wrong)).status().message());
  };
  EXPECT_EQ(fault({.tile = kMaxTiles, .offset = 0, .bytes = part}), "tile_chunk.tile: out of range");
  EXPECT_EQ(fault({.tile = 1, .offset = kMaxTile_bytes + 1, .bytes = part}), "tile_chunk.offset: out of range");
  EXPECT_EQ(fault({.tile = 1, .offset = 0, .bytes = {}}), "tile_chunk.bytes: out of range");
}

TEST(SceneTransferTest, ARefusalSaysWhy) {
  const auto read = DecodeSceneMessage(EncodeSceneRefusal("another scene"));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(std::get<SceneRefusal>(*read).why, "another scene");
}

TEST(SceneTransferTest, AHashIsSixtyFourDigits) {
  const auto digest = DigestFrom("00ff" + std::string(60, 'a'));
  ASSERT_TRUE(digest.ok());
  EXPECT_EQ((*digest)[0], 0);
  EXPECT_EQ((*digest)[1], 255);
  EXPECT_EQ((*digest)[31], 0xaa);
  EXPECT_FALSE(DigestFrom(std::string(63, 'a')).ok());
  EXPECT_FALSE(DigestFrom(std::string(64, 'A')).ok());
}

}  // namespace
}  // namespace tessera::replication

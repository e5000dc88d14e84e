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

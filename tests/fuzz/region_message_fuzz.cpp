// Messages from a region to a client on the reliable channel, and from a client that asks for the scene to a region.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "core/replication/region_message.h"
#include "core/replication/scene_transfer.h"
#include "tests/fuzz/planted_seed.h"

using namespace tessera::replication;

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  const std::vector<std::uint8_t> part(20, 7);
  tessera::fuzz::PlantSeed(*argc, *argv, "chunk",
                           EncodeSceneChunk({.total_bytes = 100, .sha256 = {}, .offset = 80, .bytes = part}));
  tessera::fuzz::PlantSeed(*argc, *argv, "request",
                           EncodeSceneRequest({.want = SceneRequest::Want::kSend, .scene_hash = {}, .offset = 300}));
  tessera::fuzz::PlantSeed(*argc, *argv, "tiles",
                           EncodeTileRequest({.number = 3, .scene_hash = {}, .wishes = {{7, 300}, {900, 0}}}));
  tessera::fuzz::PlantSeed(*argc, *argv, "tile", EncodeTileChunk({.tile = 7, .offset = 300, .bytes = part}));
  // A welcome to player 7 of region 1 with an endpoint; then an event of the game.
  tessera::fuzz::PlantSeed(*argc, *argv, "welcome",
                           std::vector<std::uint8_t>{0x0a, 0x0b, 0x08, 1, 0x18, 7, 0x4a, 5, 0x08, 1, 0x12, 1, 'h'});
  tessera::fuzz::PlantSeed(*argc, *argv, "news",
                           std::vector<std::uint8_t>{0x8a, 0x04, 7, 0x1a, 5, 0x0a, 1, 'n', 0x12, 0});
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  if (const auto request = DecodeSceneRequest(bytes); request.ok()) {
    if (*DecodeSceneRequest(EncodeSceneRequest(*request)) != *request) std::abort();
  }
  if (const auto request = DecodeTileRequest(bytes); request.ok()) {
    if (*DecodeTileRequest(EncodeTileRequest(*request)) != *request) std::abort();
  }
  if (const auto message = DecodeSceneMessage(bytes); message.ok() && !IsSceneMessage(bytes)) std::abort();
  const auto message = DecodeRegionMessage(bytes);
  if (message.ok() && IsSceneMessage(bytes)) std::abort();
  if (!message.ok()) return 0;
  if (const auto* news = std::get_if<MapNews>(&*message)) (void)news->map.Make();
  return 0;
}

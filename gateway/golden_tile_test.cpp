// The golden form of a large level's tiles, as viewers get them: their list, a message among others, and the content of
// one. The list has the hashes of all.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <string>

#include "core/world/byte_view.h"
#include "core/world/testing/tiled_level.h"
#include "gateway/scene_book.h"
#include "gateway/testing/golden.h"
#include "gateway/testing/viewer_decoder.h"

namespace tessera::gateway {
namespace {

TEST(GoldenTileTest, TheListAndTheContentOfATileAreAsEver) {
  const Scene scene = TiledLevel();
  const SceneBook book(scene);
  ViewerDecoder decoder;
  for (std::size_t i = 0; i + 1 < book.messages().size(); ++i) decoder.Take(book.messages()[i]);
  EXPECT_EQ(decoder.shapes, 2u) << "the ball's, and the rock's, which two tiles have";
  ExpectGolden("9-tiles", book.messages().back(), decoder);
  ASSERT_EQ(decoder.tiles.size(), kTiledLevelTiles);
  const auto tiles = decoder.tiles;
  // Numbers of shapes go on from tile to tile.
  nlohmann::ordered_json words;
  std::string content;
  for (std::size_t i = 0; i <= kGoldenTile; ++i) {
    content = *book.TileBy(tiles[i].first);
    words = nlohmann::ordered_json::array();
    ByteReader in(AsBytes(content));
    while (in.ok() && in.remaining() > 0) words.push_back(decoder.Take(in.Block(content.size())));
    ASSERT_TRUE(in.ok()) << in.error();
  }
  ExpectGoldenFile("10-tile.content", content);
  ExpectGoldenFile("10-tile.json", WordsText(words));
  ASSERT_EQ(words.size(), 3u);
  EXPECT_EQ(words[0].at("message"), "shapes");
  EXPECT_EQ(words[0].at("shapes").size(), 3u) << "parts of the hills and of the road, and the crate's";
  EXPECT_EQ(words[1].at("message"), "visuals");
  EXPECT_EQ(words[2].at("statics").size(), 4u) << "and a rock, whose shape is the scene's";
}

}  // namespace
}  // namespace tessera::gateway

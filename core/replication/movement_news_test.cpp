#include "core/replication/movement_news.h"

#include <gtest/gtest.h>

#include "core/replication/datagram.h"

namespace tessera::replication {
namespace {

MovementNews CarNews() {
  MovementNews news{.tick = Tick(1234), .name = "car", .state = {.body = BodyId(17), .version = 3, .size = 5}};
  for (std::uint8_t i = 0; i < 5; ++i) news.state.bytes[i] = static_cast<std::uint8_t>(200 + i);
  return news;
}

TEST(MovementNewsTest, ComesBackAsItWas) {
  const std::vector<std::uint8_t> bytes = EncodeMovementNews(CarNews());
  EXPECT_EQ(KindOf(bytes), DatagramKind::kMovement);
  const auto read = DecodeMovementNews(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, CarNews());
}

TEST(MovementNewsTest, TheLongestFitsTheLimit) {
  MovementNews news{.tick = Tick(kMaxTick), .name = std::string(TESSERA_MAX_MOVEMENT_NAME, 'n'), .state = {}};
  news.state.body = BodyId(~std::uint64_t{0});
  news.state.version = ~std::uint32_t{0};
  news.state.size = TESSERA_MAX_MOVEMENT_STATE;
  const std::vector<std::uint8_t> bytes = EncodeMovementNews(news);
  EXPECT_LE(bytes.size(), kMaxMovementNewsBytes);
  EXPECT_TRUE(DecodeMovementNews(bytes).ok());
}

TEST(MovementNewsTest, EachFaultIsNamed) {
  const std::vector<std::uint8_t> good = EncodeMovementNews(CarNews());
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(DecodeMovementNews(std::span(good).first(size)).status().code(), absl::StatusCode::kInvalidArgument);
  }
  const auto why = [](const std::vector<std::uint8_t>& bytes) {
    return std::string(DecodeMovementNews(bytes).status().message());
  };
  std::vector<std::uint8_t> bad = good;
  bad.push_back(0);
  EXPECT_EQ(why(bad), "movement: trailing bytes");
  bad = good;
  bad[1] = 9;
  EXPECT_EQ(why(bad), "movement: format 9, expected 1");
  bad[0] = static_cast<std::uint8_t>(DatagramKind::kSnapshot);
  EXPECT_EQ(why(bad), "movement.kind: not of a movement");
  MovementNews news = CarNews();
  news.state = {};
  EXPECT_EQ(why(EncodeMovementNews(news)), "movement.state: is nobody's");
  news = CarNews();
  news.name.clear();
  EXPECT_EQ(why(EncodeMovementNews(news)), "movement.name: is empty");
  news.name.assign(TESSERA_MAX_MOVEMENT_NAME + 1, 'n');
  EXPECT_EQ(why(EncodeMovementNews(news)), "movement.name: too long");
}

}  // namespace
}  // namespace tessera::replication

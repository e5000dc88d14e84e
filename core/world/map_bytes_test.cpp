#include "core/world/map_bytes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/world/limits.h"
#include "core/world/partition_io.h"

namespace tessera {
namespace {

using ::testing::HasSubstr;

std::vector<std::uint8_t> BytesOf(const PartitionMap& map) {
  ByteWriter out;
  WriteMap(map, out);
  return out.Take();
}

absl::StatusOr<PartitionMap> MapFrom(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  absl::StatusOr<PartitionMap> map = ReadMap(in);
  EXPECT_TRUE(!map.ok() || in.remaining() == 0);
  return map;
}

PartitionMap MapOfMany() {
  std::vector<Cell> cells{{{-8, -8, 0, 8}, RegionId(3), Epoch(7), RegionId(900)},
                          {{0, -8, 8, 8}, RegionId(900), Epoch(4'000'000'000), RegionId()}};
  std::vector<MapRegion> regions{{RegionId(3), RegionId(900)}, {RegionId(900), RegionId()}};
  const auto map = PartitionMap::Create(MapVersion(1ull << 50), {-8, -8, 8, 8}, std::move(cells), std::move(regions));
  EXPECT_TRUE(map.ok()) << map.status();
  return map->With({.paused = true, .ticks_per_second = 12.5, .game = 300});
}

TEST(MapBytesTest, ReadsWhatItWrote) {
  std::vector<PartitionMap> maps{MapOfMany()};
  for (const std::uint32_t n : {1u, 2u, 3u, 17u, 100u, kMaxRegions}) {
    maps.push_back(*MakeGridMap({-100, -50, 100, 250}, n));
  }
  for (const PartitionMap& map : maps) {
    const auto read = MapFrom(BytesOf(map));
    ASSERT_TRUE(read.ok()) << read.status();
    EXPECT_EQ(*read, map);
  }
}

TEST(MapBytesTest, EveryBeginningOfAMapIsTruncated) {
  const std::vector<std::uint8_t> bytes = BytesOf(MapOfMany());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const auto read = MapFrom(std::span(bytes).first(size));
    ASSERT_EQ(read.status().code(), absl::StatusCode::kInvalidArgument) << size;
    EXPECT_THAT(std::string(read.status().message()), HasSubstr(": ")) << size;
  }
}

TEST(MapBytesTest, NamesTheFieldThatIsWrong) {
  const auto fault = [](const PartitionMap& map) { return std::string(MapFrom(BytesOf(map)).status().message()); };
  EXPECT_EQ(fault(PartitionMap()), "version: must not be 0");
  EXPECT_THAT(fault(MapOfMany().With({.paused = false, .ticks_per_second = 0.5, .game = 0})),
              HasSubstr("terms.ticks_per_second: 0.5"));
  std::vector<std::uint8_t> bytes = BytesOf(*MakeGridMap({0, 0, 1, 1}, 1));
  bytes[1 + 4 * 8] = 200;  // the number of cells, of two bytes now
  EXPECT_THAT(std::string(MapFrom(bytes).status().message()), HasSubstr("cells: truncated"));
}

TEST(MapBytesTest, RefusesTheTermsThatTheMessageRefuses) {
  for (const double pace : {0.0, kMinTicksPerSecond, 60.0, double{kMaxTickRateHz}}) {
    EXPECT_TRUE(CheckTerms({.paused = false, .ticks_per_second = pace, .game = 0}).ok()) << pace;
  }
  for (const double pace : {-1.0, 0.99, kMaxTickRateHz + 1.0}) {
    v1::WorldTerms message;
    message.set_ticks_per_second(pace);
    const absl::Status refused = CheckTerms({.paused = false, .ticks_per_second = pace, .game = 0});
    EXPECT_FALSE(refused.ok()) << pace;
    EXPECT_EQ(refused, FromProto(message).status());
  }
}

}  // namespace
}  // namespace tessera

#include "core/replication/region_figures.h"

#include <gtest/gtest.h>

#include "core/replication/datagram.h"

namespace tessera::replication {
namespace {

RegionFigures BusyRegion() {
  return {.tick = Tick(123'456),
          .owned = 1500,
          .ghosts = 220,
          .asleep = 900,
          .clients = 12,
          .step = {7'400, 22'000'000'000},
          .physics = {7'400, 14'000'000'000},
          .prediction = {7'400, 2'000'000'000},
          .snapshot_full = {31, 90'000'000},
          .snapshot_delta = {3'700, 4'000'000'000},
          .memory = {.process_virtual_bytes = 900ull << 20,
                     .process_physical_bytes = 80ull << 20,
                     .host_virtual_usable_bytes = 60ull << 30,
                     .host_virtual_total_bytes = 66ull << 30,
                     .host_physical_usable_bytes = 58ull << 30,
                     .host_physical_total_bytes = 64ull << 30}};
}

TEST(RegionFiguresTest, ComeOutAsTheyWentIn) {
  const auto bytes = EncodeRegionFigures(BusyRegion());
  EXPECT_EQ(KindOf(bytes), DatagramKind::kRegionFigures);
  const auto read = DecodeRegionFigures(bytes);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, BusyRegion());
}

// A message a second must be small beside snapshots.
TEST(RegionFiguresTest, AreSmall) {
  EXPECT_LE(EncodeRegionFigures(BusyRegion()).size(), 90u);
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  RegionFigures largest = BusyRegion();
  largest.tick = Tick(kMaxTick);
  for (WorkFigures* work : {&largest.step, &largest.physics, &largest.prediction}) *work = {kMost, kMost};
  const auto bytes = EncodeRegionFigures(largest);
  EXPECT_LE(bytes.size(), kMaxRegionFiguresBytes);
  EXPECT_EQ(DecodeRegionFigures(bytes).value(), largest);
}

TEST(RegionFiguresTest, RefusesWhatIsCutShortOrTooLong) {
  auto bytes = EncodeRegionFigures(BusyRegion());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(DecodeRegionFigures(std::span(bytes).first(size)).ok()) << size;
  }
  bytes.push_back(0);
  EXPECT_EQ(DecodeRegionFigures(bytes).status().message(), "figures: trailing bytes");
}

TEST(RegionFiguresTest, RefusesAnotherKindFormatOrRange) {
  const auto good = EncodeRegionFigures(BusyRegion());
  auto bytes = good;
  bytes[0] = static_cast<std::uint8_t>(DatagramKind::kSnapshot);
  EXPECT_EQ(DecodeRegionFigures(bytes).status().message(), "figures.kind: not of figures");
  bytes = good;
  bytes[1] = 2;
  EXPECT_EQ(DecodeRegionFigures(bytes).status().message(), "figures: format 2, expected 1");
  RegionFigures figures = BusyRegion();
  figures.tick = Tick(kMaxTick + 1);
  EXPECT_EQ(DecodeRegionFigures(EncodeRegionFigures(figures)).status().message(), "figures.tick: out of range");
  // More KiB than bytes can be counted: nine bytes of all ones and a one.
  bytes = EncodeRegionFigures(RegionFigures());
  bytes.pop_back();
  bytes.insert(bytes.end(), 9, 0xff);
  bytes.push_back(1);
  EXPECT_EQ(DecodeRegionFigures(bytes).status().message(), "figures: out of range");
}

}  // namespace
}  // namespace tessera::replication

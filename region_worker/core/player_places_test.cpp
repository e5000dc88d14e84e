#include "region_worker/core/player_places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/world/bytes.h"
#include "core/world/limits.h"
#include "region_worker/core/link_message.h"

namespace tessera::worker {
namespace {

constexpr std::uint32_t kRate_hz = 60;

// The body of one player, as a region owns it.
struct Owner {
  explicit Owner(std::uint32_t number) : player(number) {}
  void Follow(Tick tick, Epoch epoch, Vec3d position, TeamId team = 0) {
    places.Report(player, epoch, tick, position, team);
  }
  PlayerNumber player;
  PlayerPlaces places{kRate_hz};
};

// The content of a message after the byte that names its kind.
std::span<const std::uint8_t> Inside(const std::vector<std::uint8_t>& message) {
  const auto read = ReadLinkMessage(message);
  EXPECT_TRUE(read.has_value() && read->kind == LinkMessageKind::kPlaces);
  return read->bytes;
}

std::vector<std::uint8_t> PlaceOf(std::uint32_t player, std::uint32_t epoch, std::uint64_t tick, Vec3f position) {
  ByteWriter writer;
  writer.Varint(1);
  writer.Varint(player);
  writer.Varint(epoch);
  writer.Varint(tick);
  writer.V(position);
  writer.Varint(0);
  return writer.Take();
}

TEST(PlayerPlacesTest, ComeFromTheOwnerToRegionsThatAreNoNeighboursOfIt) {
  Owner owner(3);
  owner.Follow(Tick(100), Epoch(2), {1, 2, 3}, 7);
  PlayerPlaces between(kRate_hz), far(kRate_hz);
  const auto report = owner.places.Write(Tick(100));
  ASSERT_TRUE(between.Receive(Inside(report), Tick(101)).ok());
  const auto passed_on = between.Write(Tick(101));
  ASSERT_TRUE(far.Receive(Inside(passed_on), Tick(102)).ok());
  EXPECT_EQ(far.At(PlayerNumber(3), Tick(102)), Vec3d(1, 2, 3));
  EXPECT_EQ(far.TeamAt(PlayerNumber(3), Tick(102)), TeamId{7});
  EXPECT_EQ(far.TeamAt(PlayerNumber(4), Tick(102)), TeamId{0});
  EXPECT_EQ(far.At(PlayerNumber(4), Tick(102)), std::nullopt);
}

// Numbers are not given again; but a report holds only so many at one time.
TEST(PlayerPlacesTest, PlayersOfAnyNumberAreHeardButNotOfAnyCount) {
  PlayerPlaces places(kRate_hz);
  constexpr std::uint32_t kFirst = 50'001, kLast = kFirst + 2 * kMaxPlayers;
  for (std::uint32_t player = kFirst; player <= kLast; ++player) {
    ASSERT_TRUE(places.Receive(PlaceOf(player, 1, 100, {1, 2, 3}), Tick(100)).ok());
  }
  EXPECT_EQ(places.At(PlayerNumber(kFirst), Tick(100)), Vec3d(1, 2, 3));
  EXPECT_EQ(places.At(PlayerNumber(kLast), Tick(100)), std::nullopt);
}

TEST(PlayerPlacesTest, GoRoundACircleOnce) {
  Owner owner(3);
  owner.Follow(Tick(100), Epoch(2), {1, 2, 3});
  const auto report = owner.places.Write(Tick(100));
  PlayerPlaces other(kRate_hz);
  ASSERT_TRUE(other.Receive(Inside(report), Tick(101)).ok());
  const auto back = other.Write(Tick(101));
  ASSERT_TRUE(owner.places.Receive(Inside(back), Tick(110)).ok());
  EXPECT_TRUE(owner.places.Write(Tick(110)).empty());
  ASSERT_TRUE(other.Receive(Inside(report), Tick(110)).ok());
  EXPECT_TRUE(other.Write(Tick(110)).empty());
}

TEST(PlayerPlacesTest, AreToldWhenTheyMoveAndOtherwiseOnceASecond) {
  Owner owner(3);
  int reports = 0;
  for (std::uint64_t tick = 100; tick < 100 + 10 * kRate_hz; ++tick) {
    owner.Follow(Tick(tick), Epoch(1), {});
    reports += owner.places.Write(Tick(tick)).empty() ? 0 : 1;
  }
  EXPECT_EQ(reports, 10);
  for (std::uint64_t tick = 700; tick < 700 + 10 * kRate_hz; ++tick) {
    owner.Follow(Tick(tick), Epoch(1), {static_cast<double>(tick), 0, 0});
    reports += owner.places.Write(Tick(tick)).empty() ? 0 : 1;
  }
  EXPECT_EQ(reports, 10 + 100);  // ten times a second
}

TEST(PlayerPlacesTest, TheHigherEpochCountsThenTheLaterTick) {
  PlayerPlaces places(kRate_hz);
  const auto at = [&] { return places.At(PlayerNumber(1), Tick(200)); };
  ASSERT_TRUE(places.Receive(PlaceOf(1, 2, 190, {1, 0, 0}), Tick(200)).ok());
  ASSERT_TRUE(places.Receive(PlaceOf(1, 2, 189, {2, 0, 0}), Tick(200)).ok());
  EXPECT_EQ(at(), Vec3d(1, 0, 0));
  ASSERT_TRUE(places.Receive(PlaceOf(1, 1, 199, {3, 0, 0}), Tick(200)).ok());
  EXPECT_EQ(at(), Vec3d(1, 0, 0));
  ASSERT_TRUE(places.Receive(PlaceOf(1, 3, 180, {4, 0, 0}), Tick(200)).ok());
  EXPECT_EQ(at(), Vec3d(4, 0, 0));
}

TEST(PlayerPlacesTest, AnOldWordCountsNoMore) {
  PlayerPlaces places(kRate_hz);
  ASSERT_TRUE(places.Receive(PlaceOf(1, 2, 190, {1, 0, 0}), Tick(200)).ok());
  EXPECT_TRUE(places.At(PlayerNumber(1), Tick(300)).has_value());
  EXPECT_FALSE(places.At(PlayerNumber(1), Tick(190 + 5 * kRate_hz)).has_value());
}

TEST(PlayerPlacesTest, AWordOfAFarTickDoesNotStayTheNewest) {
  PlayerPlaces places(kRate_hz);
  ASSERT_TRUE(places.Receive(PlaceOf(1, 2, 1'000'000'000, {9, 9, 9}), Tick(200)).ok());
  EXPECT_EQ(places.At(PlayerNumber(1), Tick(200)), std::nullopt);
}

TEST(PlayerPlacesTest, BadMessagesChangeNothing) {
  PlayerPlaces places(kRate_hz);
  const auto good = PlaceOf(1, 2, 190, {1, 2, 3});
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(places.Receive(std::span(good).first(size), Tick(200)).ok()) << size;
  }
  auto longer = good;
  longer.push_back(0);
  EXPECT_FALSE(places.Receive(longer, Tick(200)).ok());
  EXPECT_FALSE(places.Receive(PlaceOf(0, 2, 190, {}), Tick(200)).ok());
  EXPECT_FALSE(places.Receive(PlaceOf(1, 2, 190, {std::numeric_limits<float>::quiet_NaN(), 0, 0}), Tick(200)).ok());
  EXPECT_FALSE(places.Receive(PlaceOf(1, 2, 190, {0, 0, 1e30f}), Tick(200)).ok());
  EXPECT_EQ(places.At(PlayerNumber(1), Tick(200)), std::nullopt);
  EXPECT_TRUE(places.Write(Tick(200)).empty());
}

}  // namespace
}  // namespace tessera::worker

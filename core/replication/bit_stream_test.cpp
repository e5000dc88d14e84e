#include "core/replication/bit_stream.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace tessera::replication {
namespace {

constexpr std::uint8_t kBands[] = {0, 3, 7};

std::uint64_t AnyNumber(std::mt19937_64& random, int bits) { return bits == 0 ? 0 : random() >> (64 - bits); }

TEST(BitStreamTest, GivesBackWhatWasWritten) {
  std::mt19937_64 random(1);
  for (int round = 0; round < 200; ++round) {
    std::vector<std::pair<std::uint64_t, int>> plain;
    std::vector<std::uint64_t> varints, banded;
    BitWriter writer;
    for (int i = 0; i < 50; ++i) {
      const int bits = static_cast<int>(random() % 65);
      plain.emplace_back(AnyNumber(random, bits), bits);
      writer.Write(plain.back().first, bits);
      varints.push_back(AnyNumber(random, static_cast<int>(random() % 65)));
      writer.WriteVarint(varints.back());
      banded.push_back(AnyNumber(random, static_cast<int>(random() % 64)));
      writer.WriteBanded(banded.back(), kBands);
    }
    const std::vector<std::uint8_t> bytes = writer.Finish();
    BitReader reader(bytes);
    for (std::size_t i = 0; i < plain.size(); ++i) {
      EXPECT_EQ(reader.Read(plain[i].second), plain[i].first);
      EXPECT_EQ(reader.ReadVarint(), varints[i]);
      EXPECT_EQ(reader.ReadBanded(kBands), banded[i]);
    }
    EXPECT_TRUE(reader.AtEnd());
  }
}

TEST(BitStreamTest, BandsCostWhatTheySay) {
  const auto cost = [](std::uint64_t value) {
    BitWriter writer;
    writer.WriteBanded(value, kBands);
    return writer.bit_count();
  };
  EXPECT_EQ(cost(0), 1u);
  EXPECT_EQ(cost(1), 2u + 3u);
  EXPECT_EQ(cost(8), 2u + 3u);
  EXPECT_EQ(cost(9), 3u + 7u);
  EXPECT_EQ(cost(136), 3u + 7u);
  EXPECT_EQ(cost(137), 3u + 8u);
}

TEST(BitStreamTest, RewindingUndoes) {
  for (int before = 0; before < 70; ++before) {
    BitWriter writer, plain;
    for (int i = 0; i < before; ++i) {
      writer.WriteBit(i % 3 == 0);
      plain.WriteBit(i % 3 == 0);
    }
    const BitWriter::Mark mark = writer.mark();
    writer.Write(0x123456789abcdef, 60);
    writer.Rewind(mark);
    writer.Write(5, 3);
    plain.Write(5, 3);
    EXPECT_EQ(writer.Finish(), plain.Finish()) << before;
  }
}

TEST(BitStreamTest, ReadingPastTheEndGivesZerosAndIsNotOk) {
  const std::vector<std::uint8_t> bytes = {0xff, 0xff, 0xff};
  BitReader reader(bytes);
  EXPECT_EQ(reader.Read(20), 0xfffffu);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(reader.Read(5), 0u);
  EXPECT_FALSE(reader.ok());
  EXPECT_EQ(reader.Read(64), 0u);
  EXPECT_EQ(reader.ReadVarint(), 0u);
  EXPECT_EQ(reader.ReadBanded(kBands), 0u);
  EXPECT_FALSE(reader.AtEnd());
  BitReader nothing({});
  EXPECT_TRUE(nothing.AtEnd());
  EXPECT_FALSE(nothing.ReadBit());
  EXPECT_FALSE(nothing.ok());
}

// Most reads take a word of bytes at once; those close to the end cannot.
TEST(BitStreamTest, ReadsTheSameCloseToTheEndAsFarFromIt) {
  std::mt19937_64 random(2);
  for (std::size_t size = 0; size <= 24; ++size) {
    std::vector<std::uint8_t> bytes(size), longer(size + 16);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    std::copy(bytes.begin(), bytes.end(), longer.begin());
    for (int round = 0; round < 200; ++round) {
      BitReader close(bytes), far(longer);
      for (std::size_t left = size * 8; left > 0;) {
        const int bits = static_cast<int>(random() % (std::min<std::size_t>(left, 64) + 1));
        ASSERT_EQ(close.Read(bits), far.Read(bits)) << size << " bytes, " << left << " bits left";
        left -= static_cast<std::size_t>(bits);
      }
      ASSERT_TRUE(close.ok() && close.AtEnd());
      ASSERT_EQ(close.Read(1), 0u);
      ASSERT_FALSE(close.ok());
    }
  }
}

TEST(BitStreamTest, AVarintThatNeverEndsIsNotOk) {
  const std::vector<std::uint8_t> bytes(40, 0xff);
  BitReader reader(bytes);
  reader.ReadVarint();
  EXPECT_FALSE(reader.ok());
}

TEST(BitStreamTest, OnlyZerosMayFillTheLastByte) {
  const std::vector<std::uint8_t> clean = {0x05}, dirty = {0x85}, long_tail = {0x05, 0x00};
  for (const auto& [bytes, expected] : {std::pair{clean, true}, std::pair{dirty, false}, std::pair{long_tail, false}}) {
    BitReader reader(bytes);
    EXPECT_EQ(reader.Read(3), 5u);
    EXPECT_EQ(reader.AtEnd(), expected);
  }
}

TEST(BitStreamTest, ZigZagIsOneToOne) {
  for (const std::int64_t v : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{1}, std::int64_t{-1000000},
                               std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
    EXPECT_EQ(UnZigZag(ZigZag(v)), v);
  }
  EXPECT_EQ(ZigZag(-1), 1u);
  EXPECT_EQ(ZigZag(1), 2u);
}

}  // namespace
}  // namespace tessera::replication

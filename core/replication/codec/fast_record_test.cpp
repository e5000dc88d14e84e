#include "core/replication/codec/fast_list.h"

#include <gtest/gtest.h>

#include <random>

#include "core/replication/testing/arena.h"

namespace tessera::replication {
namespace {

class FastRecordTest : public testing::Test {
 protected:
  std::int64_t Within(std::int64_t limit) {
    if (random_() % 6 == 0) return random_() % 2 == 0 ? limit : -limit;
    const std::int64_t range = random_() % 2 == 0 ? limit : std::min<std::int64_t>(limit, 40);
    return static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(2 * range + 1)) - range;
  }
  QuantizedState Any(const QuantizedState& near) {
    QuantizedState s = near;
    const bool wild = random_() % 3 == 0;
    if (random_() % 4 != 0) {
      for (std::int64_t& c : s.position) c = wild ? Within(kMaxPosition) : c + Within(40);
      for (std::int64_t& c : s.position) c = std::clamp(c, -kMaxPosition, kMaxPosition);
    }
    if (random_() % 4 != 0) {
      for (std::int16_t& c : s.smallest) c = static_cast<std::int16_t>(Within(limit()));
      if (wild) s.largest = static_cast<std::uint8_t>(random_() % 4);
    }
    s.asleep = random_() % 3 == 0;
    return s;
  }
  std::int32_t limit() const { return quantizer_.orientation_limit(); }

  std::mt19937_64 random_{1};
  SnapshotSettings settings_{.orientation_bits = 16};
  Quantizer quantizer_{kBounds, settings_};
  PosePredictor predictor_{quantizer_, settings_, -9.81};
};

TEST_F(FastRecordTest, AnyPoseComesBackFromAnySamples) {
  for (int i = 0; i < 50'000; ++i) {
    const QuantizedState oldest = Any({}), older = Any(oldest), base = Any(older), state = Any(base);
    const Prediction prediction = predictor_.Predict({.base = &base,
                                                      .older = i % 3 > 0 ? &older : nullptr,
                                                      .oldest = i % 3 > 1 ? &oldest : nullptr,
                                                      .ticks = 1 + random_() % 300,
                                                      .gap = 1 + random_() % 10,
                                                      .gap2 = 1 + random_() % 10});
    const PackedRecord packed = PackPose(prediction, base, state, limit());
    BitWriter writer;
    writer.Write(5, 3);  // wherever in a datagram
    packed.AppendTo(writer);
    writer.Write(1, 1);
    ASSERT_EQ(writer.bit_count(), static_cast<std::size_t>(packed.bits) + 4);
    const std::vector<std::uint8_t> bytes = writer.Finish();
    BitReader reader(bytes);
    ASSERT_EQ(reader.Read(3), 5u);
    QuantizedState got;
    ASSERT_TRUE(ReadPose(reader, prediction, base, limit(), got));
    ASSERT_EQ(got, state);
    ASSERT_TRUE(reader.ReadBit());
    ASSERT_TRUE(reader.AtEnd());
    // Cut anywhere, it is an error.
    for (std::size_t size = 0; size + 1 < bytes.size(); ++size) {
      BitReader cut(std::span<const std::uint8_t>(bytes).first(size));
      (void)cut.Read(3);
      const bool read = ReadPose(cut, prediction, base, limit(), got);
      (void)cut.ReadBit();
      ASSERT_FALSE(read && cut.ok());
    }
  }
}

TEST_F(FastRecordTest, NoiseIsAnErrorOrInRange) {
  for (int i = 0; i < 50'000; ++i) {
    const QuantizedState older = Any({}), base = Any(older);
    const Prediction prediction =
        predictor_.Predict({.base = &base, .older = &older, .oldest = nullptr, .ticks = 6, .gap = 3, .gap2 = 0});
    std::vector<std::uint8_t> noise(random_() % 80);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(i % 4 == 0 ? 0xff : random_());
    BitReader reader(noise);
    QuantizedState got;
    if (!ReadPose(reader, prediction, base, limit(), got)) continue;
    for (const std::int64_t c : got.position) ASSERT_LE(std::abs(c), kMaxPosition);
    for (const std::int16_t c : got.smallest) ASSERT_LE(std::abs(c), limit());
    ASSERT_LT(got.largest, 4);
  }
}

TEST_F(FastRecordTest, WhatGoesAsPredictedCostsAFewBits) {
  QuantizedState older, base, state;
  base.position = {60, 0, 0};
  state.position = {180, 0, 0};
  const Prediction prediction =
      predictor_.Predict({.base = &base, .older = &older, .oldest = nullptr, .ticks = 6, .gap = 3, .gap2 = 0});
  EXPECT_LE(PackPose(prediction, base, state, limit()).bits, 25);
}

TEST_F(FastRecordTest, ListsComeBackAndEndWhereTheyShould) {
  for (int run = 0; run < 500; ++run) {
    std::vector<PackedRecord> records(random_() % 60);
    std::vector<FastItem> items;
    std::uint64_t id = 0;
    for (PackedRecord& record : records) {
      record.Append(random_() % 128, 7);
      id += 1 + (random_() % 5 == 0 ? random_() >> 8 : random_() % 40);
      const std::uint64_t gap = random_() % 4;
      const SampleTicks mixed{1 + random_() % 100, gap, gap == 0 ? 0 : random_() % 9};
      items.push_back({BodyId(id), run % 2 == 0 ? SampleTicks{6, 2, 3} : mixed, record.view()});
    }
    BitWriter writer;
    WriteFastList(writer, items);
    const std::vector<std::uint8_t> bytes = writer.Finish();
    for (std::size_t size = 0; size <= bytes.size(); ++size) {
      BitReader reader(std::span<const std::uint8_t>(bytes).first(size));
      FastListReader list(reader);
      BodyId got;
      SampleTicks samples;
      std::size_t n = 0;
      while (list.Next(got, samples)) {
        const std::uint64_t bits = reader.Read(7);
        if (!reader.ok()) break;
        ASSERT_LT(n, items.size());
        ASSERT_EQ(got, items[n].id);
        ASSERT_EQ(samples, items[n].samples);
        ASSERT_EQ(bits, items[n].record.words[0]);
        ++n;
      }
      ASSERT_TRUE(list.ok());
      ASSERT_EQ(reader.ok(), size == bytes.size()) << size << " of " << bytes.size();
      ASSERT_TRUE(size < bytes.size() || (n == items.size() && reader.AtEnd()));
    }
  }
}

TEST_F(FastRecordTest, GolombCodesEndWhereTheirNumbersDo) {
  constexpr int kMaxBits = 47;
  for (const int k : {0, 1, 6, 20}) {
    for (const std::int64_t residual : {std::int64_t{0}, (std::int64_t{1} << 46) - 1, -(std::int64_t{1} << 46)}) {
      PackedRecord packed;
      AppendGolomb(packed, residual, k);
      BitWriter writer;
      packed.AppendTo(writer);
      const std::vector<std::uint8_t> bytes = writer.Finish();
      BitReader reader(bytes);
      std::int64_t got = 0;
      ASSERT_TRUE(ReadGolomb(reader, k, kMaxBits, got)) << "k " << k << ", " << residual;
      EXPECT_EQ(got, residual);
    }
    // Whatever says that it is longer is no number of that range: nothing of it is read.
    for (int n = 0; n < 64; ++n) {
      BitWriter writer;
      writer.Write((std::uint64_t{1} << n) - 1, n);
      writer.WriteBit(false);
      for (int i = 0; i < 4; ++i) writer.Write(~std::uint64_t{0}, 64);
      const std::vector<std::uint8_t> bytes = writer.Finish();
      BitReader reader(bytes);
      std::int64_t got = 0;
      EXPECT_EQ(ReadGolomb(reader, k, kMaxBits, got), k + n <= kMaxBits) << "k " << k << ", n " << n;
    }
  }
}

// Short codes are read out of one word, long ones and the last ones bit by bit.
TEST_F(FastRecordTest, GolombCodesOfAnyLengthFollowEachOther) {
  constexpr int kMaxBits = 47;
  std::mt19937_64 random(5);
  for (int round = 0; round < 300; ++round) {
    std::vector<std::pair<std::int64_t, int>> numbers;
    BitWriter writer;
    for (int i = 0; i < 30; ++i) {
      const int bits = 1 + static_cast<int>(random() % 46), k = static_cast<int>(random() % 21);
      numbers.emplace_back(UnZigZag(random() >> (64 - bits)), k);
      PackedRecord packed;
      AppendGolomb(packed, numbers.back().first, k);
      packed.AppendTo(writer);
    }
    const std::vector<std::uint8_t> bytes = writer.Finish();
    BitReader reader(bytes), truncated({bytes.data(), bytes.size() - 1});
    for (const auto& [number, k] : numbers) {
      std::int64_t got = 0;
      ASSERT_TRUE(ReadGolomb(reader, k, kMaxBits, got));
      ASSERT_EQ(got, number) << "k " << k;
      (void)ReadGolomb(truncated, k, kMaxBits, got);
    }
    ASSERT_TRUE(reader.AtEnd());
    ASSERT_FALSE(truncated.ok());
  }
}

}  // namespace
}  // namespace tessera::replication

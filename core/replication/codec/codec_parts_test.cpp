// The parts of the codecs: coder, models, whole-number rotations, predictions, checksums.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string_view>

#include "core/replication/codec/checksum.h"
#include "core/replication/codec/number_model.h"
#include "core/replication/codec/predict.h"
#include "core/replication/codec/standing_box.h"
#include "core/replication/testing/arena.h"

namespace tessera::replication {
namespace {

TEST(RangeCoderTest, BitsComeBackAtAnyOdds) {
  std::mt19937 random(1);
  for (int run = 0; run < 300; ++run) {
    std::vector<std::pair<bool, std::uint32_t>> bits(random() % 400);
    RangeEncoder encoder;
    for (auto& [bit, odds] : bits) {
      odds = 1 + static_cast<std::uint32_t>(random() % 65535);
      if (run % 3 == 0) odds = random() % 2 == 0 ? 1 : 65535;
      bit = run % 5 == 0 ? false : random() % 65536 < odds;
      encoder.Encode(bit, odds);
    }
    const std::vector<std::uint8_t> bytes = encoder.Finish();
    RangeDecoder decoder(bytes);
    for (const auto& [bit, odds] : bits) ASSERT_EQ(decoder.Decode(odds), bit);
  }
}

TEST(RangeCoderTest, LikelyBitsCostWhatTheyShould) {
  constexpr int kBits = 100'000;
  std::mt19937 random(2);
  RangeEncoder encoder;
  BitModel model;
  for (int i = 0; i < kBits; ++i) {
    bool bit = random() % 100 < 5;
    Code(encoder, bit, model);
  }
  const double entropy = -(0.05 * std::log2(0.05) + 0.95 * std::log2(0.95));
  EXPECT_NEAR(static_cast<double>(encoder.Finish().size()) * 8 / kBits, entropy, 0.03);
}

TEST(NumberModelTest, AnyNumberComesBack) {
  std::mt19937_64 random(3);
  std::vector<std::int64_t> numbers{0, 1, -1, (std::int64_t{1} << 62) - 1, -(std::int64_t{1} << 62) + 1};
  for (int i = 0; i < 5000; ++i) {
    const auto bits = static_cast<int>(random() % 62);
    const auto magnitude = static_cast<std::int64_t>(random() & ((std::uint64_t{1} << bits) - 1));
    numbers.push_back(random() % 2 == 0 ? magnitude : -magnitude);
  }
  RangeEncoder encoder;
  PlainNumber writer, reader;
  for (std::int64_t number : numbers) Code(encoder, number, writer);
  const std::vector<std::uint8_t> bytes = encoder.Finish();
  RangeDecoder decoder(bytes);
  for (const std::int64_t number : numbers) {
    std::int64_t got = 0;
    Code(decoder, got, reader);
    ASSERT_EQ(got, number);
  }
}

TEST(RotationTest, SquareRootIsTheFloor) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 10'000; ++i) {
    const std::uint64_t value = random() >> (random() % 64);
    const std::uint64_t root = SquareRoot(value);
    ASSERT_LE(root * root, value);
    ASSERT_TRUE(root == 0xffffffff || (root + 1) * (root + 1) > value);
  }
  EXPECT_EQ(SquareRoot(~std::uint64_t{0}), 0xffffffffu);
}

TEST(RotationTest, SmallestThreeComeBack) {
  std::mt19937 random(5);
  const Quantizer quantizer(kBounds, {});
  for (int i = 0; i < 5000; ++i) {
    std::normal_distribution<double> normal;
    BodyState body;
    body.orientation = Normalized(Quatd(normal(random), normal(random), normal(random), normal(random)));
    const QuantizedState state = quantizer.Quantize(body);
    const FixedQuaternion q = ToFixed(state, quantizer.orientation_limit());
    ASSERT_EQ(ToSmallest(q, state.largest, quantizer.orientation_limit()), state.smallest);
  }
}

BodyState Spinning(double seconds, Vec3d omega) {
  BodyState body;
  const double angle = Length(omega) * seconds;
  const Vec3d axis = angle == 0 ? Vec3d() : omega * (std::sin(angle / 2) / Length(omega));
  body.orientation = {axis.x, axis.y, axis.z, std::cos(angle / 2)};
  return body;
}

// Closed form: what turns steadily is where it turns to, but for what quantising the two samples costs.
TEST(PredictTest, SteadySpinIsFoundFromPosesAlone) {
  SnapshotSettings settings;
  settings.orientation_bits = 15;
  const Quantizer quantizer(kBounds, settings);
  const PosePredictor predictor(quantizer, settings, -9.81);
  const Vec3d omega(2, 8, -4);
  const auto at = [&](int tick) { return quantizer.Quantize(Spinning(tick / 60.0, omega)); };
  for (const int gap : {1, 2, 3, 7}) {
    const QuantizedState base = at(20), older = at(20 - gap), truth = at(26);
    const Prediction prediction =
        predictor.Predict({.base = &base, .older = &older, .ticks = 6, .gap = static_cast<std::uint64_t>(gap)});
    const auto smallest = ToSmallest(prediction.orientation, truth.largest, quantizer.orientation_limit());
    // Half a step of each sample, stretched over six ticks; and the straight line for part of a gap.
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(smallest[i], truth.smallest[i], 60) << "gap " << gap;
  }
}

TEST(PredictTest, WhatFliesFallsOnAParabola) {
  const SnapshotSettings settings;
  const Quantizer quantizer(kBounds, settings);
  const PosePredictor predictor(quantizer, settings, -9.81);
  const auto at = [&](int tick) {
    const double t = tick / 60.0;
    BodyState body;
    body.position = {3 * t, 50 + 2 * t - 9.81 * t * t / 2, -t};
    return quantizer.Quantize(body);
  };
  const QuantizedState base = at(20), older = at(17), oldest = at(14), truth = at(26);
  const Samples samples{.base = &base, .older = &older, .oldest = &oldest, .ticks = 6, .gap = 3, .gap2 = 3};
  const Prediction prediction = predictor.Predict(samples);
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_LE(std::abs(prediction.position[axis] - truth.position[axis]), 4);
  // Gravity alone, without the third sample, is not believed; nor does what stands fall.
  Samples two = samples;
  two.oldest = nullptr;
  EXPECT_GT(predictor.Predict(two).position[1], prediction.position[1]);
  const Samples standing{.base = &base, .older = &base, .oldest = &base, .ticks = 6, .gap = 3, .gap2 = 3};
  EXPECT_EQ(predictor.Predict(standing).position, base.position);
}

TEST(PredictTest, TheFloorHoldsWhatFalls) {
  const PosePredictor predictor(Quantizer(kBounds, {}), {}, -9.81);
  QuantizedState base, older;
  base.position = {0, 110, 0};
  older.position = {0, 130, 0};
  Samples samples{.base = &base, .older = &older, .ticks = 6, .gap = 1};
  EXPECT_EQ(predictor.Predict(samples).position[1], -10);
  samples.floor = 100;
  EXPECT_EQ(predictor.Predict(samples).position[1], 100);
}

TEST(PredictTest, NothingOverflowsAtTheEdges) {
  const PosePredictor predictor(Quantizer(kBounds, {}), {}, -1e4);
  std::mt19937_64 random(6);
  for (int i = 0; i < 20'000; ++i) {
    std::array<QuantizedState, 3> states;
    for (QuantizedState& s : states) {
      for (std::int64_t& c : s.position)
        c = random() % 3 == 0 ? kMaxPosition : -kMaxPosition + static_cast<std::int64_t>(random() % 1000);
      for (std::int16_t& c : s.smallest) c = static_cast<std::int16_t>(static_cast<int>(random() % 2047) - 1023);
      s.largest = static_cast<std::uint8_t>(random() % 4);
    }
    const Samples samples{.base = &states[0],
                          .older = &states[1],
                          .oldest = &states[2],
                          .ticks = random() % 300,
                          .gap = 1 + random() % 300,
                          .gap2 = 1 + random() % 300};
    for (const std::int64_t c : predictor.Predict(samples).position) ASSERT_LE(std::abs(c), kMaxPosition);
  }
}

TEST(ChecksumTest, IsTheStandardOne) {
  constexpr std::string_view kText = "123456789";
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(kText.data()), kText.size());
  EXPECT_EQ(Crc32c(bytes), 0xe3069283u);
}

TEST(StandingBoxTest, StandsAsHighAsItsTurnSays) {
  const Quantizer quantizer({{-10, -5, -10}, {10, 5, 10}}, {});
  const StandingBox box = StandingBox::Of(quantizer, 0.5, {0.2, 0.3, 0.4});
  const double step_m = SnapshotSettings().position_step_m;
  const auto height_m = [&](Quatd turn) {
    BodyState state;
    state.orientation = Normalized(turn);
    const FixedQuaternion q = ToFixed(quantizer.Quantize(state), quantizer.orientation_limit());
    return static_cast<double>(box.HeightAt(q) - box.floor) * step_m;
  };
  constexpr double kHalf = 0.70710678118654752;
  EXPECT_NEAR(height_m({0, 0, 0, 1}), 0.3, step_m);
  EXPECT_NEAR(height_m({kHalf, 0, 0, kHalf}), 0.4, 2 * step_m);               // on its front
  EXPECT_NEAR(height_m({0, 0, kHalf, kHalf}), 0.2, 2 * step_m);               // on its side
  EXPECT_NEAR(height_m({0, 0, 0.38268343, 0.92387953}), 0.5 * kHalf, 0.001);  // on an edge: (0.2 + 0.3) cos 45
  BodyState on_floor;
  on_floor.position.y = 0.5;
  EXPECT_EQ(box.floor, quantizer.Quantize(on_floor).position[1]);
}

}  // namespace
}  // namespace tessera::replication

#include "core/replication/quantize.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "core/replication/record_codec.h"
#include "core/replication/testing/arena.h"

namespace tessera::replication {
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3d Vector(double limit) { return {(*this)(-limit, limit), (*this)(-limit, limit), (*this)(-limit, limit)}; }
  BodyState State(double position_m) {
    const Vec3d axis = Vector(1);
    return {.position = Vector(position_m),
            .orientation = Normalized(Quatd(axis.x, axis.y, axis.z, (*this)(-1, 1))),
            .linear_velocity = Vec3f(Vector(50)),
            .angular_velocity = Vec3f(Vector(20))};
  }

 private:
  std::mt19937 engine_;
};

double AngleBetween(Quatd a, Quatd b) {
  const Quatd d = Normalized(a) * Conjugate(Normalized(b));
  return 2 * std::atan2(Length(Vec3d(d.x, d.y, d.z)), std::abs(d.w));
}

TEST(QuantizeTest, ErrsByHalfAStepAndNoMore) {
  const SnapshotSettings settings;
  const Quantizer quantizer(kBounds, settings);
  Random random(1);
  double worst_angle = 0;
  for (int i = 0; i < 20'000; ++i) {
    const BodyState truth = random.State(i % 2 == 0 ? 150 : 5000);  // within the bounds, and far beyond
    const BodyState seen = quantizer.Dequantize(quantizer.Quantize(truth));
    const Vec3d p = seen.position - truth.position;
    const Vec3f v = seen.linear_velocity - truth.linear_velocity, w = seen.angular_velocity - truth.angular_velocity;
    for (const double e : {p.x, p.y, p.z}) EXPECT_LE(std::abs(e), settings.position_step_m * 0.5000001);
    for (const float e : {v.x, v.y, v.z}) EXPECT_LE(std::abs(e), settings.linear_velocity_step_m_s * 0.5001);
    for (const float e : {w.x, w.y, w.z}) EXPECT_LE(std::abs(e), settings.angular_velocity_step_rad_s * 0.5001);
    EXPECT_NEAR(Length(seen.orientation), 1, 1e-6);
    worst_angle = std::max(worst_angle, AngleBetween(seen.orientation, truth.orientation));
  }
  EXPECT_LE(worst_angle, 0.13 * std::numbers::pi / 180);
}

TEST(QuantizeTest, TheIdentityAndRestAreExact) {
  const Quantizer quantizer(kBounds, SnapshotSettings());
  BodyState rest;
  rest.position = {1, 2, 3};
  rest.asleep = true;
  EXPECT_EQ(quantizer.Dequantize(quantizer.Quantize(rest)), rest);
}

TEST(QuantizeTest, OppositeQuaternionsAreOneRotation) {
  const Quantizer quantizer(kBounds, SnapshotSettings());
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    BodyState state = random.State(100);
    const QuantizedState one = quantizer.Quantize(state);
    state.orientation = {-state.orientation.x, -state.orientation.y, -state.orientation.z, -state.orientation.w};
    EXPECT_EQ(quantizer.Quantize(state), one);
  }
}

TEST(QuantizeTest, WhatIsNotANumberOrBeyondAllBoundsStaysInRange) {
  const Quantizer quantizer(kBounds, SnapshotSettings());
  BodyState state;
  state.position = {std::nan(""), 1e300, -1e300};
  state.linear_velocity = {1e30f, -1e30f, std::nanf("")};
  const QuantizedState q = quantizer.Quantize(state);
  for (const std::int64_t c : q.position) EXPECT_LE(std::abs(c), kMaxPosition);
  for (const std::int32_t c : q.linear) EXPECT_LE(std::abs(c), kMaxVelocity);
}

// Any state: what is written comes back to the bit.
TEST(RecordCodecTest, FullRecordsComeBackExactly) {
  const Quantizer quantizer(kBounds, SnapshotSettings());
  Random random(4);
  for (int i = 0; i < 20'000; ++i) {
    BodyState body = random.State(i % 3 == 0 ? 20'000 : i % 5 == 0 ? 1e12 : 100);
    if (i % 11 == 0) body.linear_velocity = Vec3f(random.Vector(1e9));
    if (i % 4 == 0) body.linear_velocity = body.angular_velocity = {};
    body.asleep = i % 7 == 0;
    const QuantizedState state = quantizer.Quantize(body);
    const Epoch epoch(i % 2 == 0 ? static_cast<std::uint32_t>(i) : 0xffffffff - static_cast<std::uint32_t>(i));
    BodyTraits traits;
    if (i % 13 == 0)
      traits = {.jumps = static_cast<std::uint8_t>(i),
                .tuning = {.gravity_scale = -1.5f, .friction = 2.0f, .restitution = {}}};
    if (i % 26 == 0) traits.tuning.restitution = 0.5f;
    if (i % 26 == 0)
      traits.tuning.claim = SpawnClaim{PlayerNumber(0xffffffff), 0xffffffff - static_cast<std::uint32_t>(i)};
    BitWriter writer;
    PackFull(quantizer, epoch, state, traits).AppendTo(writer);
    const std::vector<std::uint8_t> bytes = writer.Finish();
    BitReader reader(bytes);
    QuantizedState got;
    Epoch got_epoch;
    BodyTraits got_traits;
    ASSERT_TRUE(ReadFull(reader, quantizer, got_epoch, got, got_traits));
    ASSERT_EQ(got_traits, traits);
    ASSERT_TRUE(reader.AtEnd());
    ASSERT_EQ(got, state);
    ASSERT_EQ(got_epoch, epoch);
  }
}

TEST(QuantizeTest, OtherSettingsAndBoundsHaveOtherFingerprints) {
  const std::uint16_t fingerprint = Quantizer(kBounds, SnapshotSettings()).fingerprint();
  EXPECT_EQ(fingerprint, Quantizer(kBounds, SnapshotSettings()).fingerprint());
  EXPECT_NE(fingerprint, Quantizer(kBounds.Expanded(1), SnapshotSettings()).fingerprint());
  EXPECT_NE(fingerprint, Quantizer(kBounds, SnapshotSettings{.tick_rate_hz = 30}).fingerprint());
  EXPECT_NE(fingerprint, Quantizer(kBounds, SnapshotSettings{.orientation_bits = 12}).fingerprint());
}

}  // namespace
}  // namespace tessera::replication

#include "core/world/body_tuning.h"

#include <gtest/gtest.h>

#include <limits>

namespace tessera {
namespace {

TEST(BodyTuningTest, ComesBackFromItsBytes) {
  for (int bits = 0; bits < 16; ++bits) {
    BodyTuning tuning;
    if ((bits & 1) != 0) tuning.gravity_scale = -2.5f;
    if ((bits & 2) != 0) tuning.friction = 0.25f;
    if ((bits & 4) != 0) tuning.restitution = 1.0f;
    if ((bits & 8) != 0) tuning.claim = SpawnClaim{PlayerNumber(70'000), 300};
    ByteWriter out;
    Write(out, tuning);
    const std::vector<std::uint8_t> bytes = out.Take();
    ByteReader in(bytes);
    EXPECT_EQ(ReadTuning(in), tuning);
    EXPECT_TRUE(in.ok() && in.remaining() == 0);
    EXPECT_EQ(tuning.empty(), bits == 0);
  }
}

TEST(BodyTuningTest, RefusesUnknownFlags) {
  const std::vector<std::uint8_t> bytes{32};
  ByteReader in(bytes);
  (void)ReadTuning(in);
  EXPECT_FALSE(in.ok());
}

TEST(BodyTuningTest, ChangesWhatItNamesAlone) {
  BodyDef def;
  def.gravity_scale = 0.5;
  def.material = {.friction = 0.7, .restitution = 0.1};
  EXPECT_EQ(GravityScaleOf(def, {}), 0.5);
  EXPECT_EQ(GravityScaleOf(def, {0.0f, {}, {}}), 0);
  EXPECT_EQ(MaterialOf(def, {{}, 2.0f, {}}).friction, 2);
  EXPECT_EQ(MaterialOf(def, {{}, 2.0f, {}}).restitution, 0.1);
}

TEST(BodyTuningTest, IsSaneWithinItsRanges) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(IsSane(BodyTuning{-10.0f, 10.0f, 0.0f}));
  EXPECT_FALSE(IsSane(BodyTuning{10.5f, {}, {}}));
  EXPECT_FALSE(IsSane(BodyTuning{nan, {}, {}}));
  EXPECT_FALSE(IsSane(BodyTuning{{}, -0.1f, {}}));
  EXPECT_FALSE(IsSane(BodyTuning{{}, {}, nan}));
  BodyTuning claimed;
  claimed.claim = SpawnClaim{PlayerNumber(1), 1};
  EXPECT_TRUE(IsSane(claimed));
  claimed.claim = SpawnClaim{PlayerNumber(), 1};
  EXPECT_FALSE(IsSane(claimed)) << "of nobody";
  claimed.claim = SpawnClaim{PlayerNumber(1), 0};
  EXPECT_FALSE(IsSane(claimed)) << "by no command";
}

}  // namespace
}  // namespace tessera

#include "core/region/exchange.h"

#include <gtest/gtest.h>

#include <random>

namespace tessera::region {
namespace {

constexpr BodyId kLeft{1}, kRight{2};

// A contact at `point` with this impulse on b, between bodies at `a` and `b`.
Solution At(Vec3d point, Vec3d a, Vec3d b, Vec3d impulse_on_b, bool by_owner_of_a) {
  return {kLeft,
          kRight,
          by_owner_of_a,
          Vec3f(impulse_on_b),
          Vec3f(Cross(point - a, -impulse_on_b)),
          Vec3f(Cross(point - b, impulse_on_b))};
}

TEST(ExchangeTest, BalancesLinearAndAngularMomentum) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(-3, 3);
  const auto vector = [&] { return Vec3d{draw(random), draw(random), draw(random)}; };
  for (int i = 0; i < 100; ++i) {
    const Vec3d a = vector(), b = vector();
    const Solution of_a = At(vector(), a, b, vector(), true), of_b = At(vector(), a, b, vector(), false);
    const PairCorrection c = CorrectionOf(&of_a, &of_b, 7, 0.3);
    const Vec3d on_a = -Vec3d(of_a.impulse_on_b) + c.impulse_on_a, on_b = Vec3d(of_b.impulse_on_b) + c.impulse_on_b;
    EXPECT_LT(Length(on_a + on_b), 1e-6);
    const Vec3d turn_a = Vec3d(of_a.angular_on_a) + c.angular_on_a, turn_b = Vec3d(of_b.angular_on_b) + c.angular_on_b;
    EXPECT_LT(Length(Cross(a, on_a) + turn_a + Cross(b, on_b) + turn_b), 1e-5);
  }
}

TEST(ExchangeTest, SharesByMassSoBothChangeVelocityAlike) {
  const Solution of_a = At({}, {}, {}, {3, 0, 0}, true), of_b = At({}, {}, {}, {1, 0, 0}, false);
  const PairCorrection c = CorrectionOf(&of_a, &of_b, 6, 2);
  EXPECT_DOUBLE_EQ(c.impulse_on_a.x / 6.0, c.impulse_on_b.x / 2.0);
  EXPECT_DOUBLE_EQ(c.impulse_on_a.x + c.impulse_on_b.x, 2.0);
}

TEST(ExchangeTest, NothingIsDueWhenBothFoundTheSame) {
  const Solution of_a = At({1, 2, 3}, {}, {1, 1, 1}, {3, 1, 2}, true),
                 of_b = At({1, 2, 3}, {}, {1, 1, 1}, {3, 1, 2}, false);
  const PairCorrection c = CorrectionOf(&of_a, &of_b, 1, 1);
  EXPECT_EQ(c.impulse_on_a, Vec3d());
  EXPECT_EQ(c.angular_on_b, Vec3d());
}

TEST(ExchangeTest, ASideThatFoundNoContactStillTakesItsShare) {
  const Solution of_b = At({}, {}, {}, {4, 0, 0}, false);
  const PairCorrection c = CorrectionOf(nullptr, &of_b, 1, 1);
  EXPECT_DOUBLE_EQ(c.impulse_on_a.x, -2);
  EXPECT_DOUBLE_EQ(c.impulse_on_b.x, -2);  // b has 4 already
}

TEST(ExchangeTest, ARecordReadsTheSameFromBothSides) {
  const Solution from_b = ToSolution({kRight, kLeft, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  EXPECT_FALSE(from_b.by_owner_of_a);
  EXPECT_EQ(from_b.impulse_on_b, Vec3f(1, 2, 3));
  EXPECT_EQ(from_b.angular_on_b, Vec3f(4, 5, 6));
  EXPECT_EQ(from_b.angular_on_a, Vec3f(7, 8, 9));
  const Solution from_a = ToSolution({kLeft, kRight, {1, 2, 3}, {4, 5, 6}, {7, 8, 9}});
  EXPECT_EQ(from_a.impulse_on_b, Vec3f(-1, -2, -3));
  EXPECT_EQ(from_a.angular_on_a, Vec3f(4, 5, 6));
}

}  // namespace
}  // namespace tessera::region

// Free flight against the parabola, Runge-Kutta in tiny steps, and what is conserved.

#include "core/physics/motion/free_flight.h"

#include <gmock/gmock.h>

#include <random>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

constexpr double kStep_s = 1.0 / 60;

Vec3d Divided(Vec3d a, Vec3d b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
double Energy(Vec3d inertia, Quatd q, Vec3d l) {
  const Vec3d m = Rotate(Conjugate(q), l);
  return Dot(m, Divided(m, inertia)) / 2;
}
double Between(Quatd a, Quatd b) { return Length(RotationVectorOf(Normalized(Conjugate(a) * b))); }

// dq/dt = w q / 2 with w = I(q)^-1 L.
Quatd Rate(Vec3d inertia, Quatd q, Vec3d l) {
  const Vec3d w = Rotate(q, Divided(Rotate(Conjugate(q), l), inertia));
  return Quatd(w.x / 2, w.y / 2, w.z / 2, 0) * q;
}
Quatd Plus(Quatd a, Quatd b, double s) { return {a.x + s * b.x, a.y + s * b.y, a.z + s * b.z, a.w + s * b.w}; }
Quatd RungeKutta(Vec3d inertia, Vec3d l, double dt_s, int steps, Quatd q) {
  const double h = dt_s / steps;
  for (int i = 0; i < steps; ++i) {
    const Quatd a = Rate(inertia, q, l), b = Rate(inertia, Plus(q, a, h / 2), l);
    const Quatd c = Rate(inertia, Plus(q, b, h / 2), l), d = Rate(inertia, Plus(q, c, h), l);
    q = Normalized(Plus(Plus(Plus(Plus(q, a, h / 6), b, h / 3), c, h / 3), d, h / 6));
  }
  return q;
}

FlightState Spinning(Vec3d inertia, Vec3d w) { return {{}, {}, {}, AngularMomentumOf(inertia, {}, Vec3f(w))}; }

TEST(FreeFlightTest, FallsOnTheParabola) {
  for (const double g : {9.81, 10.0}) {
    FlightState state{{0, 1000, 0}, {}, {3, 4, -5}, {}};
    for (int i = 1; i <= 60; ++i) {
      Fly({1, 1, 1}, {0, -g, 0}, {}, kStep_s, &state);
      const double t = i * kStep_s;
      EXPECT_LT(Length(state.position - Vec3d{3 * t, 1000 + 4 * t - g * t * t / 2, -5 * t}), 3e-6);
    }
  }
}

TEST(FreeFlightTest, RoundBodyTurnsExactly) {
  const Vec3d inertia{2, 2, 2}, w{3, -2, 7};
  FlightState state = Spinning(inertia, w);
  for (int i = 0; i < 600; ++i) Fly(inertia, {}, {}, kStep_s, &state);
  EXPECT_LT(Between(state.orientation, TurnBy(w * 10.0)), 1e-12);
}

TEST(FreeFlightTest, TurnsSteadilyAboutAPrincipalAxis) {
  const Vec3d inertia{1, 2, 3};
  for (const Vec3d w : {Vec3d{7, 0, 0}, {0, 7, 0}, {0, 0, 7}}) {
    FlightState state = Spinning(inertia, w);
    for (int i = 0; i < 600; ++i) Fly(inertia, {}, {}, kStep_s, &state);
    EXPECT_LT(Between(state.orientation, TurnBy(w * 10.0)), 1e-11);
  }
}

TEST(FreeFlightTest, BodyWithAnAxisTurnsExactly) {
  for (const Vec3d inertia : {Vec3d{1, 1, 3}, {3, 1, 1}, {1, 3, 1}, {5, 5, 1}, {5, 1, 5}, {1, 5, 5}}) {
    FlightState state = Spinning(inertia, {1, 4, 2});
    const Vec3d l(state.angular_momentum);
    for (int i = 0; i < 60; ++i) Fly(inertia, {}, {}, kStep_s, &state);
    EXPECT_LT(Between(state.orientation, RungeKutta(inertia, l, 1, 20000, {})), 1e-11) << inertia;
  }
}

TEST(FreeFlightTest, AnyBodyTurnsAsRungeKuttaSays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int k = 0; k < 50; ++k) {
    const Vec3d inertia{std::exp(uniform(random)), std::exp(uniform(random)), std::exp(uniform(random))};
    FlightState state = Spinning(inertia, Vec3d{uniform(random), uniform(random), uniform(random)} * 30.0);
    const Vec3d l(state.angular_momentum);
    Fly(inertia, {}, {}, kStep_s, &state);
    EXPECT_LT(Between(state.orientation, RungeKutta(inertia, l, kStep_s, 2000, {})), 3e-8) << inertia;
  }
}

TEST(FreeFlightTest, THandleFlipsAtItsTimes) {
  const Vec3d inertia{1, 2, 3};
  for (const Vec3d w : {Vec3d{.01, 10, .01}, {.5, .5, 10}}) {
    FlightState state = Spinning(inertia, w);
    const Vec3d l(state.angular_momentum);
    Quatd truth;
    for (int i = 0; i < 1200; ++i) {
      Fly(inertia, {}, {}, kStep_s, &state);
      truth = RungeKutta(inertia, l, kStep_s, 256, truth);
      ASSERT_LT(Between(state.orientation, truth), 1e-6) << i;
    }
  }
}

TEST(FreeFlightTest, ConservesEnergyAndAngularMomentumForTenMinutes) {
  const Vec3d inertia{1, 2, 3}, w{.01, 10, .01};
  FlightState state = Spinning(inertia, w);
  const Vec3f l = state.angular_momentum;
  const double energy = Energy(inertia, {}, Vec3d(l));
  for (int i = 0; i < 36000; ++i) {
    Fly(inertia, {}, {}, kStep_s, &state);
    ASSERT_NEAR(Energy(inertia, state.orientation, Vec3d(l)) / energy, 1, 1e-8);
  }
  EXPECT_EQ(state.angular_momentum, l);
  EXPECT_NEAR(Length(state.orientation), 1, 1e-14);
}

TEST(FreeFlightTest, TorqueTurnsAsUniformAcceleration) {
  const Vec3d inertia{2, 2, 2};
  FlightState state{};
  for (int i = 0; i < 60; ++i) Fly(inertia, {}, {0, 0, 4}, kStep_s, &state);
  EXPECT_NEAR(state.angular_momentum.z, 4, 1e-5);
  EXPECT_LT(Between(state.orientation, TurnBy({0, 0, 1})), 1e-5);  // 2 rad/s^2 for a second
}

TEST(FreeFlightTest, AbsurdSpinStaysFiniteAndBounded) {
  const Vec3d inertia{1e-6, 2e-4, 3e-4};
  FlightState state = Spinning(inertia, {1e6, 2e5, -3e5});
  const Vec3f l = state.angular_momentum;
  for (int i = 0; i < 100; ++i) Fly(inertia, {}, {}, kStep_s, &state);
  EXPECT_EQ(state.angular_momentum, l);
  EXPECT_NEAR(Length(state.orientation), 1, 1e-14);
}

TEST(FreeFlightTest, MomentumAndVelocityAreInverses) {
  const Vec3d inertia{1, 2, 3};
  const Quatd q = TurnBy({.3, -2, 1.1});
  const Vec3f w{1, -5, 9};
  EXPECT_LT(Length(AngularVelocityOf(inertia, q, AngularMomentumOf(inertia, q, w)) - w), 2e-6f);
}

TEST(TrigTest, AgreesWithTheLibrary) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-12, 8);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::pow(10, exponent(random)) * (i % 2 == 0 ? 1 : -1);
    const SinCos s = SinCosOf(x);
    const double room = 4e-16 + 2e-16 * std::abs(x) * (std::abs(x) > 1e6 ? 1 : 0);
    ASSERT_NEAR(s.sin, std::sin(x), room) << x;
    ASSERT_NEAR(s.cos, std::cos(x), room) << x;
    if (std::abs(x) < 0.1) {
      ASSERT_NEAR(s.sin / std::sin(x), 1, 4e-16) << x;
    }
    const double y = std::pow(10, exponent(random)) * (i % 3 == 0 ? 1 : -1);
    ASSERT_NEAR(Atan2(y, x), std::atan2(y, x), 1e-15) << x << ' ' << y;
  }
}

TEST(TrigTest, RotationVectorsAndQuaternionsAreInverses) {
  for (const double angle : {1e-12, 1e-6, 0.1, 1.0, 3.0, 3.14159}) {
    const Vec3d v = Normalized(Vec3d{1, -2, 3}) * angle;
    EXPECT_LT(Length(RotationVectorOf(TurnBy(v)) - v), 1e-15 + 1e-15 * angle);
  }
  EXPECT_EQ(RotationVectorOf({0, 0, 0, -1}), Vec3d());
}

}  // namespace
}  // namespace tessera::physics

#include "core/physics/motion/free_flight.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

// Inertia that differs by less than this share is that of a round body: less than hulls of float points are true to.
constexpr double kRound = 1e-7;
// A body whose angular momentum m lies along a principal axis turns steadily; it counts as such if the squares of the
// other two parts of m are no more than this share of its own. The share is rounding and no more, or a body that turns
// about its middle axis would never come to flip.
constexpr double kSteady2 = 1e-30;
// Attitude error that one step may make, rad.
constexpr double kStepError_rad = 1e-8;
// With this limit a body that spins absurdly fast costs at most about 10 microseconds; its angular momentum stays
// exact.
constexpr int kMostPieces = 64;

// The free rigid body in its own axes, with m = angular momentum and I_k <= I_j <= I_i in some order:
//
//   H = |m|^2 / (2 I_j)  +  m_i^2 / 2 (1 / I_i - 1 / I_j)  +  m_k^2 / 2 (1 / I_k - 1 / I_j)
//
// The first term turns the body about the fixed L in world space at |L| / I_j and commutes with all else. The others
// turn it about its axes i and k. A body with an axis of symmetry has only one of these, a round one none; both are
// exact then. Where there are two, they are composed as S6 of Blanes and Moan (2002), "Practical symplectic partitioned
// Runge-Kutta and Runge-Kutta-Nystrom methods": fourth order, symmetric, conserves |m|.
constexpr std::array<double, 4> kTurnI = {0.0792036964311957, 0.353172906049774, -0.0420650803577195,
                                          1 - 2 * (0.0792036964311957 + 0.353172906049774 - 0.0420650803577195)};
constexpr std::array<double, 3> kTurnK = {0.209515106613362, -0.143851773179818,
                                          0.5 - (0.209515106613362 - 0.143851773179818)};

// The turn of the body in its own axes so far, and m. Axes are named so that the two turned about are x and z.
struct Spin {
  Vec3d m;
  Quatd q;

  // Turns by `angle` about the body's x; m turns the other way in body axes.
  void TurnX(double angle) {
    const SinCos half = SinCosOf(angle / 2);
    const double c = 1 - 2 * half.sin * half.sin, s = 2 * half.sin * half.cos;
    m = {m.x, c * m.y + s * m.z, c * m.z - s * m.y};
    q = {q.x * half.cos + q.w * half.sin, q.y * half.cos + q.z * half.sin, q.z * half.cos - q.y * half.sin,
         q.w * half.cos - q.x * half.sin};
  }
  void TurnZ(double angle) {
    const SinCos half = SinCosOf(angle / 2);
    const double c = 1 - 2 * half.sin * half.sin, s = 2 * half.sin * half.cos;
    m = {c * m.x + s * m.y, c * m.y - s * m.x, m.z};
    q = {q.x * half.cos + q.y * half.sin, q.y * half.cos - q.x * half.sin, q.z * half.cos + q.w * half.sin,
         q.w * half.cos - q.z * half.sin};
  }
};

// Turns about x and z at the rates `x` and `z` times the part of m along each.
void Wobble(double x, double z, double dt_s, int pieces, Spin* spin) {
  const double h = dt_s / pieces;
  const auto turn_x = [&](double share) { spin->TurnX(share * h * x * spin->m.x); };
  const auto turn_z = [&](double share) { spin->TurnZ(share * h * z * spin->m.z); };
  turn_x(kTurnI[0]);
  for (int i = 0; i < pieces; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      turn_z(kTurnK[k]);
      turn_x(kTurnI[k + 1]);
    }
    for (std::size_t k = 3; k-- > 1;) {
      turn_z(kTurnK[k]);
      turn_x(kTurnI[k]);
    }
    turn_z(kTurnK[0]);
    turn_x(kTurnI[0] * (i + 1 < pieces ? 2 : 1));  // the end of one piece and the start of the next
  }
}

// Number of pieces for a step. The error of a piece goes with the fifth power of its turn, and vanishes with either
// rate.
int PiecesFor(double x, double z, double turn) {
  constexpr double kErrorOfPiece = 1.5e-4;  // the largest seen for a turn under a radian
  const double faster = std::max(x, z), slower = std::min(x, z);
  const double t = faster * turn;
  const double error = kErrorOfPiece * t * t * t * t * (slower * turn);
  const double pieces = std::sqrt(std::sqrt(error / kStepError_rad));
  return pieces < kMostPieces ? static_cast<int>(pieces) + 1 : kMostPieces;
}

// Renames the axes in a cycle, so that y or z becomes x. Quaternions are renamed as their vectors are.
Vec3d Renamed(Vec3d v, int by) { return by == 0 ? v : by == 1 ? Vec3d{v.y, v.z, v.x} : Vec3d{v.z, v.x, v.y}; }
Quatd Renamed(Quatd q, int by) {
  const Vec3d v = Renamed(Vec3d{q.x, q.y, q.z}, by);
  return {v.x, v.y, v.z, q.w};
}

bool SameWithin(double a, double b, double share) { return std::abs(a - b) <= share * std::max(a, b); }

// The cycle of renaming after which y has the middle moment. Moments that are alike within rounding count as alike.
int RenamingFor(Vec3d inertia) {
  const auto middle = [](double a, double b, double c) { return (a <= b && b <= c) || (c <= b && b <= a); };
  if (middle(inertia.x, inertia.y, inertia.z)) return 0;
  return middle(inertia.y, inertia.z, inertia.x) ? 1 : 2;
}

// The moment about the principal axis along which `m` lies; 0 if it lies along none.
double SteadyMoment(Vec3d inertia, Vec3d m, double square) {
  const double x = m.x * m.x, y = m.y * m.y, z = m.z * m.z, most = kSteady2 * square;
  return y + z <= most ? inertia.x : x + z <= most ? inertia.y : x + y <= most ? inertia.z : 0;
}

// Turns `q` for `dt_s` with the constant angular momentum `l`, world axes.
Quatd Turn(Vec3d inertia, Vec3d l, double dt_s, Quatd q) {
  const double size = Length(l);
  if (!(size > 0)) return q;
  const int renaming = RenamingFor(inertia);
  const Vec3d i = Renamed(inertia, renaming);
  const double x = SameWithin(i.x, i.y, kRound) ? 0 : 1 / i.x - 1 / i.y;
  const double z = SameWithin(i.z, i.y, kRound) ? 0 : 1 / i.z - 1 / i.y;
  if (x == 0 && z == 0) return Normalized(TurnBy(l * (dt_s / i.y)) * q);
  Spin spin{Renamed(Rotate(Conjugate(q), l), renaming), {}};
  const double steady = SteadyMoment(i, spin.m, size * size);
  if (steady > 0) return Normalized(TurnBy(l * (dt_s / steady)) * q);
  const Quatd whole = TurnBy(l * (dt_s / i.y));
  if (z == 0) {
    spin.TurnX(dt_s * x * spin.m.x);
  } else if (x == 0) {
    spin.TurnZ(dt_s * z * spin.m.z);
  } else {
    Wobble(x, z, dt_s, PiecesFor(std::abs(x), std::abs(z), size * dt_s), &spin);
  }
  return Normalized(whole * q * Renamed(spin.q, (3 - renaming) % 3));
}

Vec3d Scaled(Vec3d v, Vec3d by) { return {v.x * by.x, v.y * by.y, v.z * by.z}; }

}  // namespace

void Fly(Vec3d inertia, Vec3d acceleration, Vec3d torque, double dt_s, FlightState* state) {
  const Vec3d v(state->velocity), l(state->angular_momentum);
  state->position += v * dt_s + acceleration * (dt_s * dt_s / 2);
  state->velocity = Vec3f(v + acceleration * dt_s);
  // The torque acts in two halves, before and after the turn, which is second order in it and exact without it.
  state->orientation = Turn(inertia, l + torque * (dt_s / 2), dt_s, state->orientation);
  state->angular_momentum = Vec3f(l + torque * dt_s);
}

Vec3f AngularVelocityOf(Vec3d inertia, Quatd orientation, Vec3f angular_momentum) {
  const Vec3d m = Rotate(Conjugate(orientation), Vec3d(angular_momentum));
  return Vec3f(Rotate(orientation, Scaled(m, {1 / inertia.x, 1 / inertia.y, 1 / inertia.z})));
}

Vec3f AngularMomentumOf(Vec3d inertia, Quatd orientation, Vec3f angular_velocity) {
  const Vec3d w = Rotate(Conjugate(orientation), Vec3d(angular_velocity));
  return Vec3f(Rotate(orientation, Scaled(w, inertia)));
}

}  // namespace tessera::physics

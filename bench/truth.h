// Truth: what a run is held against. Closed forms, and Runge-Kutta in doubles where there is none.
//
//   const Spin true_spin = SpinAfter({.inertia = {1, 2, 3}}, w0, 20, 1e-5);
//   const double error = AngleBetween(run.orientation, true_spin.orientation);
//
// Nothing here shares code with the engines that it judges. Pure functions, any thread.
#pragma once

#include <vector>

#include "core/world/math.h"

namespace tessera::bench {

// --- The free rigid body

// World axes; `inertia` principal, kg m^2, about the axes that `orientation` turns.
Vec3d AngularMomentum(Vec3d inertia, Quatd orientation, Vec3d angular_velocity);
double SpinEnergy(Vec3d inertia, Quatd orientation, Vec3d angular_velocity);  // J

struct Spin {
  Quatd orientation;
  Vec3d angular_velocity;  // rad/s, world axes
};
// Euler's equations and the attitude by classic Runge-Kutta of fourth order in equal steps of at most `step_s`.
Spin SpinAfter(Vec3d inertia, Spin start, double seconds, double step_s);

double AngleBetween(Quatd a, Quatd b);  // 0 to pi

// --- Pendulums

// Period of a mass on a massless arm, or of a rigid body with I / (m d) for `length_m`; any amplitude below pi. By the
// arithmetic-geometric mean (Gauss).
double PendulumPeriod(double length_m, double gravity_m_s2, double amplitude_rad);

// A chain of rigid rods that swings in a plane from a fixed end, without friction. Rod i hangs at the end of rod i - 1.
struct Rod {
  double mass_kg, length_m, center_m, inertia_kg_m2;  // centre of mass from its upper joint; inertia about that centre
};
class RodChain {
 public:
  // Stretched out level along +x and at rest.
  RodChain(std::vector<Rod> rods, double gravity_m_s2);
  void Step(double dt_s);    // Runge-Kutta of fourth order
  double x_of_last() const;  // x of the last rod's centre of mass, from the fixed end
  double energy() const;     // J; 0 at the start

 private:
  void Accelerations(const std::vector<double>& angle, const std::vector<double>& rate, std::vector<double>* out);

  std::size_t n_;
  std::vector<Rod> rods_;
  double gravity_;
  std::vector<double> coupling_, weight_;   // n x n: sum of m s_i s_j over the bodies that both carry; n: of m s_i
  std::vector<double> angle_, rate_;        // from +x
  std::vector<double> matrix_, sin_, cos_;  // scratch
};
// When the last rod's centre passes under the fixed end, s; all crossings up to `seconds`.
std::vector<double> CrossingTimes(RodChain chain, double seconds, double step_s);

}  // namespace tessera::bench

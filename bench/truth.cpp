#include "bench/truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::bench {
namespace {

Vec3d Scaled(Vec3d a, Vec3d b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
Vec3d Divided(Vec3d a, Vec3d b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }

// Attitude and body-frame angular velocity, and their rates of change.
struct Turning {
  Quatd q;
  Vec3d w;
};

Turning RateOf(Vec3d inertia, const Turning& s) {
  const Quatd spin = s.q * Quatd{s.w.x, s.w.y, s.w.z, 0};
  return {{spin.x / 2, spin.y / 2, spin.z / 2, spin.w / 2}, Divided(-Cross(s.w, Scaled(inertia, s.w)), inertia)};
}

Turning Plus(const Turning& s, const Turning& d, double h) {
  return {{s.q.x + d.q.x * h, s.q.y + d.q.y * h, s.q.z + d.q.z * h, s.q.w + d.q.w * h}, s.w + d.w * h};
}

}  // namespace

Vec3d AngularMomentum(Vec3d inertia, Quatd orientation, Vec3d angular_velocity) {
  return Rotate(orientation, Scaled(inertia, Rotate(Conjugate(orientation), angular_velocity)));
}

double SpinEnergy(Vec3d inertia, Quatd orientation, Vec3d angular_velocity) {
  return Dot(AngularMomentum(inertia, orientation, angular_velocity), angular_velocity) / 2;
}

Spin SpinAfter(Vec3d inertia, Spin start, double seconds, double step_s) {
  Turning s{start.orientation, Rotate(Conjugate(start.orientation), start.angular_velocity)};
  const long steps = static_cast<long>(std::ceil(seconds / step_s));
  const double h = seconds / static_cast<double>(std::max(steps, 1L));
  for (long i = 0; i < steps; ++i) {
    const Turning k1 = RateOf(inertia, s);
    const Turning k2 = RateOf(inertia, Plus(s, k1, h / 2));
    const Turning k3 = RateOf(inertia, Plus(s, k2, h / 2));
    const Turning k4 = RateOf(inertia, Plus(s, k3, h));
    s = Plus(Plus(Plus(Plus(s, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
    s.q = Normalized(s.q);
  }
  return {s.q, Rotate(s.q, s.w)};
}

double AngleBetween(Quatd a, Quatd b) {
  const Quatd d = Conjugate(a) * b;
  return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

double PendulumPeriod(double length_m, double gravity_m_s2, double amplitude_rad) {
  double a = 1, b = std::cos(amplitude_rad / 2);
  while (std::abs(a - b) > 1e-15 * a) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return 2 * std::numbers::pi * std::sqrt(length_m / gravity_m_s2) / a;
}

// With s_ki the lever of angle i on body k (the whole rod's length above it, the centre's distance for its own), the
// kinetic energy is sum_ij a_ij cos(t_i - t_j) t_i' t_j' / 2, a_ij = sum_k m_k s_ki s_kj, plus the rods' own inertia.
RodChain::RodChain(std::vector<Rod> rods, double gravity_m_s2)
    : n_(rods.size()),
      rods_(std::move(rods)),
      gravity_(gravity_m_s2),
      coupling_(n_ * n_),
      weight_(n_),
      angle_(n_),
      rate_(n_),
      matrix_(n_ * n_),
      sin_(n_),
      cos_(n_) {
  const auto lever = [this](std::size_t k, std::size_t i) {
    return i < k ? rods_[i].length_m : i == k ? rods_[i].center_m : 0;
  };
  for (std::size_t k = 0; k < n_; ++k) {
    for (std::size_t i = 0; i <= k; ++i) {
      weight_[i] += rods_[k].mass_kg * lever(k, i);
      for (std::size_t j = 0; j <= k; ++j) coupling_[i * n_ + j] += rods_[k].mass_kg * lever(k, i) * lever(k, j);
    }
  }
}

// sum_j a_ij (cos(t_i - t_j) t_j'' + sin(t_i - t_j) t_j'^2) + I_i t_i'' = -g w_i cos(t_i), solved by Cholesky.
void RodChain::Accelerations(const std::vector<double>& angle, const std::vector<double>& rate,
                             std::vector<double>* out) {
  for (std::size_t i = 0; i < n_; ++i) {
    sin_[i] = std::sin(angle[i]);
    cos_[i] = std::cos(angle[i]);
  }
  std::vector<double>& x = *out;
  for (std::size_t i = 0; i < n_; ++i) {
    double right = -gravity_ * weight_[i] * cos_[i];
    for (std::size_t j = 0; j < n_; ++j) {
      const double a = coupling_[i * n_ + j];
      right -= a * (sin_[i] * cos_[j] - cos_[i] * sin_[j]) * rate[j] * rate[j];
      matrix_[i * n_ + j] = a * (cos_[i] * cos_[j] + sin_[i] * sin_[j]) + (i == j ? rods_[i].inertia_kg_m2 : 0);
    }
    x[i] = right;
  }
  for (std::size_t i = 0; i < n_; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = matrix_[i * n_ + j];
      for (std::size_t k = 0; k < j; ++k) sum -= matrix_[i * n_ + k] * matrix_[j * n_ + k];
      matrix_[i * n_ + j] = i == j ? std::sqrt(sum) : sum / matrix_[j * n_ + j];
    }
    for (std::size_t k = 0; k < i; ++k) x[i] -= matrix_[i * n_ + k] * x[k];
    x[i] /= matrix_[i * n_ + i];
  }
  for (std::size_t i = n_; i-- > 0;) {
    for (std::size_t k = i + 1; k < n_; ++k) x[i] -= matrix_[k * n_ + i] * x[k];
    x[i] /= matrix_[i * n_ + i];
  }
}

void RodChain::Step(double dt_s) {
  const std::vector<double> angle = angle_, rate = rate_;
  std::vector<double> at_angle = angle, at_rate = rate, acceleration(n_);
  const double into[4] = {dt_s / 2, dt_s / 2, dt_s, 0}, share[4] = {dt_s / 6, dt_s / 3, dt_s / 3, dt_s / 6};
  for (int stage = 0; stage < 4; ++stage) {
    Accelerations(at_angle, at_rate, &acceleration);
    for (std::size_t i = 0; i < n_; ++i) {
      angle_[i] += share[stage] * at_rate[i];
      rate_[i] += share[stage] * acceleration[i];
      at_angle[i] = angle[i] + into[stage] * at_rate[i];
      at_rate[i] = rate[i] + into[stage] * acceleration[i];
    }
  }
}

double RodChain::x_of_last() const {
  double x = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    x += std::cos(angle_[i]) * (i + 1 < n_ ? rods_[i].length_m : rods_[i].center_m);
  }
  return x;
}

double RodChain::energy() const {
  double energy = 0;
  for (std::size_t i = 0; i < n_; ++i) {
    energy += gravity_ * weight_[i] * std::sin(angle_[i]) + rods_[i].inertia_kg_m2 * rate_[i] * rate_[i] / 2;
    for (std::size_t j = 0; j < n_; ++j) {
      energy += coupling_[i * n_ + j] * std::cos(angle_[i] - angle_[j]) * rate_[i] * rate_[j] / 2;
    }
  }
  return energy;
}

std::vector<double> CrossingTimes(RodChain chain, double seconds, double step_s) {
  std::vector<double> times;
  double before = chain.x_of_last();
  for (double time = 0; time < seconds; time += step_s) {
    chain.Step(step_s);
    const double after = chain.x_of_last();
    if (before != 0 && before * after <= 0) times.push_back(time + step_s * before / (before - after));
    before = after;
  }
  return times;
}

}  // namespace tessera::bench

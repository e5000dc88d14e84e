#include "core/physics/solve/direct_solve.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tessera::physics {
namespace {

// Stiffness of a contact against the heaviest body, an impulse for a velocity. A round leaves some ten thousandth,
// times the bodies in a row, of the error before it; more costs digits, which doubles have.
constexpr double kStiffness = 1e4;
// Velocities are found to this, m/s: what floats hold of an impulse that carries a thousand times a body.
constexpr double kSpeedTolerance_m_s = 1e-7;
// Impulses are found to this share of the largest.
constexpr double kImpulseTolerance = 1e-3;
// A line search ends where the slope is this share of that at its start.
constexpr double kSlopeLeft = 0.1;
constexpr int kLineSteps = 20;
// Friction that the last solve left below this share of its limit is taken to hold.
constexpr double kHolds = 0.999;
constexpr std::uint8_t kNormalRows = 0x0f, kTangentRows = 0x30, kTwistRow = 0x40;
// A kinematic body has less than this; the stiffness does not go by it.
constexpr double kLeastInverseRoot = 1e-8;

double Dot6(const Vector6& a, const Vector6& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) sum += a[i] * b[i];
  return sum;
}
void AddTimes(const Vector6& what, double by, Vector6& to) {
  for (std::size_t i = 0; i < 6; ++i) to[i] += what[i] * by;
}

}  // namespace

void DirectSolve::Begin(std::vector<DirectBody> bodies, std::vector<DirectContact> contacts) {
  bodies_ = std::move(bodies);
  contacts_ = std::move(contacts);
  factorisations_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const DirectContact& contact : contacts_) {
    if (contact.a >= 0 && contact.b >= 0) {
      edges.emplace_back(static_cast<std::uint32_t>(contact.a), static_cast<std::uint32_t>(contact.b));
    }
  }
  matrix_.Analyze(bodies_.size(), edges);
  double heaviest = 0;
  for (const DirectBody& body : bodies_) {
    const double inverse = body.inverse_root_mass;
    if (inverse > kLeastInverseRoot) heaviest = std::max(heaviest, 1 / (inverse * inverse));
  }
  stiffness_ = kStiffness * heaviest;
}

DirectSolve::Rows DirectSolve::Measure(std::size_t contact, const std::vector<Vector6>& velocities) const {
  const DirectContact& of = contacts_[contact];
  Rows speeds{};
  for (std::size_t row = 0; row < kDirectRows; ++row) {
    if (!of.Has(row)) continue;
    if (of.a >= 0) speeds[row] += Dot6(of.on_a[row], velocities[static_cast<std::size_t>(of.a)]);
    if (of.b >= 0) speeds[row] += Dot6(of.on_b[row], velocities[static_cast<std::size_t>(of.b)]);
  }
  return speeds;
}

void DirectSolve::Apply(const std::vector<Rows>& impulses, std::vector<Vector6>& to) const {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const DirectContact& contact = contacts_[i];
    for (std::size_t row = 0; row < kDirectRows; ++row) {
      if (!contact.Has(row)) continue;
      if (contact.a >= 0) AddTimes(contact.on_a[row], impulses[i][row], to[static_cast<std::size_t>(contact.a)]);
      if (contact.b >= 0) AddTimes(contact.on_b[row], impulses[i][row], to[static_cast<std::size_t>(contact.b)]);
    }
  }
}

double DirectSolve::FrictionLimit(std::size_t contact) const {
  const DirectContact& of = contacts_[contact];
  double normal = of.impact;
  for (std::size_t row = 0; row < kDirectNormals; ++row) normal += anchor_[contact][row];
  return of.friction * normal;
}

double DirectSolve::TwistLimit(std::size_t contact) const {
  double limit = 0;
  for (std::size_t row = 0; row < kDirectNormals; ++row) limit += contacts_[contact].arm[row] * anchor_[contact][row];
  return limit;
}

// Friction that the last solve left below its limit holds.
std::uint8_t DirectSolve::FirstFree(std::size_t contact) const {
  const DirectContact& of = contacts_[contact];
  std::uint8_t rows = of.rows & kNormalRows;
  const double p = anchor_[contact][kDirectTangent], q = anchor_[contact][kDirectTangent + 1];
  if (std::sqrt(p * p + q * q) < kHolds * FrictionLimit(contact)) rows |= of.rows & kTangentRows;
  if (std::abs(anchor_[contact][kDirectTwist]) < kHolds * TwistLimit(contact)) rows |= of.rows & kTwistRow;
  return rows;
}

double DirectSolve::Ease(std::size_t contact, std::size_t row) const {
  return Dot6(contacts_[contact].on_a[row], contacts_[contact].on_a[row]) +
         Dot6(contacts_[contact].on_b[row], contacts_[contact].on_b[row]);
}

// Decides anew what slides, by the impulses and velocities of a round, and with what friction: a step against the
// motion as long as the contact alone would need to stop it, brought back to the limit. Returns whether that left what
// slides as it was, and friction within `tolerance`.
bool DirectSolve::Slide(double tolerance) {
  bool settled = true;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const DirectContact& contact = contacts_[i];
    const std::uint8_t before = free_[i];
    const Rows speeds = Measure(i, velocity_), old = anchor_[i];
    const auto wanted = [&](std::size_t row, std::uint8_t bits, double ease) {
      return (before & bits) != 0 || !(ease > 0) ? old[row] : old[row] - (speeds[row] + contact.bias[row]) / ease;
    };
    if ((contact.rows & kTangentRows) != 0) {
      const double ease = std::max(Ease(i, kDirectTangent), Ease(i, kDirectTangent + 1));
      double p = wanted(kDirectTangent, kTangentRows, ease), q = wanted(kDirectTangent + 1, kTangentRows, ease);
      const double limit = FrictionLimit(i), length = std::sqrt(p * p + q * q);
      const bool slides = length > limit;
      if (slides) {
        p *= limit / length;
        q *= limit / length;
      }
      anchor_[i][kDirectTangent] = p;
      anchor_[i][kDirectTangent + 1] = q;
      free_[i] = static_cast<std::uint8_t>(slides ? free_[i] & ~kTangentRows : free_[i] | kTangentRows);
    }
    if ((contact.rows & kTwistRow) != 0) {
      const double limit = TwistLimit(i), twist = wanted(kDirectTwist, kTwistRow, Ease(i, kDirectTwist));
      const bool slides = std::abs(twist) > limit;
      anchor_[i][kDirectTwist] = std::clamp(twist, -limit, limit);
      free_[i] = static_cast<std::uint8_t>(slides ? free_[i] & ~kTwistRow : free_[i] | kTwistRow);
    }
    settled &= free_[i] == before;
    for (std::size_t row = kDirectTangent; row < kDirectRows; ++row) {
      settled &= std::abs(anchor_[i][row] - old[row]) <= tolerance;
    }
  }
  return settled;
}

DirectSolve::Rows DirectSolve::Project(std::size_t contact, const Rows& speeds) const {
  Rows impulses = anchor_[contact];
  for (std::size_t row = 0; row < kDirectRows; ++row) {
    if (!IsFree(contact, row)) continue;
    impulses[row] -= stiffness_ * (speeds[row] + contacts_[contact].bias[row]);
    if (row < kDirectNormals) impulses[row] = std::max(impulses[row], 0.0);
  }
  return impulses;
}

// Adds the contact's part of the second derivative.
void DirectSolve::Assemble(std::size_t contact, const Rows& speeds) {
  const DirectContact& of = contacts_[contact];
  const Rows impulses = Project(contact, speeds);
  const auto acts = [&](std::size_t row) {
    return IsFree(contact, row) && (row >= kDirectNormals || impulses[row] > 0);
  };
  const auto product = [&](const std::array<Vector6, kDirectRows>& left,
                           const std::array<Vector6, kDirectRows>& right) {
    Matrix6 out{};
    for (std::size_t row = 0; row < kDirectRows; ++row) {
      if (!acts(row)) continue;
      for (std::size_t i = 0; i < 6; ++i) AddTimes(right[row], stiffness_ * left[row][i], out[i]);
    }
    return out;
  };
  const auto a = static_cast<std::uint32_t>(of.a), b = static_cast<std::uint32_t>(of.b);
  if (of.a >= 0) matrix_.Add(a, a, product(of.on_a, of.on_a));
  if (of.b >= 0) matrix_.Add(b, b, product(of.on_b, of.on_b));
  if (of.a >= 0 && of.b >= 0) matrix_.Add(a, b, product(of.on_a, of.on_b));
}

// Derivative of the function along the way. It grows, since the function is convex.
double DirectSolve::Slope(const std::vector<Rows>& speeds, const std::vector<Rows>& changes, double share) const {
  double slope = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    for (std::size_t k = 0; k < 6; ++k) slope += (velocity_[i][k] + share * way_[i][k] - base_[i][k]) * way_[i][k];
  }
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    Rows at = speeds[i];
    for (std::size_t row = 0; row < kDirectRows; ++row) at[row] += share * changes[i][row];
    const Rows impulses = Project(i, at);
    for (std::size_t row = 0; row < kDirectRows; ++row) slope -= impulses[row] * changes[i][row];
  }
  return slope;
}

double DirectSolve::LineSearch(const std::vector<Rows>& speeds, const std::vector<Rows>& changes) const {
  double low = 0, high = 1, at_low = Slope(speeds, changes, 0), at_high = Slope(speeds, changes, 1);
  const double enough = -kSlopeLeft * at_low;
  if (!(at_high > enough)) return 1;
  double share = 1;
  for (int i = 0; i < kLineSteps; ++i) {
    // By halves and by the secant in turn: the slope has corners.
    share = i % 2 == 0 ? low + (high - low) * at_low / (at_low - at_high) : (low + high) / 2;
    const double slope = Slope(speeds, changes, share);
    if (std::abs(slope) <= enough) break;
    (slope < 0 ? low : high) = share;
    (slope < 0 ? at_low : at_high) = slope;
  }
  return share;
}

// Brings `velocity_` to where it is what `impulse_` gives, by the anchors and limits at hand.
bool DirectSolve::Minimise() {
  std::vector<Rows> speeds(contacts_.size()), changes(contacts_.size());
  for (int newton = 0; newton <= kDirectNewton; ++newton) {
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      speeds[i] = Measure(i, velocity_);
      impulse_[i] = Project(i, speeds[i]);
    }
    way_ = base_;
    Apply(impulse_, way_);
    double error = 0;
    bool finite = true;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      for (std::size_t k = 0; k < 6; ++k) {
        way_[i][k] -= velocity_[i][k];
        const double own = std::abs(way_[i][k]) * bodies_[i].inverse_root_mass;
        error = std::max(error, own);
        finite &= std::isfinite(own);
      }
    }
    if (!finite) return false;
    if (error <= kSpeedTolerance_m_s) return true;
    if (newton == kDirectNewton) return false;
    matrix_.Clear();
    for (std::size_t i = 0; i < contacts_.size(); ++i) Assemble(i, speeds[i]);
    ++factorisations_;
    if (!matrix_.Factor()) return false;
    matrix_.Solve(way_);
    for (std::size_t i = 0; i < contacts_.size(); ++i) changes[i] = Measure(i, way_);
    const double share = LineSearch(speeds, changes);
    for (std::size_t i = 0; i < bodies_.size(); ++i) AddTimes(way_[i], share, velocity_[i]);
  }
  return false;
}

// Rounds, until neither impulses nor what slides change.
bool DirectSolve::Settle(bool with_friction) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) velocity_[i] = bodies_[i].velocity;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    for (std::size_t row = 0; row < kDirectRows; ++row) {
      anchor_[i][row] = contacts_[i].Has(row) ? contacts_[i].impulse[row] : 0;
      impulse_[i][row] = -anchor_[i][row];
    }
    free_[i] = with_friction ? FirstFree(i) : contacts_[i].rows & kNormalRows;
  }
  base_ = velocity_;
  Apply(impulse_, base_);
  for (int round = 0; round < kDirectRounds; ++round) {
    if (!Minimise()) return false;
    double change = 0, largest = 0;
    for (std::size_t i = 0; i < contacts_.size(); ++i) {
      for (std::size_t row = 0; row < kDirectRows; ++row) {
        change = std::max(change, std::abs(impulse_[i][row] - anchor_[i][row]));
        largest = std::max(largest, std::abs(impulse_[i][row]));
      }
    }
    anchor_ = impulse_;
    const double tolerance = kImpulseTolerance * largest;
    const bool settled = !with_friction || Slide(tolerance);
    if (settled && change <= tolerance) return true;
  }
  return false;
}

bool DirectSolve::Solve() {
  anchor_.resize(contacts_.size());
  impulse_.resize(contacts_.size());
  free_.resize(contacts_.size());
  velocity_.resize(bodies_.size());
  if (!Settle(true) && !Settle(false)) return false;
  velocity_ = base_;
  Apply(impulse_, velocity_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) bodies_[i].velocity = velocity_[i];
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    for (std::size_t row = 0; row < kDirectRows; ++row) {
      if (contacts_[i].Has(row)) contacts_[i].impulse[row] = impulse_[i][row];
    }
  }
  return true;
}

}  // namespace tessera::physics

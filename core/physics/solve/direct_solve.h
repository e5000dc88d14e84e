// DirectSolve: contacts of a few bodies that bear far more than they weigh, solved all at once.
//
// Relaxing contacts one by one passes a load on by one contact at a time, and the slower the heavier it is against what
// bears it. Here the velocities of all bodies are the unknowns of one convex problem, in which each contact is a
// one-sided spring, far stiffer than anything is heavy, and friction that holds one in both directions: an augmented
// Lagrangian (Nocedal and Wright, "Numerical Optimization", 17.3), whose multipliers are the impulses. It is minimised
// by Newton's method with a line search, each step one sparse factorisation (block_cholesky.h); then the impulses found
// become the rest positions of the springs and it is done again, until they no longer change. So the springs' give is
// no error of the outcome. Between two such rounds it is decided which contacts slide, and with what friction: within a
// round what slides has a constant one. A function with the limits of friction in it has kinks, finer than rounding,
// among which Newton's method does not end.
//
// Rounds do not always settle: a body that is wedged may neither slide nor hold. Then friction stays what it was, and
// the normal impulses alone are sought. Relaxing, which follows, sees to the friction.
//
// Promise: normal impulses are at least 0, friction is within its limits or was not touched, both bodies of a contact
// get opposite impulses, and the velocities are those that the impulses give. If no search ends nothing is changed.
// Work is bounded by 2 * kDirectRounds * kDirectNewton factorisations.
//
// Thread rule: one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/physics/solve/block_cholesky.h"

namespace tessera::physics {

inline constexpr int kDirectRounds = 8, kDirectNewton = 40;

// Rows of a contact: four normals, two tangents, the twist about the normal.
inline constexpr std::size_t kDirectNormals = 4, kDirectTangent = 4, kDirectTwist = 6, kDirectRows = 7;

struct DirectContact {
  std::int32_t a = -1, b = -1;  // bodies; -1: the world
  std::uint8_t rows = 0;        // a bit for each row that there is; others are neither read nor written
  // Velocity that an impulse of 1 along a row adds to each body (mass-normalised; a's includes the sign): also the way
  // to measure the velocity along the row.
  std::array<Vector6, kDirectRows> on_a{}, on_b{};
  std::array<double, kDirectRows> bias{};     // a normal is to come to at least -bias, another row to -bias, m/s
  std::array<double, kDirectRows> impulse{};  // in: those in the velocities; out: new ones
  double friction = 0, impact = 0;            // coefficient; impulse that friction may lean on besides the normals'
  std::array<double, kDirectNormals> arm{};   // limit of the twist by normal impulses, m

  bool Has(std::size_t row) const { return (rows >> row & 1) != 0; }
};

struct DirectBody {
  Vector6 velocity{};            // mass-normalised: sqrt(m) v, sqrt(I) w
  double inverse_root_mass = 1;  // next to nothing for a kinematic body
};

class DirectSolve {
 public:
  // Takes over bodies and contacts, and in which order to eliminate.
  void Begin(std::vector<DirectBody> bodies, std::vector<DirectContact> contacts);

  std::vector<DirectBody>& bodies() { return bodies_; }
  const std::vector<DirectBody>& bodies() const { return bodies_; }
  std::vector<DirectContact>& contacts() { return contacts_; }

  // Finds impulses and velocities. `false`: not found, and nothing was changed.
  bool Solve();

  int factorisations() const { return factorisations_; }  // since `Begin`

 private:
  using Rows = std::array<double, kDirectRows>;

  std::uint8_t FirstFree(std::size_t contact) const;
  bool Settle(bool with_friction);
  bool Slide(double tolerance);
  bool IsFree(std::size_t contact, std::size_t row) const { return (free_[contact] >> row & 1) != 0; }
  double FrictionLimit(std::size_t contact) const;
  double TwistLimit(std::size_t contact) const;
  // Velocity along a row for an impulse of 1 along it, 1 / kg.
  double Ease(std::size_t contact, std::size_t row) const;
  bool Minimise();
  void Apply(const std::vector<Rows>& impulses, std::vector<Vector6>& to) const;
  Rows Measure(std::size_t contact, const std::vector<Vector6>& velocities) const;
  // Impulses for velocities along the rows.
  Rows Project(std::size_t contact, const Rows& speeds) const;
  void Assemble(std::size_t contact, const Rows& speeds);
  // Share of the way to go along `way_`.
  double LineSearch(const std::vector<Rows>& speeds, const std::vector<Rows>& changes) const;
  double Slope(const std::vector<Rows>& speeds, const std::vector<Rows>& changes, double share) const;

  std::vector<DirectBody> bodies_;
  std::vector<DirectContact> contacts_;
  BlockCholesky matrix_;
  double stiffness_ = 0;  // kg: an impulse for a velocity
  int factorisations_ = 0;
  // Scratch memory of a solve.
  std::vector<Vector6> base_, velocity_, way_;  // by body: velocities without the impulses; now; the way to go
  std::vector<Rows> anchor_, impulse_;          // by contact
  std::vector<std::uint8_t> free_;  // by contact: rows whose impulses are sought, a bit each; others keep theirs
};

}  // namespace tessera::physics

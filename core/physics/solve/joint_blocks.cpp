#include "core/physics/solve/joint_blocks.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "core/physics/solve/packed_vector.h"
#include "core/physics/solve/solved_access.h"
#include "core/physics/solve/tuning.h"
#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

// Locked rows that keep less than this share of their square beside the others are implied by them.
constexpr float kImplied = 1e-6f;
// The last impulses of a joint whose bodies turn further than this in a substep, rad^2, point anywhere; to start with
// them would feed it energy.
constexpr float kLostTurn2 = 0.25f;

// (x0 + x1) + (x2 + x3).
float SumOfPairs(__m128 x) {
  const __m128 pairs = _mm_add_ps(x, _mm_shuffle_ps(x, x, _MM_SHUFFLE(2, 3, 0, 1)));
  return _mm_cvtss_f32(_mm_add_ss(pairs, _mm_movehl_ps(pairs, pairs)));
}

// The vectors of a row that are mass-normalised, in the order in which they lie.
struct PackedRow {
  explicit PackedRow(const JointRow& row)
      : vectors{PackedVector::Load(row.linear_a), PackedVector::Load(row.angular_a), PackedVector::Load(row.linear_b),
                PackedVector::Load(row.angular_b)} {}
  PackedVector vectors[4];
};

float Velocity(const JointRow& row, const SolvedState& a, const SolvedState& b) {
  const PackedVector motion[4] = {PackedVector::Load(a.velocity), PackedVector::Load(a.spin),
                                  PackedVector::Load(b.velocity), PackedVector::Load(b.spin)};
  return SumOfPairs(Dots(PackedRow(row).vectors, motion));
}

template <class Body>
void Apply(const JointRow& row, float impulse, Body& a, Body& b) {
  const PackedRow packed(row);
  (packed.vectors[0] * impulse).AddTo(a.velocity);
  (packed.vectors[1] * impulse).AddTo(a.spin);
  (packed.vectors[2] * impulse).AddTo(b.velocity);
  (packed.vectors[3] * impulse).AddTo(b.spin);
}

// (linear_a + angular_a) + (linear_b + angular_b), each part a dot product.
float Product(const JointRow& p, const JointRow& q) {
  return SumOfPairs(Dots(PackedRow(p).vectors, PackedRow(q).vectors));
}

// Subtract: p -= s q. Scale: p *= s.
void Subtract(JointRow& p, float s, const JointRow& q) {
  const PackedRow of_p(p), of_q(q);
  const PackedVector linear = PackedVector::Load(p.linear) - PackedVector::Load(q.linear) * s;
  (of_p.vectors[0] - of_q.vectors[0] * s).StoreOver(p.linear_a);
  (of_p.vectors[1] - of_q.vectors[1] * s).StoreOver(p.angular_a);
  (of_p.vectors[2] - of_q.vectors[2] * s).StoreOver(p.linear_b);
  (of_p.vectors[3] - of_q.vectors[3] * s).StoreOver(p.angular_b);
  p.linear = linear.Get();
  p.error -= q.error * s;
}
void Scale(JointRow& p, float s) {
  const PackedRow packed(p);
  const Vec3f linear = p.linear;
  (packed.vectors[0] * s).StoreOver(p.linear_a);
  (packed.vectors[1] * s).StoreOver(p.angular_a);
  (packed.vectors[2] * s).StoreOver(p.linear_b);
  (packed.vectors[3] * s).StoreOver(p.angular_b);
  p.linear = linear * s;
  p.error *= s;
}

// The force of a spring is taken at the error that it has now, which conserves energy, or at the error after the
// substep, which holds however stiff the spring is; in between by how far it swings in a substep.
void MakeSpring(const Row& row, float h, JointRow& out) {
  const float inverse_mass = Product(out, out);
  const float swing = h * h * row.stiffness * inverse_mass;
  const float ahead = std::min(1.0f, swing);
  out.stiffness = h * row.stiffness;
  out.damping = h * (row.damping + ahead * h * row.stiffness);
  out.mass = 1 / (1 + out.damping * inverse_mass);
}

// The turn of a body since the start of the step.
struct TurnedAxes {
  static constexpr float kFraction = 0.25f;  // square of half the turn, rad^2, up to which the fraction is good
  // The quaternion (x tan |x| / |x|, 1) / |...| turns by 2 x; the tangent as a fraction, after Pade. Larger turns by
  // sine and cosine: a link at the end of a whip turns by several radians in a step.
  explicit TurnedAxes(Vec3f turned) {
    const Vec3f x = turned * 0.5f;
    const float square = LengthSquared(x);
    if (square > kFraction) {
      const double angle = std::sqrt(double{square});
      const SinCos half = SinCosOf(angle);
      u = x * static_cast<float>(half.sin / angle);
      w = static_cast<float>(half.cos);
      return;
    }
    u = x * (105 - 10 * square);
    w = 105 - (45 - square) * square;
    const float scale = 1 / std::sqrt(w * w + LengthSquared(u));
    u *= scale;
    w *= scale;
  }
  Vec3f operator()(Vec3f v) const {
    const Vec3f t = 2.0f * Cross(u, v);
    return v + w * t + Cross(u, t);
  }
  Vec3f u;
  float w;
};

float Clamp(float x, float limit) { return std::max(-limit, std::min(x, limit)); }

// Turns as TurnedAxes does.
struct PackedAxes {
  explicit PackedAxes(const TurnedAxes& axes) : u(PackedVector::Of(axes.u)), w(axes.w) {}
  PackedVector operator()(PackedVector v) const {
    const PackedVector t = Cross(u, v) * 2.0f;
    return v + t * w + Cross(u, t);
  }
  PackedVector u;
  float w;
};

// A joint's point and axes where its bodies are now.
struct Stance {
  Stance(const JointRows& rows, const SolvedState& a, const SolvedState& b)
      : axes(TurnedAxes(Get(a.turned))),
        turned_a(PackedVector::Load(a.turned)),
        turned_b(PackedVector::Load(b.turned)),
        start_gap(PackedVector::Of(rows.gap)),
        start_arm_a(PackedVector::Load(rows.arm_a) + start_gap),
        start_arm_b(PackedVector::Load(rows.arm_b)) {
    const PackedVector from_a = PackedVector::Load(rows.arm_a), arm = axes(from_a);
    arm_b = PackedAxes(TurnedAxes(Get(b.turned)))(start_arm_b);
    const PackedVector moved = PackedVector::Load(b.moved) - PackedVector::Load(a.moved);
    gap = start_gap + (moved + ((arm_b - start_arm_b) - (arm - from_a)));
    arm_a = arm + gap;
  }
  PackedAxes axes;
  PackedVector turned_a, turned_b;
  PackedVector start_gap, start_arm_a, start_arm_b;  // arms: from each centre of mass to the point on b, at the start
  PackedVector gap, arm_a, arm_b;                    // now
};

// A body of a joint, as its rows need it.
struct PackedMass {
  explicit PackedMass(const SolvedMass& mass) : root_inertia(mass.root_inertia), inverse_root(mass.inverse_root_mass) {}
  PackedMatrix root_inertia;
  float inverse_root;
};

// Makes a row, and returns the square of its vectors.
float MakeRow(const Row& row, const Stance& stance, const PackedMass& a, const PackedMass& b, float h, float bias_rate,
              JointRow& out) {
  const PackedVector start_linear = PackedVector::Load(row.linear);
  // The row's angular part beyond the motion of the joint's point.
  const PackedVector extra_a = stance.axes(PackedVector::Load(row.angular_a) - Cross(stance.start_arm_a, start_linear));
  const PackedVector extra_b = stance.axes(PackedVector::Of(row.angular_b) - Cross(stance.start_arm_b, start_linear));
  const PackedVector linear = stance.axes(start_linear);
  // In the order in which they lie, since each store writes the first number of the next vector too.
  (linear * -a.inverse_root).StoreOver(out.linear_a);
  (a.root_inertia * -(extra_a + Cross(stance.arm_a, linear))).StoreOver(out.angular_a);
  (linear * b.inverse_root).StoreOver(out.linear_b);
  (b.root_inertia * (extra_b + Cross(stance.arm_b, linear))).StoreOver(out.angular_b);
  out.linear = linear.Get();
  const __m128 parts =
      Dots({linear, start_linear, extra_b, extra_a}, {stance.gap, stance.start_gap, stance.turned_b, stance.turned_a});
  alignas(16) float dots[4];
  _mm_store_ps(dots, parts);
  out.error = row.error + ((dots[0] - dots[1]) + (dots[2] - dots[3]));
  if (row.kind == RowKind::kLocked || row.kind == RowKind::kLimit) {
    const float most = (row.linear == Vec3f() ? kJointPush_rad_s : kJointPush_m_s) / bias_rate;
    out.error = row.kind == RowKind::kLimit ? std::max(out.error, -most) : Clamp(out.error, most);
  }
  out.kind = row.kind;
  out.relax_error = 0;
  out.target_velocity = row.target_velocity;
  out.max_impulse = row.max_force * h;
  out.stiffness = out.damping = 0;
  const float square = Product(out, out);
  out.mass = square > 0 ? 1 / square : 0;
  if (row.kind == RowKind::kSpring) MakeSpring(row, h, out);
  return square;
}

// Makes one more step of Gram and Schmidt. `square` is that of the row's vectors. Returns false if the row adds nothing
// to those before it.
bool Orthonormalize(JointBlock& block, JointRow& row, float square) {
  auto& lower = block.lower[At(block.locked)];
  for (int j = 0; j < block.locked; ++j) {
    const JointRow& other = block.rows[At(j)];
    lower[At(j)] = Product(row, other);
    Subtract(row, lower[At(j)], other);
  }
  const float left = block.locked == 0 ? square : Product(row, row);
  if (!(left > kImplied * square)) return false;
  const float length = std::sqrt(left);
  lower[At(block.locked)] = length;
  Scale(row, 1 / length);
  row.mass = 1;
  return true;
}

// Makes the rows where the bodies are now, with the impulses in `block.impulses`.
void MakeRows(const SolvedState* states, const SolvedMass* masses, float h, float bias_rate, JointBlock& block) {
  const JointRows& rows = *block.from;
  const Stance stance(rows, states[block.a], states[block.b]);
  const PackedMass mass_a(masses[block.a]), mass_b(masses[block.b]);
  block.arm_a = stance.arm_a.Get();
  block.arm_b = stance.arm_b.Get();
  block.gap_m = 0;
  block.locked = block.count = 0;
  for (int i = 0; i < rows.count; ++i) {
    const Row& from = rows.rows[At(i)];
    JointRow& row = block.rows[At(block.count)];  // the next row takes its place unless it is kept
    const float square = MakeRow(from, stance, mass_a, mass_b, h, bias_rate, row);
    row.origin = static_cast<std::uint8_t>(i);
    row.impulse = block.impulses[At(i)];
    if (from.kind == RowKind::kLocked) {
      block.gap_m = std::max(block.gap_m, std::abs(row.error));
      assert(block.locked == block.count);  // locked rows come first
      if (block.locked == kLockedRows || !Orthonormalize(block, row, square)) continue;
      ++block.locked;
    } else if (!(row.mass > 0)) {
      continue;
    }
    ++block.count;
  }
  // Impulses along the orthonormal rows are transpose(L) times those along the joint's own; row j no longer needs its
  // own.
  for (int j = 0; j < block.locked; ++j) {
    float sum = 0;
    for (int i = j; i < block.locked; ++i) sum += block.lower[At(i)][At(j)] * block.rows[At(i)].impulse;
    block.rows[At(j)].impulse = sum;
  }
}

// Solves transpose(L) x = impulses: takes the impulses back to the joint's own rows.
void ToOwnRows(JointBlock& block) {
  block.impulses.fill(0);
  for (int i = block.count - 1; i >= 0; --i) {
    float x = block.rows[At(i)].impulse;
    if (i < block.locked) {
      for (int j = i + 1; j < block.locked; ++j)
        x -= block.lower[At(j)][At(i)] * block.impulses[block.rows[At(j)].origin];
      x /= block.lower[At(i)][At(i)];
    }
    block.impulses[block.rows[At(i)].origin] = x;
  }
}

// Square of the angle by which the faster of a joint's bodies turns in a substep, rad^2.
float TurnInSubstep2(const JointBlock& block, const SolvedState* states, const SolvedMass* masses, float h) {
  return h * h *
         std::max(LengthSquared(RootInertia(masses[block.a]) * Get(states[block.a].spin)),
                  LengthSquared(RootInertia(masses[block.b]) * Get(states[block.b].spin)));
}

// The velocity at which the turning of both bodies carries the joint's point off its straight line, as seen from a:
// that of centripetal and Coriolis acceleration over half a substep. A substep then follows the chord of a pendulum's
// arc rather than its tangent, and turning the rows at its end loses no energy.
Vec3f Curving(const JointBlock& block, const SolvedState* states, const SolvedMass* masses, float h) {
  const SolvedState &a = states[block.a], &b = states[block.b];
  const Vec3f w_a = RootInertia(masses[block.a]) * Get(a.spin), w_b = RootInertia(masses[block.b]) * Get(b.spin);
  const Vec3f turn_a = Cross(w_a, block.arm_a), turn_b = Cross(w_b, block.arm_b);
  const Vec3f seen = (Get(b.velocity) * masses[block.b].inverse_root_mass + turn_b) -
                     (Get(a.velocity) * masses[block.a].inverse_root_mass + turn_a);
  // The share falls for bodies that turn too far in a substep for the second order to hold.
  const float turn = h * h * std::max(LengthSquared(w_a), LengthSquared(w_b));
  const float most = block.in_tree ? kTreeCurvingTurn2 : kCurvingTurn2;
  const float fade = std::min(1.0f, most / std::max(turn, most));
  return (Cross(w_b, turn_b) - Cross(w_a, turn_a + 2.0f * seen)) * (0.5f * h * fade * fade);
}

// The impulse that a row has once it has met this velocity.
float Wanted(const JointRow& row, float velocity, const StepConstants& step, Softness softness, bool relax) {
  switch (row.kind) {
    case RowKind::kLocked:
      if (relax) return row.impulse - row.mass * velocity;
      return row.impulse - softness.impulse * row.impulse -
             softness.mass * row.mass * (velocity + softness.bias_rate * row.error);
    case RowKind::kLimit: {
      if (row.error > 0) return std::max(0.0f, row.impulse - row.mass * (velocity + row.error * step.inverse_h));
      if (relax) return std::max(0.0f, row.impulse - row.mass * velocity);
      return std::max(0.0f, row.impulse - softness.impulse * row.impulse -
                                softness.mass * row.mass * (velocity + softness.bias_rate * row.error));
    }
    case RowKind::kMotor:
      return Clamp(row.impulse - row.mass * (velocity - row.target_velocity), row.max_impulse);
    case RowKind::kSpring: {
      const float error = relax ? row.relax_error : row.error;
      return Clamp(row.impulse - row.mass * (row.damping * velocity + row.stiffness * error + row.impulse),
                   row.max_impulse);
    }
  }
  return 0;
}

}  // namespace

void JointBlocks::Fill(std::span<const JointConstraint> joints, const Coloring& coloring, const SolvedState* states,
                       const SolvedMass* masses, std::uint32_t nobody, float h) {
  softness_ = SoftnessOf(kJointShare, kJointDamping, h);
  if (joints.empty() && blocks_.empty()) return;
  const std::span<const std::uint8_t> colors = coloring.joints();
  blocks_.resize(joints.size());
  joint_of_.resize(joints.size());
  order_.resize(joints.size());
  std::array<std::uint32_t, kColors + 2> next{};
  for (const std::uint8_t color : colors) ++next[color + std::size_t{1}];
  for (std::size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::uint32_t at = next[colors[i]]++;
    joint_of_[at] = static_cast<std::uint32_t>(i);
    order_[i] = at;
    const JointConstraint& joint = joints[i];
    JointBlock& block = blocks_[at];
    block.a = joint.a == kStatic ? nobody : joint.a;
    block.b = joint.b == kStatic ? nobody : joint.b;
    block.from = joint.rows;
    assert(joint.rows->count >= 0 && joint.rows->count <= kJointRows);
    for (int k = 0; k < joint.rows->count; ++k) {
      block.impulses[At(k)] = joint.impulses[joint.rows->rows[At(k)].slot] * joint.warm_scale;
    }
    MakeRows(states, masses, h, softness_.bias_rate, block);
  }
  forest_.Grow(blocks_, order_, nobody);
  forest_.Factor(blocks_);
}

void JointBlocks::Warm(SolvedState* states) const {
  for (const JointBlock& block : blocks_) {
    for (int i = 0; i < block.count; ++i) {
      const JointRow& row = block.rows[At(i)];
      Apply(row, row.impulse, states[block.a], states[block.b]);
    }
  }
}

void JointBlocks::Turn(SolvedState* states, const SolvedMass* masses, SolvedMemory* before, float h) {
  const auto remember = [&](const JointBlock& block, float sign) {
    for (int i = 0; i < block.count; ++i) {
      const JointRow& row = block.rows[At(i)];
      Apply(row, sign * row.impulse, before[block.a], before[block.b]);
    }
  };
  for (JointBlock& block : blocks_) {
    remember(block, 1);
    ToOwnRows(block);
    if (TurnInSubstep2(block, states, masses, h) > kLostTurn2) block.impulses.fill(0);
    for (int i = block.locked; i < block.count; ++i)
      block.last_errors[block.rows[At(i)].origin] = block.rows[At(i)].error;
    MakeRows(states, masses, h, softness_.bias_rate, block);
  }
  if (!forest_.empty()) Rejoin(states, masses, h);
  for (JointBlock& block : blocks_) {
    for (int i = block.locked; i < block.count; ++i) {
      block.rows[At(i)].relax_error = block.last_errors[block.rows[At(i)].origin];
    }
    remember(block, -1);
  }
}

// Turning carries a joint's point off its straight line by the square of the turn. Connected joints are put back into
// place as a whole, without a change of velocity, and once more where the way back was so long that it curved.
void JointBlocks::Rejoin(SolvedState* states, const SolvedMass* masses, float h) {
  forest_.Factor(blocks_);
  for (int round = 0; round < kRejoinRounds; ++round) {
    float widest = 0;
    for (JointBlock& block : blocks_) {
      if (!block.in_tree) continue;
      widest = std::max(widest, block.gap_m);
      for (int i = 0; i < block.locked; ++i) block.wanted[At(i)] = block.rows[At(i)].error;
    }
    forest_.Solve(blocks_);
    forest_.Place(blocks_, states, masses);
    if (widest < kCurvedGap_m) break;
    for (JointBlock& block : blocks_) {
      if (block.in_tree) MakeRows(states, masses, h, softness_.bias_rate, block);
    }
    forest_.Factor(blocks_);
  }
}

void JointBlocks::Solve(SolvedState* states, const SolvedMass* masses, const StepConstants& step, bool relax) {
  for (JointBlock& block : blocks_) {
    SolvedState &a = states[block.a], &b = states[block.b];
    if (block.in_tree && block.locked == block.count) continue;
    const Vec3f curving = relax ? Vec3f() : Curving(block, states, masses, step.h);
    const auto solve = [&](int i) {
      JointRow& row = block.rows[At(i)];
      const bool holds = row.kind == RowKind::kLocked || row.kind == RowKind::kLimit;
      const float offset = holds ? Dot(row.linear, curving) : 0;
      const float impulse = Wanted(row, Velocity(row, a, b) + offset, step, softness_, relax);
      Apply(row, impulse - row.impulse, a, b);
      row.impulse = impulse;
    };
    for (int i = block.locked; i < block.count; ++i) solve(i);
    for (int i = 0; i < (block.in_tree ? 0 : block.locked); ++i) solve(i);
  }
  if (!forest_.empty()) SolveForest(states, masses, step, relax);
}

void JointBlocks::SolveForest(SolvedState* states, const SolvedMass* masses, const StepConstants& step, bool relax) {
  for (JointBlock& block : blocks_) {
    if (!block.in_tree) continue;
    const SolvedState &a = states[block.a], &b = states[block.b];
    const Vec3f curving = relax ? Vec3f() : Curving(block, states, masses, step.h);
    for (int i = 0; i < block.locked; ++i) {
      const JointRow& row = block.rows[At(i)];
      const float bias = relax ? 0 : Dot(row.linear, curving) + softness_.bias_rate * row.error;
      block.wanted[At(i)] = Velocity(row, a, b) + bias;
    }
  }
  forest_.Solve(blocks_);
  forest_.Push(blocks_, states);
}

void JointBlocks::Store(std::span<const JointConstraint> joints) {
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    JointBlock& block = blocks_[k];
    const JointConstraint& joint = joints[joint_of_[k]];
    ToOwnRows(block);
    std::fill_n(joint.impulses, kJointSlots, 0.0f);
    for (int i = 0; i < block.from->count; ++i) joint.impulses[block.from->rows[At(i)].slot] = block.impulses[At(i)];
  }
}

}  // namespace tessera::physics

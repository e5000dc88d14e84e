// The contact kernels, once for all instruction sets; included by kernel_*.cpp only.

#include "core/physics/solve/tuning.h"
#include "core/physics/solve/wide.h"

namespace tessera::physics {
namespace {

// Index of the entry of points i and j in the upper half of their matrix.
constexpr int Coupling(int i, int j, int points) {
  return i <= j ? i * points - i * (i - 1) / 2 + (j - i) : Coupling(j, i, points);
}

TESSERA_INLINE F Inverse(F x) { return And(Positive(x), Wide(1) / x); }

// Inverts [k11 k12; k12 k22] and its larger eigenvalue; zeros where the matrix is singular.
TESSERA_INLINE void InvertSymmetric(F k11, F k22, F k12, Lanes (&inverse)[3], Lanes& slide_mass) {
  const F determinant = k11 * k22 - k12 * k12;
  const F regular = Positive(determinant - Wide(1e-6f) * k11 * k22);
  const F d = And(regular, Wide(1) / determinant);
  Store(inverse[0], k22 * d);
  Store(inverse[1], k11 * d);
  Store(inverse[2], Wide(0) - k12 * d);
  const F difference = k11 - k22;
  Store(slide_mass, Inverse(Wide(0.5f) * (k11 + k22 + Sqrt(difference * difference + Wide(4) * k12 * k12))));
}

// Solves two rows whose impulses lie in a disc. Where the impulse that stops all motion would leave the disc, a step
// along the velocity itself is taken and brought back to the rim: such steps come to rest at an impulse straight
// against the motion, also where the two rows differ in effective mass.
struct DiscStep {
  F p0, p1;  // new impulses
};
TESSERA_INLINE DiscStep SolveDisc(F v0, F v1, F p0, F p1, const Lanes (&inverse)[3], const Lanes& slide_mass,
                                  F radius) {
  const F i11 = Load(inverse[0]), i22 = Load(inverse[1]), i12 = Load(inverse[2]);
  const F stick0 = p0 - (i11 * v0 + i12 * v1), stick1 = p1 - (i12 * v0 + i22 * v1);
  const F limit = radius * radius;
  const F slides = Positive(stick0 * stick0 + stick1 * stick1 - limit);
  const F m = Load(slide_mass);
  const F slide0 = p0 - m * v0, slide1 = p1 - m * v1;
  const F square = slide0 * slide0 + slide1 * slide1;
  const F scale = Select(Positive(square - limit), radius / Sqrt(square), Wide(1));
  return {Select(slides, slide0 * scale, stick0), Select(slides, slide1 * scale, stick1)};
}

template <int kPoints, Tangent kTangent>
struct ContactLoops {
  using Block = ContactBlock<kPoints, kTangent>;

  static void PrepareFriction(Block& block, const MassOf& mass_a, const MassOf& mass_b, V n, V offset, F linear) {
    // Duff et al., "Building an Orthonormal Basis, Revisited", 2017.
    const F sign = SignOf(n.z);
    const F p = Wide(-1) / (sign + n.z), q = n.x * n.y * p;
    const V t[2] = {{Wide(1) + sign * n.x * n.x * p, sign * q, Wide(0) - sign * n.x},
                    {q, sign + n.y * n.y * p, Wide(0) - n.y}};
    V middle{Wide(0), Wide(0), Wide(0)};
    for (int i = 0; i < kPoints; ++i) middle = middle + Load(block.points[i].r_a) * Load(block.weight[i]);
    FrictionLanes& friction = block.friction;
    V angular_a[2], angular_b[2];
    for (int k = 0; k < 2; ++k) {
      angular_a[k] = mass_a * Cross(middle, t[k]);
      angular_b[k] = mass_b * Cross(middle - offset, t[k]);
      Store(friction.tangent[k], t[k]);
      Store(friction.angular_a[k], angular_a[k]);
      Store(friction.angular_b[k], angular_b[k]);
    }
    InvertSymmetric(linear + Dot(angular_a[0], angular_a[0]) + Dot(angular_b[0], angular_b[0]),
                    linear + Dot(angular_a[1], angular_a[1]) + Dot(angular_b[1], angular_b[1]),
                    Dot(angular_a[0], angular_a[1]) + Dot(angular_b[0], angular_b[1]), friction.inverse,
                    friction.slide_mass);
    // The impulse came as a world vector, of which the third component is unused.
    const V impulse{Load(friction.impulse[0]), Load(friction.impulse[1]), Load(friction.total[0])};
    Store(friction.impulse[0], Dot(impulse, t[0]));
    Store(friction.impulse[1], Dot(impulse, t[1]));
    Store(friction.total[0], Wide(0));
    Store(friction.total[1], Wide(0));
    if constexpr (Block::kHasTwist) PrepareTwist(block, mass_a, mass_b, n, middle);
    if constexpr (Block::kHasRolling) PrepareRolling(block, mass_a, mass_b, t);
  }

  static void PrepareTwist(Block& block, const MassOf& mass_a, const MassOf& mass_b, V n, V middle) {
    const V angular_a = mass_a * n, angular_b = mass_b * n;
    auto& twist = block.twist;
    Store(twist.angular_a, angular_a);
    Store(twist.angular_b, angular_b);
    Store(twist.mass, Inverse(Dot(angular_a, angular_a) + Dot(angular_b, angular_b)));
    const F coefficient = Load(block.friction.coefficient);
    for (int i = 0; i < kPoints; ++i) {
      const V arm = Load(block.points[i].r_a) - middle;
      // arm[i] came as the coefficient of spinning.
      Store(twist.arm[i], coefficient * Sqrt(Dot(arm, arm)) + Load(twist.arm[i]));
    }
  }

  static void PrepareRolling(Block& block, const MassOf& mass_a, const MassOf& mass_b, const V (&t)[2]) {
    RollingLanes& rolling = block.rolling;
    V a[2], b[2];
    for (int k = 0; k < 2; ++k) {
      a[k] = mass_a * t[k];
      b[k] = mass_b * t[k];
      Store(rolling.angular_a[k], a[k]);
      Store(rolling.angular_b[k], b[k]);
    }
    InvertSymmetric(Dot(a[0], a[0]) + Dot(b[0], b[0]), Dot(a[1], a[1]) + Dot(b[1], b[1]),
                    Dot(a[0], a[1]) + Dot(b[0], b[1]), rolling.inverse, rolling.slide_mass);
    const V impulse{Load(rolling.impulse[0]), Load(rolling.impulse[1]), Load(rolling.total[0])};
    Store(rolling.impulse[0], Dot(impulse, t[0]));
    Store(rolling.impulse[1], Dot(impulse, t[1]));
    Store(rolling.total[0], Wide(0));
    Store(rolling.total[1], Wide(0));
  }

  static void PrepareBlock(Block& block, SolvedBodies bodies) {
    ContactHead& head = block.head;
    const MassOf mass_a = GatherMass(bodies.masses, head.a), mass_b = GatherMass(bodies.masses, head.b);
    Store(head.inverse_root_mass_a, mass_a.inverse_root_mass);
    Store(head.inverse_root_mass_b, mass_b.inverse_root_mass);
    const V n = Load(head.normal), offset = Load(head.offset);
    const F linear =
        mass_a.inverse_root_mass * mass_a.inverse_root_mass + mass_b.inverse_root_mass * mass_b.inverse_root_mass;
    V angular_a[kPoints], angular_b[kPoints];
    TESSERA_UNROLL
    for (int i = 0; i < kPoints; ++i) {
      PointLanes& point = block.points[i];
      const V r_a = Load(point.r_a);
      angular_a[i] = mass_a * Cross(r_a, n);
      angular_b[i] = mass_b * Cross(r_a - offset, n);
      Store(point.angular_a, angular_a[i]);
      Store(point.angular_b, angular_b[i]);
      // point.mass came as 1 where there is a point, 0 elsewhere.
      const F there = Load(point.mass);
      Store(point.mass, there * Inverse(linear + Dot(angular_a[i], angular_a[i]) + Dot(angular_b[i], angular_b[i])));
      Store(point.separation, Load(point.start_separation));
      Store(point.total, Wide(0));
    }
    TESSERA_UNROLL
    for (int i = 0; i < kPoints; ++i) {
      TESSERA_UNROLL
      for (int j = i; j < kPoints; ++j) {
        Store(block.coupling[Coupling(i, j, kPoints)],
              linear + Dot(angular_a[i], angular_a[j]) + Dot(angular_b[i], angular_b[j]));
      }
    }
    if constexpr (Block::kHasFriction) PrepareFriction(block, mass_a, mass_b, n, offset, linear);
    const V none{Wide(0), Wide(0), Wide(0)};
    Store(block.lever_arm.apart, none);
    Store(block.lever_arm.made, none);
  }

  // The velocities of both bodies, which constraints change.
  struct Both {
    Motion a, b;
    F inverse_root_mass_a, inverse_root_mass_b;

    TESSERA_INLINE V Relative() const { return b.v * inverse_root_mass_b - a.v * inverse_root_mass_a; }
    TESSERA_INLINE void Push(V impulse) {
      a.v = a.v - impulse * inverse_root_mass_a;
      b.v = b.v + impulse * inverse_root_mass_b;
    }
    TESSERA_INLINE F Spin(const Lanes (&angular_a)[3], const Lanes (&angular_b)[3]) const {
      return Dot(Load(angular_b), b.w) - Dot(Load(angular_a), a.w);
    }
    TESSERA_INLINE void Turn(const Lanes (&angular_a)[3], const Lanes (&angular_b)[3], F impulse) {
      a.w = a.w - Load(angular_a) * impulse;
      b.w = b.w + Load(angular_b) * impulse;
    }
  };
  static TESSERA_INLINE Both Fetch(const Block& block, const SolvedState* states) {
    return {GatherVelocity(states, block.head.a), GatherVelocity(states, block.head.b),
            Load(block.head.inverse_root_mass_a), Load(block.head.inverse_root_mass_b)};
  }
  static TESSERA_INLINE void PutBack(const Block& block, SolvedBodies bodies, const Both& both) {
    ScatterVelocity(bodies.states, block.head.a, both.a);
    ScatterVelocity(bodies.states, block.head.b, both.b);
  }

  static void WarmBlock(const Block& block, SolvedBodies bodies) {
    Both both = Fetch(block, bodies.states);
    F sum = Wide(0);
    for (int i = 0; i < kPoints; ++i) {
      const F impulse = Load(block.points[i].impulse);
      sum = sum + impulse;
      both.Turn(block.points[i].angular_a, block.points[i].angular_b, impulse);
    }
    V push = Load(block.head.normal) * sum;
    if constexpr (Block::kHasFriction) {
      const FrictionLanes& friction = block.friction;
      for (int k = 0; k < 2; ++k) {
        const F impulse = Load(friction.impulse[k]);
        push = push + Load(friction.tangent[k]) * impulse;
        both.Turn(friction.angular_a[k], friction.angular_b[k], impulse);
      }
    }
    both.Push(push);
    if constexpr (Block::kHasTwist) {
      both.Turn(block.twist.angular_a, block.twist.angular_b, Load(block.twist.impulse));
    }
    if constexpr (Block::kHasRolling) {
      for (int k = 0; k < 2; ++k) {
        both.Turn(block.rolling.angular_a[k], block.rolling.angular_b[k], Load(block.rolling.impulse[k]));
      }
    }
    PutBack(block, bodies, both);
  }

  // How a turn t changes separations, to the second order: n . (R r - r) = c . r with
  // c = n x t + (n . t) t / 2 - n (t . t) / 2.
  static TESSERA_INLINE V TurnOf(V n, V turned) {
    const F half = Wide(0.5f);
    return Cross(n, turned) + turned * (half * Dot(n, turned)) - n * (half * Dot(turned, turned));
  }
  // Updates separations by how the bodies have moved and turned. Returns how far b has moved against a. A body that has
  // turned far shows another side by then, so its turning opens no gap.
  static TESSERA_INLINE V Measure(Block& block, SolvedBodies bodies) {
    const Motion a = GatherMoved(bodies.states, block.head.a), b = GatherMoved(bodies.states, block.head.b);
    const V n = Load(block.head.normal);
    const V turn_a = TurnOf(n, a.w), turn_b = TurnOf(n, b.w);
    // A round surface turns without coming nearer or going away; only its middle is carried along.
    const F rounds = Dot(turn_b, n) * Load(block.head.round_b) + Dot(turn_a, n) * Load(block.head.round_a);
    const V apart = b.v - a.v;
    const F shared = Dot(n, apart) - Dot(turn_b, Load(block.head.offset)) + rounds;
    const V turn = turn_b - turn_a;
    TESSERA_UNROLL
    for (PointLanes& point : block.points) {
      Store(point.separation, Load(point.start_separation) + (shared + Dot(turn, Load(point.r_a))));
    }
    const F most = Max(Dot(a.w, a.w), Dot(b.w, b.w));
    const F about = Positive(most - Wide(kOtherSide_rad * kOtherSide_rad));
    if (Bits(about) != 0) {
      const F moved = Dot(n, apart);
      for (PointLanes& point : block.points) {
        const F separation = Load(point.separation), unturned = Load(point.start_separation) + moved;
        Store(point.separation, Select(about, Min(separation, unturned), separation));
      }
    }
    return apart;
  }

  // The whole impulse of the contact on b.
  static TESSERA_INLINE V Impulse(const Block& block) {
    F sum = Load(block.points[0].impulse);
    for (int i = 1; i < kPoints; ++i) sum = sum + Load(block.points[i].impulse);
    V impulse = Load(block.head.normal) * sum;
    if constexpr (Block::kHasFriction) {
      for (int k = 0; k < 2; ++k) {
        impulse = impulse + Load(block.friction.tangent[k]) * Load(block.friction.impulse[k]);
      }
    }
    return impulse;
  }

  // The impulse at a point after which it has the velocity that it should have.
  template <bool kRelax>
  static TESSERA_INLINE F Wanted(const Block& block, int i, F velocity, F old, const StepConstants& step) {
    const PointLanes& point = block.points[i];
    const F mass = Load(point.mass);
    if constexpr (kRelax) {
      // A point that may bounce is left alone across a gap, and where it comes fast. So it is not stopped if it is to
      // hit in the next substep, or hits in this one because something pushed it on; and it is not set free again if it
      // was too slow to bounce. The speed at which an overlap was pushed out is taken from it all the same.
      const F separation = Load(point.separation), apart = Positive(separation);
      const F unsettled = Max(separation, Wide(-kBounce_m_s) - velocity);
      const F left_alone = Positive(Min(unsettled, Load(block.head.restitution)));
      const F excess = velocity + And(apart, separation * Wide(step.inverse_h));
      return old - mass * Select(left_alone, Max(velocity, Wide(0)), excess);
    } else {
      // A gap may close at once. From there the point is softly let down to the depth at rest, or pushed up to it.
      const F separation = Load(point.separation), slop = Load(block.head.slop), rate = Load(block.head.bias_rate);
      const F apart = Positive(separation);
      const F push = Max((separation + slop) * rate, Wide(-step.push_out_m_s));
      const F bias = Select(apart, separation * Wide(step.inverse_h) + slop * rate, push);
      const F soft_mass = Select(apart, mass, mass * Load(block.head.soft_mass));
      const F kept = old - And(Not(apart), old * Load(block.head.soft_impulse));
      return kept - soft_mass * (velocity + bias);
    }
  }

  template <bool kRelax>
  static TESSERA_INLINE void SolveNormals(Block& block, Both& both, const StepConstants& step) {
    const V n = Load(block.head.normal);
    const F linear = Dot(n, both.Relative());
    F velocity[kPoints];
    TESSERA_UNROLL
    for (int i = 0; i < kPoints; ++i) {
      velocity[i] = linear + both.Spin(block.points[i].angular_a, block.points[i].angular_b);
    }
    // The points are solved one after the other, against the matrix of how they move each other rather than against the
    // bodies; once, since the solver comes by here twice, there and back.
    F start[kPoints], impulse[kPoints];
    TESSERA_UNROLL
    for (int i = 0; i < kPoints; ++i) {
      start[i] = Load(block.points[i].impulse);
      impulse[i] = Max(Wanted<kRelax>(block, i, velocity[i], start[i], step), Wide(0));
      const F change = impulse[i] - start[i];
      TESSERA_UNROLL
      for (int j = i + 1; j < kPoints; ++j) {
        velocity[j] = velocity[j] + Load(block.coupling[Coupling(i, j, kPoints)]) * change;
      }
    }
    F sum = Wide(0);
    TESSERA_UNROLL
    for (int i = 0; i < kPoints; ++i) {
      PointLanes& point = block.points[i];
      Store(point.impulse, impulse[i]);
      const F change = impulse[i] - start[i];
      sum = sum + change;
      both.Turn(point.angular_a, point.angular_b, change);
    }
    both.Push(n * sum);
  }

  static TESSERA_INLINE void SolveFriction(Block& block, Both& both) {
    FrictionLanes& friction = block.friction;
    F normal = Load(friction.impact);
    for (int i = 0; i < kPoints; ++i) normal = normal + Load(block.points[i].impulse);
    const V relative = both.Relative();
    const V t0 = Load(friction.tangent[0]), t1 = Load(friction.tangent[1]);
    const F old0 = Load(friction.impulse[0]), old1 = Load(friction.impulse[1]);
    const DiscStep next = SolveDisc(Dot(t0, relative) + both.Spin(friction.angular_a[0], friction.angular_b[0]),
                                    Dot(t1, relative) + both.Spin(friction.angular_a[1], friction.angular_b[1]), old0,
                                    old1, friction.inverse, friction.slide_mass, Load(friction.coefficient) * normal);
    Store(friction.impulse[0], next.p0);
    Store(friction.impulse[1], next.p1);
    const F change0 = next.p0 - old0, change1 = next.p1 - old1;
    both.Push(t0 * change0 + t1 * change1);
    both.Turn(friction.angular_a[0], friction.angular_b[0], change0);
    both.Turn(friction.angular_a[1], friction.angular_b[1], change1);
    if constexpr (Block::kHasTwist) SolveTwist(block, both);
    if constexpr (Block::kHasRolling) SolveRolling(block, both, normal);
  }

  static TESSERA_INLINE void SolveTwist(Block& block, Both& both) {
    auto& twist = block.twist;
    F limit = Wide(0);
    for (int i = 0; i < kPoints; ++i) limit = limit + Load(twist.arm[i]) * Load(block.points[i].impulse);
    const F old = Load(twist.impulse);
    const F wanted = old - Load(twist.mass) * both.Spin(twist.angular_a, twist.angular_b);
    const F impulse = Max(Wide(0) - limit, Min(wanted, limit));
    Store(twist.impulse, impulse);
    both.Turn(twist.angular_a, twist.angular_b, impulse - old);
  }

  static TESSERA_INLINE void SolveRolling(Block& block, Both& both, F normal) {
    RollingLanes& rolling = block.rolling;
    const F old0 = Load(rolling.impulse[0]), old1 = Load(rolling.impulse[1]);
    const DiscStep next = SolveDisc(both.Spin(rolling.angular_a[0], rolling.angular_b[0]),
                                    both.Spin(rolling.angular_a[1], rolling.angular_b[1]), old0, old1, rolling.inverse,
                                    rolling.slide_mass, Load(rolling.coefficient) * normal);
    Store(rolling.impulse[0], next.p0);
    Store(rolling.impulse[1], next.p1);
    both.Turn(rolling.angular_a[0], rolling.angular_b[0], next.p0 - old0);
    both.Turn(rolling.angular_a[1], rolling.angular_b[1], next.p1 - old1);
  }

  static TESSERA_INLINE void Add(Lanes& total, const Lanes& impulse) { Store(total, Load(total) + Load(impulse)); }
  static TESSERA_INLINE void AddToTotals(Block& block) {
    for (PointLanes& point : block.points) Add(point.total, point.impulse);
    if constexpr (Block::kHasFriction) {
      for (int k = 0; k < 2; ++k) Add(block.friction.total[k], block.friction.impulse[k]);
    }
    if constexpr (Block::kHasTwist) Add(block.twist.total, block.twist.impulse);
    if constexpr (Block::kHasRolling) {
      for (int k = 0; k < 2; ++k) Add(block.rolling.total[k], block.rolling.impulse[k]);
    }
  }

  // Notes that the bodies have moved. The substep's impulse so far acted where they were before; impulses from here on
  // act where they are now.
  static TESSERA_INLINE void NoteMove(Block& block, const V& apart) {
    const F far = Positive(Dot(apart, apart) - Wide(kLeverArm_m * kLeverArm_m));
    if (Bits(far) != 0) {
      const V made = Cross(Load(block.lever_arm.apart) - apart, Impulse(block));
      Store(block.lever_arm.made, Load(block.lever_arm.made) + And(far, made));
    }
    Store(block.lever_arm.apart, And(far, apart));
  }
  static TESSERA_INLINE void NoteLeverArm(Block& block) {
    const V apart = Load(block.lever_arm.apart);
    if (Bits(Positive(Dot(apart, apart))) == 0) return;
    Store(block.lever_arm.made, Load(block.lever_arm.made) + Cross(apart, Impulse(block)));
  }

  enum class Stage { kPush, kRelax, kSettle };
  template <Stage kStage>
  static void SolveBlock(Block& block, SolvedBodies bodies, const StepConstants& step) {
    constexpr bool kRelax = kStage != Stage::kPush;
    if constexpr (kStage == Stage::kRelax) NoteMove(block, Measure(block, bodies));
    Both both = Fetch(block, bodies.states);
    // Normals come after friction, because overlaps matter more than sliding. When relaxing, friction is solved again
    // by the new normal impulses: those with bias carry less while a body sinks in, and it would slide.
    if constexpr (Block::kHasFriction) SolveFriction(block, both);
    SolveNormals<kRelax>(block, both, step);
    if constexpr (Block::kHasFriction && kRelax) SolveFriction(block, both);
    if constexpr (kStage == Stage::kSettle) {
      AddToTotals(block);
      NoteLeverArm(block);
    }
    PutBack(block, bodies, both);
  }

  static void Prepare(void* blocks, std::size_t count, SolvedBodies bodies, const StepConstants&) {
    for (std::size_t i = 0; i < count; ++i) PrepareBlock(static_cast<Block*>(blocks)[i], bodies);
  }
  static void Warm(void* blocks, std::size_t count, SolvedBodies bodies, const StepConstants&) {
    for (std::size_t i = 0; i < count; ++i) WarmBlock(static_cast<Block*>(blocks)[i], bodies);
  }
  // From here bodies are where they would have been if they had moved all substep long as they do at its end. Two that
  // bounced overlap there, and do not at the end: they are taken to touch.
  static void Locate(void* blocks, std::size_t count, SolvedBodies bodies, const StepConstants&) {
    for (std::size_t i = 0; i < count; ++i) {
      Block& block = static_cast<Block*>(blocks)[i];
      F lowest[kPoints];
      for (int k = 0; k < kPoints; ++k) lowest[k] = Min(Load(block.points[k].separation), Wide(0));
      NoteMove(block, Measure(block, bodies));
      for (int k = 0; k < kPoints; ++k) {
        Store(block.points[k].separation, Max(Load(block.points[k].separation), lowest[k]));
      }
    }
  }
  template <Stage kStage>
  static void Solve(void* blocks, std::size_t count, SolvedBodies bodies, const StepConstants& step) {
    for (std::size_t i = 0; i < count; ++i) SolveBlock<kStage>(static_cast<Block*>(blocks)[i], bodies, step);
  }
  static void Approach(void* blocks, std::size_t count, const SolvedState* states, float speed, std::uint8_t* lanes) {
    for (std::size_t k = 0; k < count; ++k) {
      Block& block = static_cast<Block*>(blocks)[k];
      if constexpr (Block::kHasFriction) Store(block.friction.impact, Wide(0));
      const Both both = Fetch(block, states);
      const F linear = Dot(Load(block.head.normal), both.Relative());
      F fastest = Wide(0);
      for (const PointLanes& point : block.points) {
        const F velocity = And(Positive(Load(point.mass)), linear + both.Spin(point.angular_a, point.angular_b));
        fastest = Min(fastest, velocity);
      }
      lanes[k] = static_cast<std::uint8_t>(Bits(Positive(Wide(-speed) - fastest)));
    }
  }
  static constexpr ContactKernels Table() {
    return {&Prepare, &Warm, &Solve<Stage::kPush>, &Solve<Stage::kRelax>, &Solve<Stage::kSettle>, &Locate, &Approach};
  }
};

void Drift(SolvedState* states, const SolvedMass* masses, std::size_t count, float h) {
  for (std::size_t i = 0; i < count; ++i) {
    SolvedState& s = states[i];
    const SolvedMass& m = masses[i];
    const float* q = m.root_inertia;
    const float* w = s.spin;
    for (int k = 0; k < 3; ++k) s.moved[k] += h * (m.inverse_root_mass * s.velocity[k]);
    s.turned[0] += h * (q[0] * w[0] + q[3] * w[1] + q[4] * w[2]);
    s.turned[1] += h * (q[3] * w[0] + q[1] * w[1] + q[5] * w[2]);
    s.turned[2] += h * (q[4] * w[0] + q[5] * w[1] + q[2] * w[2]);
  }
}

constexpr Kernels kKernels = {
    {ContactLoops<1, Tangent::kNone>::Table(), ContactLoops<2, Tangent::kNone>::Table(),
     ContactLoops<4, Tangent::kNone>::Table(), ContactLoops<1, Tangent::kFriction>::Table(),
     ContactLoops<2, Tangent::kFriction>::Table(), ContactLoops<4, Tangent::kFriction>::Table(),
     ContactLoops<1, Tangent::kRolling>::Table(), ContactLoops<2, Tangent::kRolling>::Table(),
     ContactLoops<4, Tangent::kRolling>::Table()},
    &Drift};

}  // namespace
}  // namespace tessera::physics

// Rows of every kind of joint are the derivatives of their errors, point where the scene says, and stay finite.

#include "core/physics/solve/joint_model.h"

#include <gmock/gmock.h>

#include <numbers>
#include <random>

#include "core/physics/trig.h"

namespace tessera::physics {
namespace {

constexpr double kPi = std::numbers::pi;

Placement At(Vec3d position, Quatd q = {}) { return {position, q, RotationOf(q)}; }
template <class Kind>
JointModel Model(const Kind& kind, Pose in_a = {}, Pose in_b = {}, bool world = false) {
  return JointModel({.id = JointId(1),
                     .body_a = BodyId(1),
                     .body_b = world ? BodyId() : BodyId(2),
                     .frame_a = {},
                     .frame_b = {},
                     .bodies_collide = false,
                     .kind = kind},
                    in_a, in_b);
}
template <class Kind>
JointRows RowsOf(const Kind& kind, Quatd turn_of_b, Vec3d b = {}) {
  JointModel model = Model(kind);
  JointRows rows;
  model.MakeRows(At({}), At(b, turn_of_b), &rows);
  return rows;
}
const Row* Find(const JointRows& rows, RowKind kind, int slot = -1) {
  for (int i = 0; i < rows.count; ++i) {
    const Row& row = rows.rows[static_cast<std::size_t>(i)];
    if (row.kind == kind && (slot < 0 || row.slot == slot)) return &row;
  }
  return nullptr;
}

class Random {
 public:
  double Next(double most) { return std::uniform_real_distribution<double>(-most, most)(engine_); }
  Vec3d Vector(double most) { return {Next(most), Next(most), Next(most)}; }
  Quatd Turn(double most) { return TurnBy(Vector(most)); }

 private:
  std::mt19937 engine_{17};
};

SixDofJoint SixDof(std::array<int, 6> kinds) {
  SixDofJoint joint;
  for (std::size_t k = 0; k < 6; ++k) {
    auto& axis = joint.axes[k];
    if (kinds[k] == 1)
      axis = {.limit = {-0.9, 1.1}, .motor = {}, .spring = {.stiffness = 5, .damping = 1, .rest = 0.1}};
    if (kinds[k] == 2) axis = {.limit = {}, .motor = {}, .spring = {.stiffness = 5, .damping = 1, .rest = 0.2}};
    if (kinds[k] == 3) axis.limit = {0.3, 0.3};
  }
  return joint;
}

std::vector<decltype(JointDef::kind)> EveryKind() {
  std::vector<decltype(JointDef::kind)> kinds = {
      PointJoint{},
      FixedJoint{},
      HingeJoint{.limit_rad = {-0.4, 0.5}, .motor = {}},
      HingeJoint{.limit_rad = {-6, 6}, .motor = {}},
      SliderJoint{.limit_m = {-0.3, 0.4}, .motor = {}},
      ConeTwistJoint{.swing_y_rad = 0.3, .swing_z_rad = 0.8, .twist_rad = 0.4},
      ConeTwistJoint{.swing_y_rad = 0, .swing_z_rad = 0.8, .twist_rad = 0},
      ConeTwistJoint{.swing_y_rad = 3.1416, .swing_z_rad = 0.8, .twist_rad = 3.1416},
      UniversalJoint{.limit_a_rad = {-0.5, 0.5}, .limit_b_rad = {-0.6, 0.6}},
      Hinge2Joint{.steering_rad = {-0.4, 0.4}, .suspension = {.stiffness = 9, .damping = 1, .rest = 0.1}, .drive = {}}};
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      for (int z = 0; z < 4; ++z) kinds.push_back(SixDof({x, y, z, x, y, z}));
    }
  }
  return kinds;
}

// Every row but motors and gears, at random poses near and far from rest, is the derivative of its error.
TEST(JointModelTest, RowsAreTheDerivativesOfTheirErrors) {
  Random random;
  constexpr double kStep = 1e-4;
  int checked = 0;
  for (const auto& kind : EveryKind()) {
    for (int i = 0; i < 40; ++i) {
      const bool world = i % 4 == 3;
      const double far = i % 2 == 0 ? 0.25 : 0.7;
      const Pose in_a{random.Vector(1), random.Turn(2)}, in_b{random.Vector(1), random.Turn(2)};
      const Pose a = world ? Pose{} : Pose{random.Vector(3), random.Turn(3)};
      // Body b lies where the joint would have it, and a little off.
      const Quatd joint = a.orientation * in_a.orientation * random.Turn(far);
      const Quatd q_b = Normalized(joint * Conjugate(in_b.orientation));
      const Vec3d p_b =
          a.position + Rotate(a.orientation, in_a.position) - Rotate(q_b, in_b.position) + random.Vector(far);
      const Vec3d v_a = world ? Vec3d() : random.Vector(1), w_a = world ? Vec3d() : random.Vector(1),
                  v_b = random.Vector(1), w_b = random.Vector(1);
      const auto rows_at = [&](double t) {
        JointModel model = std::visit([&](const auto& k) { return Model(k, in_a, in_b, world); }, kind);
        JointRows rows;
        model.MakeRows(At(a.position + v_a * t, Normalized(TurnBy(w_a * t) * a.orientation)),
                       At(p_b + v_b * t, Normalized(TurnBy(w_b * t) * q_b)), &rows);
        return rows;
      };
      const JointRows now = rows_at(0), before = rows_at(-kStep), after = rows_at(kStep);
      if (before.count != now.count || after.count != now.count) continue;
      for (std::size_t k = 0; k < static_cast<std::size_t>(now.count); ++k) {
        const Row& row = now.rows[k];
        if (before.rows[k].slot != row.slot || after.rows[k].slot != row.slot) continue;  // Another stop is nearer.
        const double rate = (static_cast<double>(after.rows[k].error) - before.rows[k].error) / (2 * kStep);
        const double along =
            Dot(Vec3d(row.linear), v_b - v_a) + Dot(Vec3d(row.angular_b), w_b) - Dot(Vec3d(row.angular_a), w_a);
        const double rounding = 1.2e-7 * std::abs(row.error) / (2 * kStep);
        ASSERT_NEAR(rate, along, 1e-3 * (1 + std::abs(along)) + rounding)
            << "kind " << kind.index() << " row " << k << " slot " << int{row.slot} << " error " << row.error;
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 10000);
}

TEST(JointModelTest, LockedRowsComeFirstAndSlotsAreUnique) {
  Random random;
  for (const auto& kind : EveryKind()) {
    JointModel model = std::visit([&](const auto& k) { return Model(k); }, kind);
    JointRows rows;
    model.MakeRows(At(random.Vector(1), random.Turn(1)), At(random.Vector(1), random.Turn(1)), &rows);
    std::array<bool, kJointSlots> used{};
    bool free = false;
    for (int i = 0; i < rows.count; ++i) {
      const Row& row = rows.rows[static_cast<std::size_t>(i)];
      ASSERT_LT(row.slot, kJointSlots);
      EXPECT_FALSE(used[row.slot]);
      used[row.slot] = true;
      EXPECT_FALSE(free && row.kind == RowKind::kLocked);
      free = free || row.kind != RowKind::kLocked;
    }
  }
}

TEST(JointModelTest, HingeReadsTheTurnOfBAndStopsBothWays) {
  const HingeJoint hinge{.limit_rad = {-0.5, 1}, .motor = {.target_velocity = 2, .max_force = 7}};
  const JointRows near_upper = RowsOf(hinge, TurnBy({0, 0, 0.9})), near_lower = RowsOf(hinge, TurnBy({0, 0, -0.4}));
  const Row* upper = Find(near_upper, RowKind::kLimit);
  ASSERT_NE(upper, nullptr);
  EXPECT_NEAR(upper->error, 0.1, 1e-6);
  EXPECT_NEAR(upper->angular_b.z, -1, 1e-6);
  const Row* lower = Find(near_lower, RowKind::kLimit);
  ASSERT_NE(lower, nullptr);
  EXPECT_NEAR(lower->error, 0.1, 1e-6);
  EXPECT_NEAR(lower->angular_b.z, 1, 1e-6);
  const Row* motor = Find(near_lower, RowKind::kMotor);
  ASSERT_NE(motor, nullptr);
  EXPECT_EQ(motor->target_velocity, 2);
  EXPECT_EQ(motor->max_force, 7);
  EXPECT_NEAR(motor->angular_b.z, 1, 1e-6);
}

TEST(JointModelTest, AnglesOfThreeAxesTurnAboutZThenYThenX) {
  SixDofJoint joint;
  for (std::size_t k = 3; k < 6; ++k) {
    joint.axes[k] = {.limit = {}, .motor = {}, .spring = {.stiffness = 1, .damping = 0, .rest = 0}};
  }
  const JointRows rows = RowsOf(joint, TurnBy({0, 0, 2}) * TurnBy({0, -1, 0}) * TurnBy({0.7, 0, 0}));
  const double expected[3] = {0.7, -1, 2};
  for (int k = 0; k < 3; ++k) {
    const Row* row = Find(rows, RowKind::kSpring, 4 * (3 + k) + 1);
    ASSERT_NE(row, nullptr);
    EXPECT_NEAR(row->error, expected[k], 1e-6) << k;
  }
}

TEST(JointModelTest, TwoAxesGoAllTheWayRound) {
  const UniversalJoint joint{.limit_a_rad = {-3, 3}, .limit_b_rad = {-2.5, 2.5}};
  for (const double b : {-2.4, -1.57, 0.5, 1.6, 2.4}) {
    const JointRows rows = RowsOf(joint, TurnBy({0, 0, 2}) * TurnBy({0, b, 0}));
    const Row *limit_a = Find(rows, RowKind::kLimit, 4 * 5 + 3),
              *limit_b = Find(rows, RowKind::kLimit, 4 * 4 + (b > 0 ? 3 : 2));
    ASSERT_TRUE(limit_a != nullptr && limit_b != nullptr) << b;
    EXPECT_NEAR(limit_a->error, 1, 1e-6);
    EXPECT_NEAR(limit_b->error, 2.5 - std::abs(b), 1e-6);
  }
}

TEST(JointModelTest, LimitsBeyondHalfATurnAreCountedOn) {
  JointModel model = Model(HingeJoint{.limit_rad = {-6, 6}, .motor = {}});
  JointRows rows;
  for (const float way : {1.0f, -1.0f}) {
    for (double angle = 0; angle < 6.05; angle += 0.05) {
      model.MakeRows(At({}), At({}, TurnBy({0, 0, way * angle})), &rows);
      const Row* limit = Find(rows, RowKind::kLimit);
      ASSERT_NE(limit, nullptr);
      EXPECT_NEAR(limit->error, 6 - angle, 1e-5);
      if (angle > 0.01) {
        EXPECT_NEAR(limit->angular_b.z * way, -1, 1e-5);
      }
    }
    for (double angle = 6; angle > 0; angle -= 0.05) {
      model.MakeRows(At({}), At({}, TurnBy({0, 0, way * angle})), &rows);
    }
  }
}

TEST(JointModelTest, OrdinaryLimitsAreReadOnTheirOwnSide) {
  // Beyond pi the angle is past the stop at 2.8, not before the other one.
  const JointRows rows = RowsOf(HingeJoint{.limit_rad = {2, 2.8}, .motor = {}}, TurnBy({0, 0, 3.3}));
  const Row* limit = Find(rows, RowKind::kLimit, 4 * 5 + 3);
  ASSERT_NE(limit, nullptr);
  EXPECT_NEAR(limit->error, -0.5, 1e-6);
}

TEST(JointModelTest, ConeIsAnEllipse) {
  const ConeTwistJoint cone{.swing_y_rad = 0.3, .swing_z_rad = 0.6, .twist_rad = 3.1416};
  for (double around = 0; around < 6.28; around += 0.4) {
    const SinCos s = SinCosOf(around);
    const Vec3d border{0, 0.3 * s.cos, 0.6 * s.sin};
    const JointRows rows = RowsOf(cone, TurnBy(border) * TurnBy({1.3, 0, 0}));
    const Row* on = Find(rows, RowKind::kLimit);
    ASSERT_NE(on, nullptr);
    EXPECT_NEAR(on->error, 0, 1e-6);
    EXPECT_LT(Dot(on->angular_b, Vec3f(border)), 0);  // back inwards
    const JointRows inside = RowsOf(cone, TurnBy(border * 0.9)), outside = RowsOf(cone, TurnBy(border * 1.1));
    EXPECT_NEAR(Find(inside, RowKind::kLimit)->error, 0.03, 1e-6);
    EXPECT_NEAR(Find(outside, RowKind::kLimit)->error, -0.03, 1e-6);
  }
}

TEST(JointModelTest, GearTiesTheTurnsAboutBothAxes) {
  JointModel model = Model(GearJoint{.ratio = 2.5}, {{}, TurnBy({0, kPi / 2, 0})}, {});
  JointRows rows;
  model.MakeRows(At({}), At({3, 0, 0}), &rows);
  ASSERT_EQ(rows.count, 1);
  const Row& row = rows.rows[0];
  // If a turns about its x by 1, b has to turn about its z by -2.5.
  EXPECT_NEAR(Dot(row.angular_b, {0, 0, -2.5f}) - Dot(row.angular_a, {1, 0, 0}), 0, 1e-6);
  EXPECT_EQ(row.linear, Vec3f());
  EXPECT_EQ(row.error, 0);
}

TEST(JointModelTest, LosesNothingFarFromTheOrigin) {
  const Vec3d far{1e7, -3e6, 1e7};
  const Pose in_a{{0.5, 0, 0}, {}}, in_b{{-0.5, 0, 0}, {}};
  JointModel model = Model(PointJoint{}, in_a, in_b), to_world = Model(PointJoint{}, {far, {}}, in_b, true);
  JointRows rows;
  model.MakeRows(At(far), At(far + Vec3d{1, 1e-4, 0}), &rows);
  EXPECT_NEAR(rows.rows[1].error, 1e-4, 3e-9);
  to_world.MakeRows(At({}), At(far + Vec3d{0.5, 1e-4, 0}), &rows);
  EXPECT_NEAR(rows.rows[1].error, 1e-4, 3e-9);
  EXPECT_EQ(rows.rows[1].angular_a, Vec3f());
}

TEST(JointModelTest, LockedAnglesMayBeAnything) {
  SixDofJoint joint;
  joint.axes[3].limit = {0.4, 0.4};
  joint.axes[4].limit = {-0.8, -0.8};
  joint.axes[5].limit = {2, 2};
  const Quatd held = TurnBy({0, 0, 2}) * TurnBy({0, -0.8, 0}) * TurnBy({0.4, 0, 0});
  for (std::size_t freed = 2; freed < 6; ++freed) {
    SixDofJoint some = joint;
    if (freed > 2) some.axes[freed].limit = {};
    const JointRows rows = RowsOf(some, held);
    EXPECT_EQ(rows.count, freed > 2 ? 5 : 6);
    for (int i = 0; i < rows.count; ++i) {
      EXPECT_NEAR(rows.rows[static_cast<std::size_t>(i)].error, 0, 1e-6) << freed << ' ' << i;
    }
  }
}

TEST(JointModelTest, EveryPoseGivesFiniteRowsOfBoundedSize) {
  std::vector<Quatd> poses = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, -1}};
  for (int axis = 0; axis < 3; ++axis) {
    for (const double angle : {kPi / 2, kPi, -kPi / 2, kPi / 2 + 1e-9, kPi - 1e-9, 1e-9}) {
      const Vec3d turn = Vec3d{axis == 0 ? 1.0 : 0, axis == 1 ? 1.0 : 0, axis == 2 ? 1.0 : 0} * angle;
      poses.push_back(TurnBy(turn));
      poses.push_back(TurnBy(turn) * TurnBy({0.1, 0.2, 0.3}));
    }
  }
  for (const auto& kind : EveryKind()) {
    for (const Quatd& pose : poses) {
      JointModel model = std::visit([&](const auto& k) { return Model(k); }, kind);
      JointRows rows;
      model.MakeRows(At({}), At({}, pose), &rows);
      for (int i = 0; i < rows.count; ++i) {
        const Row& row = rows.rows[static_cast<std::size_t>(i)];
        ASSERT_TRUE(std::isfinite(row.error) && IsFinite(row.linear) && IsFinite(row.angular_a));
        ASSERT_LT(Length(row.angular_b), 100) << "kind " << kind.index() << pose;
        ASSERT_LT(std::abs(row.error), 10);
      }
    }
  }
}

// A body that follows a hinge's locked rows alone ends aligned, from wherever it starts.
TEST(JointModelTest, HingeFindsItsAxisFromAnyPose) {
  Random random;
  for (int i = 0; i < 50; ++i) {
    Quatd q = i == 0 ? TurnBy({kPi, 0, 0}) : random.Turn(3);
    JointModel model = Model(HingeJoint{});
    JointRows rows;
    for (int step = 0; step < 200; ++step) {
      model.MakeRows(At({}), At({}, q), &rows);
      Vec3d turn;
      for (int k = 3; k < rows.count; ++k) {
        const Row& row = rows.rows[static_cast<std::size_t>(k)];
        turn += Vec3d(row.angular_b) * (-0.1 * row.error);
      }
      q = Normalized(TurnBy(turn) * q);
    }
    EXPECT_GT(Rotate(q, Vec3d{0, 0, 1}).z, 0.999999) << i;
  }
}

}  // namespace
}  // namespace tessera::physics

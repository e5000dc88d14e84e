#include "scenes/measured/linkages.h"

#include <cmath>
#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Vec3d kZ{0, 0, 1};

struct AxialInertia {
  double along, across;
};

// Moments of inertia of a solid capsule about its centre: a cylinder and two half balls.
AxialInertia CapsuleInertia(double radius, double half_height, double mass) {
  const double length = 2 * half_height, r2 = radius * radius;
  const double share = length / (length + 4 * radius / 3);  // the cylinder's share of the volume
  const double cylinder = mass * share, balls = mass * (1 - share);
  return {cylinder * r2 / 2 + balls * 0.4 * r2, cylinder * (length * length / 12 + r2 / 4) +
                                                    balls * (0.4 * r2 + length * length / 4 + 0.375 * length * radius)};
}

}  // namespace

Chain BallAndChain(double ratio, int links) {
  constexpr double kRadius = 0.125;
  Chain chain;
  const AxialInertia inertia = CapsuleInertia(kRadius, chain.link_m / 2, 1);
  chain.link_inertia_kg_m2 = inertia.across;
  chain.ball_inertia_kg_m2 = 0.4 * ratio * chain.ball_radius_m * chain.ball_radius_m;
  Builder make("chain");
  const ShapePtr capsule = CapsuleOf(kRadius, chain.link_m / 2);
  const Quatd along_x = Turn(kZ, -kPi / 2);
  for (int i = 0; i <= links; ++i) {
    const bool ball = i == links;
    const Vec3d joint{i * chain.link_m, 0, 0};
    BodyDef& body = ball ? make.Dynamic(BallOf(chain.ball_radius_m), joint + Vec3d{chain.ball_radius_m, 0, 0}, ratio)
                         : make.Dynamic(capsule, joint + Vec3d{chain.link_m / 2, 0, 0}, 1);
    if (!ball) body.initial.orientation = along_x;
    if (!ball) body.inertia_kg_m2 = Vec3d{inertia.across, inertia.along, inertia.across};
    make.JointAt(body.id, i == 0 ? BodyId() : chain.bodies.back(), Pose{joint, {}}, PointJoint{});
    chain.bodies.push_back(body.id);
  }
  chain.scene = make.Take();
  return chain;
}

Scene ClosedLoop(int links) {
  constexpr double kRadius = 0.1, kHalf = 0.4;  // 1 m from joint to joint
  Builder make("closed loop");
  make.Ground();
  const ShapePtr capsule = CapsuleOf(kRadius, kHalf);
  const double corner = 2 * kPi / links, radius = 0.5 / SinCosOf(corner / 2).sin;
  const auto vertex = [&](int i) {
    const SinCos at = SinCosOf(i * corner);
    return Vec3d{radius * at.cos, kRadius, radius * at.sin};
  };
  for (int i = 0; i < links; ++i) {
    BodyDef& body = make.Dynamic(capsule, (vertex(i) + vertex(i + 1)) * 0.5, 1);
    // The capsule's axis lies along the side: first flat along x, then turned about y.
    body.initial.orientation = Turn({0, 1, 0}, -(i + 0.5) * corner - kPi / 2) * Turn(kZ, -kPi / 2);
    if (i == 0) body.initial.linear_velocity = {3, 0, 0};
  }
  const Quatd upright = Turn({1, 0, 0}, -kPi / 2);  // hinges turn about their frame's z
  for (int i = 0; i < links; ++i) {
    const auto id = [&](int link) { return BodyId(static_cast<std::uint64_t>(link % links) + 2); };
    make.JointAt(id(i), id(i + 1), Pose{vertex(i + 1), upright}, HingeJoint{});
  }
  return make.Take();
}

Pendulum RodPendulum(double amplitude_rad) {
  Pendulum result{.scene = {}, .rod = {}, .length_m = 1, .gravity_m_s2 = 9.81};
  Builder make("pendulum");
  make.Gravity(result.gravity_m_s2);
  const Quatd turned = Turn(kZ, amplitude_rad);
  BodyDef& rod = make.Dynamic(BoxOf(0.01, 0.5, 0.01), Rotate(turned, Vec3d{0, -0.5, 0}), 1);
  rod.inertia_kg_m2 = Vec3d{1.0 / 12, 1e-3, 1.0 / 12};
  rod.initial.orientation = turned;
  result.rod = rod.id;
  make.Joint(rod.id, BodyId(), Pose{{0, 0.5, 0}, {}}, Pose{}, HingeJoint{});
  result.scene = make.Take();
  return result;
}

SpringMass MassOnSpring(double frequency_hz, double amplitude_m) {
  SpringMass result{.scene = {}, .mass = {}, .frequency_hz = frequency_hz, .amplitude_m = amplitude_m};
  Builder make("spring");
  make.Gravity(0);
  BodyDef& mass = make.Dynamic(BoxOf(0.5, 0.5, 0.5), {amplitude_m, 0, 0}, 1);
  result.mass = mass.id;
  const double rate = 2 * kPi * frequency_hz;
  SixDofJoint joint;
  joint.axes[0].limit = Limit{};
  joint.axes[0].spring = {.stiffness = rate * rate, .damping = 0, .rest = 0};
  make.Joint(mass.id, BodyId(), Pose{}, Pose{}, joint);
  result.scene = make.Take();
  return result;
}

Scene HingeMotor(double rate_rad_s) {
  Builder make("hinge motor");
  const BodyId bar = make.Dynamic(BoxOf(1, 0.1, 0.1), {0.9, 0, 0}, 2).id;
  make.JointAt(bar, BodyId(), Pose{}, HingeJoint{.limit_rad = {}, .motor = {rate_rad_s, 200}});
  const BodyId free = make.Dynamic(BoxOf(0.5, 0.05, 0.05), {2.3, 0, 0}, 0.5).id;  // swings at the bar's end
  make.JointAt(bar, free, Pose{{1.85, 0, 0}, {}}, HingeJoint{});
  return make.Take();
}

namespace {

// One figure, standing with its feet at `feet`.
void AddFigure(Builder& make, Vec3d feet, Quatd turned) {
  const auto body = [&](ShapePtr shape, Vec3d at, double mass) {
    BodyDef& def = make.Dynamic(std::move(shape), feet + Rotate(turned, at), mass, {.friction = 0.6});
    def.initial.orientation = turned;
    return def.id;
  };
  const auto at = [&](Vec3d place, Quatd frame) { return Pose{feet + Rotate(turned, place), turned * frame}; };
  const Quatd twist_up = Turn(kZ, kPi / 2), twist_down = Turn(kZ, -kPi / 2), bend = Turn({0, 1, 0}, kPi / 2);
  const ConeTwistJoint spine{.swing_y_rad = 0.4, .swing_z_rad = 0.4, .twist_rad = 0.3};
  const ConeTwistJoint socket{.swing_y_rad = 1, .swing_z_rad = 1, .twist_rad = 0.5};

  const BodyId pelvis = body(BoxOf(0.16, 0.1, 0.1), {0, 1.0, 0}, 10);
  const BodyId chest = body(BoxOf(0.18, 0.2, 0.11), {0, 1.32, 0}, 20);
  const BodyId head = body(BallOf(0.12), {0, 1.66, 0}, 5);
  make.JointAt(pelvis, chest, at({0, 1.11, 0}, twist_up), spine);
  make.JointAt(chest, head, at({0, 1.54, 0}, twist_up), spine);
  for (const int side : {-1, 1}) {
    const double arm = side * 0.25, leg = side * 0.09;
    const BodyId upper_arm = body(CapsuleOf(0.05, 0.12), {arm, 1.32, 0}, 2.5);
    const BodyId lower_arm = body(CapsuleOf(0.04, 0.14), {arm, 0.97, 0}, 2);
    make.JointAt(chest, upper_arm, at({arm, 1.47, 0}, twist_down), socket);
    make.JointAt(upper_arm, lower_arm, at({arm, 1.15, 0}, bend), HingeJoint{.limit_rad = {-2, 0.05}, .motor = {}});
    const BodyId thigh = body(CapsuleOf(0.07, 0.14), {leg, 0.69, 0}, 8);
    const BodyId shin = body(CapsuleOf(0.06, 0.15), {leg, 0.24, 0}, 5);
    make.JointAt(pelvis, thigh, at({leg, 0.9, 0}, twist_down), socket);
    make.JointAt(thigh, shin, at({leg, 0.46, 0}, bend), HingeJoint{.limit_rad = {-0.05, 2}, .motor = {}});
  }
}

}  // namespace

Scene Ragdolls(int count) {
  Builder make("ragdolls");
  make.Ground({.friction = 0.6});
  Random random(11);
  for (int i = 0; i < count; ++i) {
    const Vec3d feet{random.Between(-0.5, 0.5), 0.5 + i * 2.0, random.Between(-0.5, 0.5)};
    AddFigure(make, feet, Turn({0, 1, 0}, random.Between(0, 2 * kPi)) * Turn({1, 0, 0}, random.Between(-0.4, 0.4)));
  }
  return make.Take();
}

double GapOf(const JointDef& joint, const BodyState& a, const BodyState* b) {
  const auto anchor = [](const BodyState& state, const Pose& frame) {
    return state.position + Rotate(Quatd(state.orientation), frame.position);
  };
  return Length(anchor(a, joint.frame_a) - (b != nullptr ? anchor(*b, joint.frame_b) : joint.frame_b.position));
}

}  // namespace tessera::scenes

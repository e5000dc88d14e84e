// The lines of the suite `lean` that an engine shows alone.
#include <cassert>
#include <memory>

#include "bench/engine.h"
#include "bench/lean.h"
#include "bench/work_counter.h"
#include "scenes/measured/builder.h"

namespace tessera::bench {
namespace {

using scenes::BallOf;
using scenes::BoxOf;
using scenes::Builder;

constexpr double kDt_s = 1.0 / 60;
constexpr Vec3d kAside{-60, 0, 0};  // place of a body that meets no other

// Stacks of four unit cubes that stand still, awake.
void Stacks(Builder& make, const Material& material) {
  constexpr int kSide = 9, kHigh = 4;
  constexpr double kSpacing = 3;
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < kSide * kSide; ++i) {
    for (int y = 0; y < kHigh; ++y) {
      make.Dynamic(cube, {i % kSide * kSpacing, 0.5 + y, i / kSide * kSpacing}, 1, material);
    }
  }
}

// Balls that hang or fly in empty space side by side.
template <class Form>
void Flyers(Builder& make, Form form) {
  constexpr int kSide = 13, kCount = kSide * kSide * kSide;
  constexpr double kSpacing = 3;
  const ShapePtr ball = BallOf(0.5);
  for (int i = 0; i < kCount; ++i) {
    form(make.Dynamic(ball, {i % kSide * kSpacing, i / kSide % kSide * kSpacing, i / (kSide * kSide) * kSpacing}, 1));
  }
}

// Some steps of a world that owns itself.
WorkUnit Stepping(std::shared_ptr<const WorkCounter> counter, const Scene& scene, int steps, bool sleep = false) {
  std::shared_ptr<Engine> engine = MakeEngine(EngineKind::kTessera, {.sleep = sleep});
  const absl::Status status = engine->Load(scene);
  assert(status.ok());
  static_cast<void>(status);
  return [counter, engine, steps] {
    return counter->Of([&] {
      for (int i = 0; i < steps; ++i) engine->Step(kDt_s);
    });
  };
}

// Boxes that sleep beside stacks that do not.
Scene SleepingIslands(int sleepers) {
  Builder make("sleeping islands");
  make.Ground();
  Stacks(make, {});
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  constexpr int kRow = 100;
  for (int i = 0; i < sleepers; ++i) {
    BodyDef& box = make.Dynamic(cube, {i % kRow * 1.5, 0.5, 100 + i / kRow * 1.5}, 1);
    box.may_sleep = box.initial.asleep = true;
  }
  return make.Take();
}

// Stacks of one material and a loner of another: a ball dropped from 2 m.
Scene StacksAndLoner(const Material& stacks, const Material& loner) {
  Builder make("stacks and a loner");
  make.Ground({.friction = 1});
  Stacks(make, stacks);
  make.Dynamic(BallOf(0.5), kAside + Vec3d{0, 2.5, 0}, 1, loner);
  return make.Take();
}

// Spinning bodies, all of round inertia but `lopsided` of them.
enum class Lopsided { kNone, kLoner, kAll };
Scene Spinners(Lopsided lopsided) {
  const auto spin = [](BodyDef& body, bool round) {
    body.initial.angular_velocity = {1, 5, 2};
    if (!round) body.inertia_kg_m2 = Vec3d{0.1, 0.2, 0.25};
  };
  Builder make("spinners");
  make.Gravity(0);
  Flyers(make, [&](BodyDef& body) { spin(body, lopsided != Lopsided::kAll); });
  spin(make.Dynamic(BallOf(0.5), kAside, 1), lopsided == Lopsided::kNone);
  return make.Take();
}

// Flyers that move by a sixth of their radius in a step, and a loner; or fast ones.
Scene Flight(bool fast_loner, bool all_fast) {
  constexpr float kSlow_m_s = 5, kFast_m_s = 200;
  Builder make("flight");
  make.Gravity(0);
  Flyers(make, [&](BodyDef& body) { body.initial.linear_velocity = {0, all_fast ? kFast_m_s : kSlow_m_s, 0}; });
  make.Dynamic(BallOf(0.5), kAside, 1).initial.linear_velocity = {0, fast_loner ? kFast_m_s : kSlow_m_s, 0};
  return make.Take();
}

// Stacks, and two balls side by side on the ground, jointed or not.
Scene StacksAndCouple(bool jointed) {
  Builder make("stacks and a couple");
  make.Ground();
  Stacks(make, {});
  const BodyId left = make.Dynamic(BallOf(0.5), kAside + Vec3d{0, 0.5, 0}, 1).id;
  const BodyId right = make.Dynamic(BallOf(0.5), kAside + Vec3d{0, 0.5, 1.5}, 1).id;
  if (jointed) make.JointAt(left, right, Pose{kAside + Vec3d{0, 0.5, 0.75}, {}}, PointJoint{});
  return make.Take();
}

constexpr Material Frictionless(double restitution) {
  return {.friction = 0, .rolling_friction = 0, .spinning_friction = 0, .restitution = restitution};
}

}  // namespace

std::vector<LeanLine> PhysicsLines() {
  const auto counter = std::make_shared<const WorkCounter>();
  constexpr int kSteps = 5;  // a unit; of flyers more, since their steps are short
  const auto stepping = [=](const Scene& scene) { return Stepping(counter, scene, kSteps); };
  const auto flying = [=](const Scene& scene) { return Stepping(counter, scene, 2 * kSteps); };
  const Material rough{.friction = 0.5}, bouncy{.friction = 0.5, .restitution = 0.5};
  const std::string counted = counter->unit();
  return {
      {"sleeping_islands", counted,
       [=] {
         return LeanPair{Stepping(counter, SleepingIslands(0), kSteps, true),
                         Stepping(counter, SleepingIslands(10'000), kSteps, true)};
       }},
      {"gyroscopic_terms", counted,
       [=] {
         return LeanPair{flying(Spinners(Lopsided::kNone)), flying(Spinners(Lopsided::kLoner)),
                         flying(Spinners(Lopsided::kAll))};
       }},
      {"friction_rows", counted,
       [=] {
         const Material smooth = Frictionless(0);
         return LeanPair{stepping(StacksAndLoner(smooth, smooth)), stepping(StacksAndLoner(smooth, rough)),
                         stepping(StacksAndLoner(rough, rough))};
       }},
      {"restitution_passes", counted,
       [=] {
         return LeanPair{stepping(StacksAndLoner(rough, rough)), stepping(StacksAndLoner(rough, bouncy)),
                         stepping(StacksAndLoner(bouncy, bouncy))};
       }},
      {"ccd_on_slow_bodies", counted,
       [=] {
         return LeanPair{flying(Flight(false, false)), flying(Flight(true, false)), flying(Flight(true, true))};
       }},
      {"joints", counted,
       [=] {
         return LeanPair{stepping(StacksAndCouple(false)), stepping(StacksAndCouple(true))};
       }},
  };
}

}  // namespace tessera::bench

#include "scenes/measured/across.h"

#include <algorithm>
#include <cassert>
#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {
namespace {

constexpr double kPi = std::numbers::pi;

void Wall(Builder& make, Vec3d half, Vec3d place, Material material) {
  make.Static(BoxOf(half.x, half.y, half.z), place, material);
}

}  // namespace

void Cut(Scene& scene, std::uint32_t regions, double cell_m) {
  assert(regions == 1 || regions == 2 || regions == 4 || regions == 9);
  const double far = regions == 9 ? 2 * cell_m : cell_m;
  scene.bounds = {{-cell_m, -100, -cell_m}, {far, 100, far}};
}

PartitionMap GridOf(const Scene& scene, std::uint32_t regions) { return *MakeGridMap(scene.ground(), regions); }

PartitionMap StripsOf(Scene& scene, std::uint32_t regions, double cell_m) {
  const double half = regions * cell_m / 2;
  scene.bounds = {{-half, -100, -50}, {half, 100, 50}};
  std::vector<Cell> cells;
  std::vector<MapRegion> all;
  for (std::uint32_t i = 0; i < regions; ++i) {
    const double left = -half + i * cell_m;
    const double right = i + 1 == regions ? half : -half + (i + 1) * cell_m;
    cells.push_back({{left, -50, right, 50}, RegionId(i + 1), Epoch(1)});
    all.push_back({RegionId(i + 1), RegionId()});
  }
  return *PartitionMap::Create(MapVersion(1), scene.ground(), std::move(cells), std::move(all));
}

Jitter Jittered(const Scene& scene, std::uint64_t seed, double jitter_m) {
  Jitter result{scene, {}};
  std::vector<BodyDef>& bodies = result.scene.bodies;
  for (const BodyDef& body : bodies) result.id_of.push_back(body.id);
  if (seed == 0) return result;
  Random random(seed);
  std::vector<std::size_t> dynamic;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].motion == Motion::kDynamic) dynamic.push_back(i);
    const BodyId id = bodies[i].id;
    const bool jointed = std::any_of(scene.joints.begin(), scene.joints.end(),
                                     [&](const JointDef& joint) { return joint.body_a == id || joint.body_b == id; });
    if (bodies[i].motion != Motion::kDynamic || jointed) continue;
    bodies[i].initial.position.x += random.Between(-jitter_m, jitter_m);
    bodies[i].initial.position.z += random.Between(-jitter_m, jitter_m);
  }
  std::vector<std::size_t> dealt = dynamic;
  for (std::size_t i = dealt.size(); i > 1; --i) {
    std::swap(dealt[i - 1], dealt[static_cast<std::size_t>(random.Unit() * static_cast<double>(i))]);
  }
  for (std::size_t i = 0; i < dynamic.size(); ++i) result.id_of[dynamic[i]] = scene.bodies[dealt[i]].id;
  for (std::size_t i = 0; i < bodies.size(); ++i) bodies[i].id = result.id_of[i];
  std::sort(bodies.begin(), bodies.end(), [](const BodyDef& a, const BodyDef& b) { return a.id < b.id; });
  const auto renamed = [&](BodyId id) { return id == BodyId() ? id : result.id_of[id.value() - 1]; };
  for (JointDef& joint : result.scene.joints) {
    joint.body_a = renamed(joint.body_a);
    joint.body_b = renamed(joint.body_b);
  }
  return result;
}

Scene CollidingPair(ShapePtr shape_a, ShapePtr shape_b, double mass_ratio, bool oblique) {
  Builder make("pair");
  make.Gravity(0);
  const Material material{.friction = 0.5, .restitution = 0.7};
  make.Dynamic(std::move(shape_a), {-2, 1, 0}, 1, material).initial.linear_velocity = {4, 0, 0};
  const Vec3d aside = oblique ? Vec3d{0, 0.3, 0.4} : Vec3d{};
  make.Dynamic(std::move(shape_b), Vec3d{2, 1, 0} + aside, mass_ratio, material).initial.linear_velocity = {-3, 0, 0};
  return make.Take();
}

Scene BallRow(double restitution, double gap_m) {
  Builder make("ball row");
  make.Gravity(0);
  const ShapePtr ball = BallOf(0.5);
  const Material smooth{.friction = 0, .restitution = restitution};
  for (int i = 0; i < 6; ++i) {
    const double x = (i - 2.5) * (1 + gap_m) - (i == 0 ? 1 : 0);
    make.Dynamic(ball, {x, 1, 0}, 1, smooth).initial.linear_velocity = i == 0 ? Vec3f{5, 0, 0} : Vec3f();
  }
  return make.Take();
}

Scene CollidingBlocks() {
  Builder make("blocks");
  make.Gravity(0);
  const ShapePtr ball = BallOf(0.49);
  for (const int side : {-1, 1}) {
    for (int i = 0; i < 64; ++i) {
      const Vec3d place{side * (2.0 + i % 4), 1.0 + i / 4 % 4, -1.5 + i / 16};
      make.Dynamic(ball, place, 1).initial.linear_velocity = {static_cast<float>(-3 * side), 0, side > 0 ? 0.5F : 0.0F};
    }
  }
  return make.Take();
}

Scene TowerInTurn(int n, bool corner) {
  constexpr double kAside = 1e-6;
  Builder make("tower");
  make.Ground();
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5);
  for (int i = 0; i < n; ++i) {
    const double x = i % 2 == 0 ? -kAside : kAside, z = i / 2 % 2 == 0 ? -kAside : kAside;
    make.Dynamic(cube, {x, 0.5 + i, corner ? z : -kAside}, 1);
  }
  return make.Take();
}

Scene BrickWall(int rows, int columns, bool along) {
  constexpr double kAside = 1e-6;
  Builder make("wall");
  make.Ground();
  const ShapePtr brick = along ? BoxOf(0.5, 0.5, 1) : BoxOf(1, 0.5, 0.5);
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < columns; ++i) {
      const double at = (i - (columns - 1) / 2.0) * 2 + (row % 2 == 0 ? -0.25 : 0.25);
      const double aside = (row + i) % 2 == 0 ? -kAside : kAside;
      make.Dynamic(brick, along ? Vec3d{aside, 0.5 + row, at} : Vec3d{at, 0.5 + row, -kAside}, 2);
    }
  }
  return make.Take();
}

Scene Bridge() {
  constexpr int kPlanks = 20;
  constexpr double kHigh = 3, kHalf = 0.25;
  Builder make("bridge");
  make.Ground();
  const ShapePtr plank = BoxOf(kHalf - 0.02, 0.05, 0.8), ball = BallOf(0.3);
  std::vector<BodyId> ids;
  ids.reserve(kPlanks);
  for (int i = 0; i < kPlanks; ++i) {
    ids.push_back(make.Dynamic(plank, {(i - (kPlanks - 1) / 2.0) * 2 * kHalf, kHigh, 0}, 2, {.friction = 0.6}).id);
  }
  const auto hinge_at = [&](int i) { return Pose{{(i - kPlanks / 2) * 2 * kHalf, kHigh, 0}, {}}; };
  make.JointAt(ids.front(), BodyId(), hinge_at(0), HingeJoint{});
  for (int i = 1; i < kPlanks; ++i) {
    make.JointAt(ids[static_cast<std::size_t>(i - 1)], ids[static_cast<std::size_t>(i)], hinge_at(i), HingeJoint{});
  }
  make.JointAt(ids.back(), BodyId(), hinge_at(kPlanks), HingeJoint{});
  for (int i = 0; i < 12; ++i) {
    make.Dynamic(ball, {-2.75 + i * 0.5, kHigh + 1 + 0.1 * (i % 3), 0.3 * (i % 3 - 1)}, 1, {.rolling_friction = 0.01});
  }
  return make.Take();
}

Scene RainInBox(int count) {
  constexpr double kHalf = 6, kThick = 0.5, kHigh = 20;
  Builder make("rain");
  const Material material{.friction = 0.5, .restitution = 0.3};
  make.Ground(material);
  for (const double side : {-1.0, 1.0}) {
    Wall(make, {kThick, kHigh, kHalf + kThick}, {side * (kHalf + kThick), kHigh, 0}, material);
    Wall(make, {kHalf + kThick, kHigh, kThick}, {0, kHigh, side * (kHalf + kThick)}, material);
  }
  Random random(5);
  const ShapePtr shapes[] = {BallOf(0.4), BoxOf(0.35, 0.35, 0.35), CapsuleOf(0.3, 0.3), CylinderOf(0.35, 0.3)};
  for (int i = 0; i < count; ++i) {
    const Vec3d place{-4.5 + i % 7 * 1.5, 1.0 + i / 49 * 1.5, -4.5 + i / 7 % 7 * 1.5};
    BodyDef& body = make.Dynamic(shapes[i % 4], place, 0.5 + i % 5, material);
    body.initial.linear_velocity = Vec3f(Vec3d{random.Between(-3, 3), 0, random.Between(-3, 3)});
  }
  return make.Take();
}

Scene FloatingBox(int count) {
  constexpr double kHalf = 6, kThick = 0.5, kMass_kg = 2000;
  Builder make("floating box");
  make.Gravity(0);
  const Material material{.friction = 0.5, .restitution = 0.3};
  CompoundShape box;
  for (const double side : {-1.0, 1.0}) {
    const double at = side * (kHalf + kThick), over = kHalf + 2 * kThick;
    box.children.push_back({{{at, 0, 0}, {}}, BoxOf(kThick, over, over)});
    box.children.push_back({{{0, at, 0}, {}}, BoxOf(kHalf, kThick, over)});
    box.children.push_back({{{0, 0, at}, {}}, BoxOf(kHalf, kHalf, kThick)});
  }
  make.Dynamic(std::make_shared<const Shape>(Shape{std::move(box)}), {0.3, 1 + kHalf, 0.2}, kMass_kg, material);
  Random random(5);
  const ShapePtr shapes[] = {BallOf(0.4), BoxOf(0.35, 0.35, 0.35), CapsuleOf(0.3, 0.3), CylinderOf(0.35, 0.3)};
  for (int i = 0; i < count; ++i) {
    const Vec3d place{-4.5 + i % 7 * 1.5, 2.5 + i / 49 * 1.5, -4.5 + i / 7 % 7 * 1.5};
    BodyDef& body = make.Dynamic(shapes[i % 4], place, 0.5 + i % 5, material);
    body.initial.linear_velocity = Vec3f(Vec3d{random.Between(-3, 3), -5, random.Between(-3, 3)});
  }
  return make.Take();
}

Scene DominoRow(int count) {
  constexpr double kThin = 0.05, kHigh = 0.8, kWide = 0.2, kPitch = 0.5, kPush = 1;
  Builder make("domino row");
  make.Ground({.friction = 0.6});
  const ShapePtr tile = BoxOf(kThin, kHigh, kWide);
  for (int i = 0; i < count; ++i) {
    const double x = (i - (count - 1) / 2.0) * kPitch;
    BodyDef& body = make.Dynamic(tile, {x, kHigh, 0}, 1, {.friction = 0.6});
    if (i == 0) TurnAbout(body, {x + kThin, 0, 0}, {0, 0, -kPush});  // about its front edge, towards the next
  }
  return make.Take();
}

Vehicle Drive(double from_x) {
  constexpr double kWheel = 0.4, kBed = 0.75, kRate = 10;
  Builder make("vehicle");
  make.Ground({.friction = 0.8});
  for (const double x : {-0.5, 6.0}) make.Static(BoxOf(0.3, 0.04, 2), {x, 0.04, 0}, {.friction = 0.8});
  Vehicle result;
  result.chassis = make.Dynamic(BoxOf(1.2, 0.1, 0.6), {from_x, kBed, 0}, 200, {.friction = 0.8}).id;
  for (const double x : {-0.8, 0.8}) {
    for (const double z : {-0.75, 0.75}) {
      const Vec3d hub{from_x + x, kWheel, z};
      BodyDef& wheel = make.Dynamic(CylinderOf(kWheel, 0.12), hub, 15, {.friction = 0.9});
      wheel.initial.orientation = Turn({1, 0, 0}, kPi / 2);
      const BodyId id = wheel.id;
      make.JointAt(result.chassis, id, Pose{hub, {}}, HingeJoint{.limit_rad = {}, .motor = {-kRate, 60}});
    }
  }
  result.crate = make.Dynamic(BoxOf(0.3, 0.3, 0.3), {from_x, kBed + 0.4, 0}, 20, {.friction = 0.8}).id;
  result.scene = make.Take();
  return result;
}

Scene EqualCells(int side, double cell_m) {
  constexpr int kBase = 10, kPyramids = 4, kBalls = 8;
  const double half = side * cell_m / 2;
  Builder make("equal cells");
  make.Ground();
  for (const double edge : {-1.0, 1.0}) {
    Wall(make, {0.5, 2, half + 1}, {edge * (half + 0.5), 2, 0}, {.restitution = 1});
    Wall(make, {half + 1, 2, 0.5}, {0, 2, edge * (half + 0.5)}, {.restitution = 1});
  }
  const ShapePtr cube = BoxOf(0.5, 0.5, 0.5), ball = BallOf(0.4);
  for (int cell = 0; cell < side * side; ++cell) {
    const Vec3d middle{(cell % side + 0.5) * cell_m - half, 0, (cell / side + 0.5) * cell_m - half};
    for (int p = 0; p < kPyramids; ++p) {
      for (int row = 0; row < kBase; ++row) {
        for (int i = 0; i < kBase - row; ++i) {
          const Vec3d at{(i - (kBase - row - 1) / 2.0) * 1.1, 0.5 + row, (p - (kPyramids - 1) / 2.0) * 2};
          make.Dynamic(cube, middle + at, 1);
        }
      }
    }
    for (int i = 0; i < kBalls; ++i) {
      // Two to each side, in lanes of their own, so that none meets who comes the other way.
      const Vec3d out = i % 4 == 0   ? Vec3d{1, 0, 0}
                        : i % 4 == 1 ? Vec3d{0, 0, 1}
                        : i % 4 == 2 ? Vec3d{-1, 0, 0}
                                     : Vec3d{0, 0, -1};
      const Vec3d aside = Vec3d{-out.z, 0, out.x} * (7.0 + 2 * (i / 4));
      BodyDef& body = make.Dynamic(ball, middle + out * (cell_m * 0.3) + aside + Vec3d{0, 0.4, 0}, 1, {.friction = 0});
      body.initial.linear_velocity = Vec3f(out * 4);
    }
  }
  Scene scene = make.Take();
  scene.bounds = {{-half, -100, -half}, {half, 100, half}};
  return scene;
}

}  // namespace tessera::scenes

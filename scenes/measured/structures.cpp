#include "scenes/measured/structures.h"

#include <cmath>
#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {
namespace {

// A wedge of an arch: four corners in x-y, `half_depth` deep in z.
void AddWedge(Builder& make, const Vec3d (&corners)[4], double half_depth, double density_kg_m3, Material material) {
  double twice_area = 0;
  Vec3d center;
  for (int i = 0; i < 4; ++i) {
    const Vec3d a = corners[i], b = corners[(i + 1) % 4];
    const double cross = a.x * b.y - b.x * a.y;
    twice_area += cross;
    center += (a + b) * (cross / 3);
  }
  center = center / twice_area;
  std::vector<Vec3f> points;
  for (const Vec3d& corner : corners) {
    for (const double side : {-half_depth, half_depth}) points.push_back(Vec3f(corner - center + Vec3d{0, 0, side}));
  }
  make.Dynamic(HullOf(std::move(points)), center, std::abs(twice_area) * half_depth * density_kg_m3, material);
}

}  // namespace

Scene KaplaTower() {
  constexpr double kMass = 10, kPitch = 0.2, kLayer = kKaplaLayer_m;
  const Material wood{.friction = 0.8};
  Builder make("kapla tower");
  make.Ground(wood);
  const ShapePtr sleeper = BoxOf(0.05, kLayer / 2, 0.125), plank = BoxOf(0.1, kLayer / 2, 0.05);
  for (int floor = 0; floor < kKaplaFloors; ++floor) {
    const double low = (2 * floor + 0.5) * kLayer, high = low + kLayer;
    for (int i = 0; i < kKaplaBase; ++i) make.Dynamic(sleeper, {i * kPitch, low, 0}, kMass, wood);
    for (int i = 0; i < kKaplaBase / 2; ++i) make.Dynamic(plank, {(2 * i + 0.5) * kPitch, high, -0.1}, kMass, wood);
    for (int i = 0; i < kKaplaBase / 2 - 1; ++i) make.Dynamic(plank, {(2 * i + 1.5) * kPitch, high, 0.1}, kMass, wood);
    // The other side's planks bridge other sleepers, so its ends need one each.
    make.Dynamic(plank, {0.5 * kPitch, high, 0.1}, kMass, wood);
    make.Dynamic(plank, {(kKaplaBase - 1.5) * kPitch, high, 0.1}, kMass, wood);
  }
  return make.Take();
}

Scene CardHouse() {
  constexpr double kHalf = 0.2, kThin = 0.005, kDeep = 0.1, kMass = 0.1, kGap = 0.004;
  constexpr int kStoreys = 5;
  const Material card{.friction = 0.8};
  const double lean = std::numbers::pi / 9;
  const SinCos at = SinCosOf(lean);
  // A card leans on its fellow with the edge of its top; it stands on the edge of its foot.
  const double reach = kHalf * at.sin + kThin * at.cos, rise = kHalf * at.cos + kThin * at.sin;
  const double pitch = 4 * reach + kGap;
  const ShapePtr leaning = BoxOf(kThin, kHalf, kDeep), lying = BoxOf(pitch / 2 - 0.001, kThin, kDeep);
  Builder make("card house");
  make.Ground(card);
  for (int storey = 0; storey < kStoreys; ++storey) {
    const int pairs = kStoreys - storey;
    const double floor = storey * (2 * rise + 2 * kThin);
    for (int i = 0; i < pairs; ++i) {
      const double apex = (i - (pairs - 1) / 2.0) * pitch;
      for (const int side : {-1, 1}) {
        make.Dynamic(leaning, {apex + side * reach, floor + rise, 0}, kMass, card).initial.orientation =
            Turn({0, 0, 1}, side * lean);
      }
      if (i + 1 < pairs) make.Dynamic(lying, {apex + pitch / 2, floor + 2 * rise + kThin, 0}, kMass, card);
    }
  }
  return make.Take();
}

Scene Arch() {
  constexpr double kInner = 4.5, kInnerRise = 5, kOuter = 6, kOuterRise = 6, kHalfDepth = 0.5, kDensity = 200;
  const Material stone{.friction = 0.6};
  Builder make("arch");
  make.Ground(stone);
  const auto joint = [&](int i, double half_span, double rise) {
    const double t = 2.0 * i / kArchWedges - 1;
    return Vec3d{half_span * t, rise * (1 - t * t), 0};
  };
  for (int i = 0; i < kArchWedges; ++i) {
    const Vec3d corners[4] = {joint(i, kInner, kInnerRise), joint(i, kOuter, kOuterRise),
                              joint(i + 1, kOuter, kOuterRise), joint(i + 1, kInner, kInnerRise)};
    AddWedge(make, corners, kHalfDepth, kDensity, stone);
  }
  const double keystone = joint(kArchWedges / 2, kOuter, kOuterRise).y;
  for (int i = 0; i < kArchBars; ++i) {
    make.Dynamic(BoxOf(0.6, 0.15, kHalfDepth), {0, keystone + 0.15 + 0.3 * i, 0}, 36, stone);
  }
  return make.Take();
}

Scene Dominoes() {
  constexpr double kWide = 0.2, kHigh = 0.8, kThin = 0.05, kRadius = 7, kInward = 0.57, kPush = 1;
  Builder make("dominoes");
  make.Ground({.friction = 0.6});
  const ShapePtr tile = BoxOf(kWide, kHigh, kThin);
  for (int i = 0; i < kDominoes; ++i) {
    const double share = i / (kDominoes - 1.0), angle = 2 * std::numbers::pi * share;
    const SinCos at = SinCosOf(angle);
    const double radius = kRadius - kInward * share;
    BodyDef& body = make.Dynamic(tile, {radius * at.cos, kHigh, radius * at.sin}, 1, {.friction = 0.6});
    body.initial.orientation = Turn({0, 1, 0}, -angle);
    if (i == 0) TurnAbout(body, {radius, 0, kThin}, {kPush, 0, 0});  // about its front edge, towards the next
  }
  return make.Take();
}

}  // namespace tessera::scenes

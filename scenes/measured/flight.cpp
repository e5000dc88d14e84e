#include "scenes/measured/flight.h"

#include <cmath>
#include <numbers>

#include "scenes/measured/builder.h"

namespace tessera::scenes {

Scene FreeFall() {
  Builder make("free fall");
  make.Gravity(10);
  make.Dynamic(BallOf(0.5), {0, 100, 0}, 1);
  return make.Take();
}

Scene FreeBox(bool simple) {
  Builder make("free box");
  make.Gravity(simple ? 0 : 9.81);
  BodyDef& box = make.Dynamic(BoxOf(0.05, 0.2, 0.45), {}, 10);
  box.initial.linear_velocity = simple ? Vec3f{-0.9f, 0.4f, 0.1f} : Vec3f{-2, 2, 8};
  box.initial.angular_velocity = simple ? Vec3f{0.5f, 0, 0} : Vec3f{0.1f, 5, 0.1f};
  return make.Take();
}

Scene THandle(bool stable) {
  Builder make("t-handle");
  make.Gravity(0);
  BodyDef& handle = make.Dynamic(BoxOf(0.5, 0.5, 0.5), {}, 1);
  handle.inertia_kg_m2 = Vec3d{1, 2, 3};
  handle.initial.angular_velocity = stable ? Vec3f{0.5f, 0.5f, 10} : Vec3f{0.01f, 10, 0.01f};
  return make.Take();
}

// A pyramid on a regular n-gon of circumradius r: the n-gon's polar radius of gyration squared is r^2 (2 + cos(2 pi/n))
// / 6, and each section of the pyramid is that n-gon scaled by its height.
SpinningTop MakeSpinningTop() {
  constexpr int kCorners = 7;
  constexpr double kRadius = 2, kHeight = 2, kMass = 1, kGravity = 9.81, kSpin = 75;
  constexpr double kCenter = 0.75 * kHeight;  // centre of mass, above the tip
  const double corner = 2 * std::numbers::pi / kCorners, tilt = std::numbers::pi / 12;
  const double polar = kRadius * kRadius * (2 + SinCosOf(corner).cos) / 6;
  const double axial = 0.6 * polar * kMass;
  const double across = (0.3 * polar + 0.0375 * kHeight * kHeight) * kMass;  // about the centre of mass
  const double about_tip = across + kMass * kCenter * kCenter;

  std::vector<Vec3f> points{{0, static_cast<float>(-kCenter), 0}};
  for (int i = 0; i < kCorners; ++i) {
    const SinCos at = SinCosOf(i * corner);
    points.push_back(Vec3f(Vec3d{kRadius * at.cos, kHeight - kCenter, kRadius * at.sin}));
  }
  SpinningTop result;
  const double cos_tilt = SinCosOf(tilt).cos;
  const double momentum = axial * kSpin;
  result.precession_rad_s =
      (momentum - std::sqrt(momentum * momentum - 4 * about_tip * cos_tilt * kMass * kGravity * kCenter)) /
      (2 * about_tip * cos_tilt);

  Builder make("spinning top");
  make.Gravity(kGravity);
  make.Ground({.friction = 1});
  const Quatd orientation = Turn({0, 0, 1}, tilt);
  const Vec3d axis = Rotate(orientation, Vec3d{0, 1, 0}), precession{0, result.precession_rad_s, 0};
  BodyDef& top = make.Dynamic(HullOf(points), axis * kCenter, kMass, {.friction = 1});
  top.inertia_kg_m2 = Vec3d{across, axial, across};
  top.initial.orientation = orientation;
  TurnAbout(top, {}, precession + axis * (kSpin - result.precession_rad_s * cos_tilt));
  result.top = top.id;
  result.scene = make.Take();
  return result;
}

}  // namespace tessera::scenes

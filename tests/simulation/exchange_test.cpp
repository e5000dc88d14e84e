// Momentum across borders while bodies change hands.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdio>

#include "core/region/frame.h"
#include "tests/simulation/region_group.h"
#include "tests/simulation/scene_builder.h"

namespace tessera::simulation {
namespace {

using ::testing::IsEmpty;

struct MomentumSums {
  Vec3d linear, angular;
};

MomentumSums MomentumOf(const RegionGroup& group, const Scene& scene) {
  MomentumSums sums;
  for (const auto& [id, state] : group.States()) {
    const BodyDef& def = scene.bodies[id.value() - 1];
    const double radius = std::get<SphereShape>(def.shape->form).radius_m;
    const Vec3d p = Vec3d(state.linear_velocity) * def.mass_kg;
    sums.linear += p;
    sums.angular += Cross(state.position, p) + Vec3d(state.angular_velocity) * (0.4 * def.mass_kg * radius * radius);
  }
  return sums;
}

// The frames that went over the links, read by the same codec.
struct LinkTraffic {
  std::map<std::pair<RegionId, RegionId>, std::vector<region::GhostRecord>> before;
  std::size_t impulses = 0, late = 0, grants = 0;

  void Read(RegionId from, const region::OutgoingFrame& out) {
    std::vector<region::GhostRecord>& ghosts = before[{from, out.to}];
    absl::StatusOr<region::BorderFrame> frame = region::Decode(out.bytes, ghosts);
    ASSERT_TRUE(frame.ok()) << frame.status();
    impulses += frame->impulses.size();
    late += frame->late_corrections.size();
    grants += frame->grants.size();
    ghosts = frame->ghosts;
  }
};

// A dense cloud of balls of unequal mass collapses on the corner of four regions, and its balls change hands while they
// touch.
SceneBuilder Cloud(double swirl) {
  SceneBuilder builder(30);
  for (int i = 0; i < 216; ++i) {
    const Vec3d place{-4.0 + i % 6 * 1.5, -4.0 + i / 6 % 6 * 1.5, -4.1 + i / 36 * 1.5};
    const Vec3d inward = place * -0.8 + Vec3d{place.z, 0, -place.x} * swirl;
    BodyDef& ball = builder.Add(Ball(0.5), place, Vec3f(inward), 1.0 + i % 7);
    ball.material.restitution = i % 2 == 0 ? 0.9 : 0.1;
    ball.may_sleep = false;
  }
  return builder;
}

// A correction acts a tick late, where the two bodies have moved on: about where, not just where, the contact was.
std::size_t LateInCloud(double swirl, std::uint32_t regions) {
  const SceneBuilder builder = Cloud(swirl);
  const std::shared_ptr<const Scene> scene = builder.Build();
  double scale = 0, turn_scale = 0;
  for (const BodyDef& def : scene->bodies) {
    const Vec3d p = Vec3d(def.initial.linear_velocity) * def.mass_kg;
    scale += Length(p);
    turn_scale += Length(Cross(def.initial.position, p));
  }
  LinkTraffic traffic;
  RegionGroupOptions options;
  options.settings.hysteresis_m = 0;  // hands change in the thick of it
  options.on_frame = [&](RegionId from, const region::OutgoingFrame& frame) { traffic.Read(from, frame); };
  RegionGroup group(scene, *MakeGridMap(scene->ground(), regions), options);
  const MomentumSums before = MomentumOf(group, *scene);
  group.RunTo(Tick(240));
  const MomentumSums after = MomentumOf(group, *scene);
  const double drift = Length(after.linear - before.linear) / scale;
  const double turn_drift = Length(after.angular - before.angular) / turn_scale;
  std::printf(
      "cloud of 216, %u regions: %lu handovers, %zu impulses told, %zu settled late; "
      "drift of momentum %.1e, of angular momentum %.1e\n",
      regions, static_cast<unsigned long>(group.totals().handovers), traffic.impulses, traffic.late, drift, turn_drift);
  EXPECT_LT(drift, 1e-5);
  EXPECT_LT(turn_drift, regions == 1 ? 1e-7 : 1e-3);
  if (regions > 1) {
    EXPECT_GT(group.totals().handovers, 100U);
  }
  EXPECT_THAT(group.problems(), IsEmpty());
  return traffic.late;
}

TEST(ExchangeTest, MomentumIsKeptWhileTouchingBodiesChangeHands) {
  for (const std::uint32_t regions : {1, 4, 16}) {
    std::size_t late = 0;
    for (const double swirl : {0.4, 0.5, 0.6}) late += LateInCloud(swirl, regions);
    if (regions > 1) {
      EXPECT_GT(late, 0U) << "no body went to a third region while it touched; the test tests less than it says";
    }
  }
}

// A wall across a border, of which nothing is shown as a whole: each side hears what the other's part bears, which is
// about what it bears itself, and solves in as many substeps.
TEST(ExchangeTest, WhatAPileBearsIsToldWithWhatIsShownOfIt) {
  SceneBuilder builder(30);
  builder.Gravity().Floor();
  for (int row = 0; row < 16; ++row) {
    for (int i = 0; i < 12; ++i) builder.Add(Box(0.5), {i - 5.8 + row % 2 * 0.5, 0.5 + row, -3}).may_sleep = false;
  }
  const std::shared_ptr<const Scene> scene = builder.Build();
  LinkTraffic traffic;
  RegionGroupOptions options;
  options.settings.whole_up_to = 0;
  options.on_frame = [&](RegionId from, const region::OutgoingFrame& frame) { traffic.Read(from, frame); };
  RegionGroup group(scene, *MakeGridMap(scene->ground(), 2), options);
  group.RunTo(Tick(120));
  for (const std::uint32_t from : {1U, 2U}) {
    std::size_t supported = 0;
    for (const region::GhostRecord& ghost : traffic.before[{RegionId(from), RegionId(3 - from)}]) {
      if (ghost.externally_supported) {
        ++supported;
        EXPECT_GT(ghost.island_load, 14);
        EXPECT_LT(ghost.island_load, 50);
      } else {
        EXPECT_EQ(ghost.island_load, 0);
      }
    }
    EXPECT_GT(supported, 10U);
  }
  EXPECT_THAT(group.problems(), IsEmpty());
}

double CradleThrough(std::uint32_t regions, int balls) {
  SceneBuilder builder(20);
  for (int i = 0; i < balls; ++i) {
    BodyDef& ball = builder.Add(Ball(0.5), {-2.5 + i - (i == 0 ? 1.0 : 0.0), 1, -5}, i == 0 ? Vec3f{4, 0, 0} : Vec3f());
    ball.material.restitution = 1;
    ball.material.friction = 0;
  }
  const std::shared_ptr<const Scene> scene = builder.Build();
  RegionGroup group(scene, *MakeGridMap(scene->ground(), regions), {});
  group.RunTo(Tick(120));
  EXPECT_THAT(group.problems(), IsEmpty());
  double right = 0;
  for (const auto& [id, state] : group.States()) {
    if (state.position.x > 0) right += state.linear_velocity.x;
  }
  return right / 4;
}

// A touching cradle: what the first ball brings arrives beyond the border.
TEST(ExchangeTest, ACradlePassesItsMomentumOn) {
  const double one = CradleThrough(1, 6), two = CradleThrough(2, 6);
  std::printf(
      "touching cradle of six, e = 1: %.1f %% of the momentum arrives beyond the border, %.1f %% in one world\n",
      two * 100, one * 100);
  EXPECT_NEAR(two, one, 0.05);
}

struct Rest {
  std::map<BodyId, BodyState> states;
  double fastest_m_s = 0;
};

// More boxes than are shown as a whole, none of which may sleep, put where they lie.
Rest PileAtRest(std::uint32_t regions, std::uint64_t ticks) {
  constexpr int kLayers = 8;
  SceneBuilder builder(20);
  builder.Gravity().Floor();
  for (int layer = 0; layer < kLayers; ++layer) {
    const int side = kLayers - layer;
    for (int i = 0; i < side * side; ++i) {
      const double x = i % side - (side - 1) / 2.0, z = i / side - (side - 1) / 2.0;
      builder.Add(Box(0.5), {x * 1.01, 0.5 + layer, z * 1.01}).may_sleep = false;
    }
  }
  const std::shared_ptr<const Scene> scene = builder.Build();
  RegionGroup group(scene, *MakeGridMap(scene->ground(), regions), {});
  group.RunTo(Tick(ticks));
  EXPECT_THAT(group.problems(), IsEmpty());
  Rest rest;
  for (const auto& [id, state] : group.States()) {
    rest.states[id] = state;
    rest.fastest_m_s = std::max<double>(rest.fastest_m_s, Length(state.linear_velocity));
  }
  return rest;
}

// Ghosts bear what is not shown and what is told for each other, and the two sides do not shake what lies.
TEST(ExchangeTest, APileAcrossBordersLiesStill) {
  const Rest one = PileAtRest(1, 300);
  for (const std::uint32_t regions : {2U, 4U}) {
    const Rest many = PileAtRest(regions, 300);
    ASSERT_EQ(many.states.size(), one.states.size());
    double off_m = 0;
    for (const auto& [id, state] : many.states) {
      off_m = std::max(off_m, std::abs(state.position.y - one.states.at(id).position.y));
    }
    std::printf("pile of 204, %u regions: fastest %.2e m/s, one world's %.2e; heights off by %.2e m\n", regions,
                many.fastest_m_s, one.fastest_m_s, off_m);
    EXPECT_LT(many.fastest_m_s, 0.01);
    EXPECT_LT(off_m, 4e-3);  // in four regions one box lies 2.2 mm off: why is not known
  }
}

}  // namespace
}  // namespace tessera::simulation

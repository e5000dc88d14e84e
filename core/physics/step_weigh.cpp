// How hard each island is to solve, and how many substeps it gets.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

// How far a joint's locked axes have come apart, m.
float GapOf(const JointRows& rows) {
  float gap = 0;
  for (int i = 0; i < rows.count; ++i) {
    const Row& row = rows.rows[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::kLocked && row.linear != Vec3f()) gap = std::max(gap, std::abs(row.error));
  }
  return gap;
}

float MassRatio(double a_kg, double b_kg) {
  const double ratio = a_kg / b_kg;
  return static_cast<float>(std::max(ratio, 1 / ratio));
}

// Loads are told in those of a unit cube under 10 m/s^2 at 60 Hz, for which solve/substeps.h has its measurements: what
// counts is how far a body falls in a step against how large it is.
constexpr double kReferencePull_m = 10.0 / 3600;
double ScaleOf(double inner_radius_m, double pull) {
  return pull * std::max(1.0, 0.5 / std::max(inner_radius_m, kLeastInner_m));
}

}  // namespace

// What hangs together is pushed as one: a hand that carries its body is no light thing under a heavy one.
void World::Impl::WeighAssemblies() {
  const auto tied = [](const Joint& joint) { return joint.b != nullptr && joint.a->awake() && joint.b->awake(); };
  tied_bodies.clear();
  for (const Joint* joint : awake_joints) {
    if (tied(*joint)) tied_bodies.insert(tied_bodies.end(), {joint->a->awake_index, joint->b->awake_index});
  }
  std::sort(tied_bodies.begin(), tied_bodies.end());
  tied_bodies.erase(std::unique(tied_bodies.begin(), tied_bodies.end()), tied_bodies.end());
  const auto index = [this](const RigidBody& body) {
    const auto at = std::lower_bound(tied_bodies.begin(), tied_bodies.end(), body.awake_index);
    return static_cast<std::uint32_t>(at - tied_bodies.begin());
  };
  assemblies.Reset(tied_bodies.size());
  for (const Joint* joint : awake_joints) {
    if (tied(*joint)) assemblies.Unite(index(*joint->a), index(*joint->b));
  }
  assemblies.Number();
  for (std::uint32_t i = 0; i < tied_bodies.size(); ++i) assemblies.Of(i).mass_kg += burdens[tied_bodies[i]].mass_kg;
  for (std::uint32_t i = 0; i < tied_bodies.size(); ++i) burdens[tied_bodies[i]].tied_kg = assemblies.Of(i).mass_kg;
}

// What an island's substeps are chosen by.
void World::Impl::WeighIslands() {
  supports.clear();
  passed_before.resize(awake.size());
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    RigidBody& body = *awake[i];
    passed_before[i] = std::exchange(body.passed_down, 0.0f);
    Island& island = islands.Of(i);
    island.demand.last = std::max(island.demand.last, std::exchange(body.substeps, 0));
    island.load_before = std::max(island.load_before, std::exchange(body.island_load, kUnknownLoad));
    island.load_elsewhere = std::max(island.load_elsewhere, body.elsewhere.island_load);
  }
  if (touching.empty() && awake_joints.empty()) return;  // then all of them fly
  const Vec3d gravity = settings.gravity_m_s2;
  const auto g = static_cast<float>(Length(gravity));
  const double pull = Length(gravity) * dt_s * dt_s / kReferencePull_m;
  const Vec3d up = g > 0 ? Normalized(-gravity) : Vec3d();
  burdens.resize(awake.size());
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    const RigidBody& body = *awake[i];
    const double mass = body.mass_kg();
    burdens[i] = {mass, mass, mass, Dot(body.placement().position, up)};
    Island& island = islands.Of(i);
    island.mass_kg += mass;
    island.lightest_kg = std::min(island.lightest_kg, mass);
    island.smallest_m = std::min(island.smallest_m, body.geometry().inner_radius_m);
  }
  if (!awake_joints.empty()) WeighAssemblies();
  for (Island& island : islands.all()) {
    island.laden = g > 0 && island.mass_kg * ScaleOf(island.smallest_m, pull) >= kLightIsland * island.lightest_kg;
  }
  for (const Touch& touch : touching) {
    if (!touch.responds) continue;
    Island& island = islands.Of(touch.one());
    IslandDemand& demand = island.demand;
    demand.contacts += static_cast<int>(touch.count);
    if (!touch.both()) island.adrift = false;
    if (!touch.live) continue;
    island.solved = true;
    if (PropsMeet(touch)) continue;
    if (island.laden) NoteSupport(touch, up, pull);
    auto lighter = static_cast<float>(burdens[touch.one()].tied_kg);
    if (touch.both()) {
      const Burden &low = burdens[touch.low], &high = burdens[touch.high];
      lighter = static_cast<float>(std::min(low.tied_kg, high.tied_kg));
      demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(low.mass_kg, high.mass_kg));
    }
    demand.penetration_m = std::max(demand.penetration_m, touch.penetration_m);
    demand.impact_m_s = std::max(demand.impact_m_s, touch.impact_m_s);
    const float weight = lighter * g * static_cast<float>(dt_s);
    if (weight <= 0) continue;
    const double scale = ScaleOf(touch.inner_m, g * dt_s * dt_s / kReferencePull_m);
    demand.load_ratio = std::max(demand.load_ratio, static_cast<float>(scale) * touch.load_ns / weight);
  }
  for (std::size_t i = 0; i < awake_joints.size(); ++i) {
    const Joint& joint = *awake_joints[i];
    const RigidBody& body = joint.a->awake() ? *joint.a : *joint.b;
    Island& island = islands.Of(body.awake_index);
    island.solved = true;
    island.adrift = false;
    IslandDemand& demand = island.demand;
    ++demand.joints;
    demand.joint_error_m = std::max(demand.joint_error_m, GapOf(joint_rows[i]));
    if (joint.b != nullptr && joint.a->dynamic() && joint.b->dynamic()) {
      demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(joint.a->mass_kg(), joint.b->mass_kg()));
    }
  }
}

// Both lean on what is not here: what they do to each other is reckoned with where that is.
bool World::Impl::PropsMeet(const Touch& touch) const {
  const auto propped = [this](std::uint32_t body) { return body == kAsleep || awake[body]->elsewhere.propped; };
  return propped(touch.low) && propped(touch.high);
}

// Which body of a pair that may push stands on the other, if either does. `up`: against gravity.
void World::Impl::NoteSupport(const Touch& touch, Vec3d up, double pull) {
  constexpr float kUnder = 0.3f;  // cosine of how far a support may lie to the side
  const float lift = Dot(touch.normal, Vec3f(up));
  if (std::abs(lift) <= kUnder) return;
  const std::uint32_t upper = lift > 0 ? touch.high : touch.low, lower = lift > 0 ? touch.low : touch.high;
  if (upper == kAsleep) return;
  // What it stands on besides is not all here: what it was seen to press with is what it presses with.
  const double borne_kg = awake[upper]->elsewhere.propped ? touch.load_ns / (Length(settings.gravity_m_s2) * dt_s) : -1;
  supports.push_back({upper, lower, ScaleOf(touch.inner_m, pull), borne_kg});
}

// Those of one body side by side, in the order of their pairs; and the bodies from the top down.
void World::Impl::GroupSupports() {
  uppers.clear();
  first_supports.assign(awake.size() + 2, 0);
  for (const Support& support : supports) {
    if (first_supports[support.upper + 2]++ == 0) uppers.emplace_back(burdens[support.upper].height_m, support.upper);
  }
  std::partial_sum(first_supports.begin(), first_supports.end(), first_supports.begin());
  grouped.resize(supports.size());
  for (const Support& support : supports) grouped[first_supports[support.upper + 1]++] = support;
  std::sort(uppers.begin(), uppers.end(), [this](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : awake[a.second]->id() < awake[b.second]->id();
  });
}

// What lies on a new pile is not felt at its foot before the solver has passed it down, and with too few substeps it
// never is. So for islands that may be heavily laden, weights are passed down body by body from the top, in equal
// shares to all that a body stands on: what statics would say of a tower, and about what it says of a heap. The lesser
// of two steps counts: what comes down upon a pile lifts much of it off what it stands on for a step, and for so long
// the weight of all seems to rest on a few.
void World::Impl::PassLoadsDown() {
  if (supports.empty()) return;
  GroupSupports();
  for (const auto& [height_m, upper] : uppers) {
    const Burden& burden = burdens[upper];
    const std::uint32_t first = first_supports[upper], last = first_supports[upper + 1];
    const double equal_share = burden.carried_kg / (last - first);
    const double column = last - first == 1 && !awake[upper]->elsewhere.propped ? kColumnLoad : 1;
    IslandDemand& demand = islands.Of(upper).demand;
    float passed = 0;
    for (std::uint32_t i = first; i < last; ++i) {
      const Support& support = grouped[i];
      const bool firm = support.lower == kAsleep;
      const double share = support.borne_kg < 0 ? equal_share : support.borne_kg;
      const double lighter = firm ? burden.tied_kg : std::min(burdens[support.lower].tied_kg, burden.tied_kg);
      const auto load = static_cast<float>(column * support.scale * share / lighter);
      passed = std::max(passed, load);
      if (!firm) burdens[support.lower].carried_kg += share;
    }
    awake[upper]->passed_down = passed;
    demand.load_ratio = std::max(demand.load_ratio, std::min(passed, passed_before[upper]));
  }
}

// A load counts as its mean over some ten steps: what comes down upon a pile makes it rise and fall from step to step,
// and as many substeps with it, and piles that differ by a hair would fall apart by what they were given. Where part of
// an island is elsewhere, all of it gets what the part with the larger load does.
void World::Impl::EvenLoads() {
  for (Island& island : islands.all()) {
    if (!island.solved) continue;
    float& load = island.demand.load_ratio;
    if (island.load_before >= 0) load = island.load_before + (load - island.load_before) / kLoadSteps;
    if (!(load <= kMostIslandLoad)) load = kMostIslandLoad;
    island.load = load;
    load = std::max(load, island.load_elsewhere);
  }
}

void World::Impl::MakeJointRows() {
  joint_rows.resize(awake_joints.size());
  const Placement world;
  for (std::size_t i = 0; i < awake_joints.size(); ++i) {
    Joint& joint = *awake_joints[i];
    if (joint.b != nullptr) {
      joint.model.MakeRows(joint.a->placement(), joint.b->placement(), &joint_rows[i]);
    } else {
      joint.model.MakeRows(world, joint.a->placement(), &joint_rows[i]);
    }
  }
}

// Each island as many as it needs, all together within a budget of work; or as many as were asked for.
void World::Impl::ChooseSubsteps() {
  if (settings.substeps > 0) {
    for (Island& island : islands.all()) island.batch = 0;
    batches[0].substeps = settings.substeps;
    return;
  }
  works.clear();
  for (Island& island : islands.all()) {
    if (!island.solved) continue;
    IslandDemand& demand = island.demand;
    // The end of a chain pulls at all of it, however alike its links are.
    const auto pull = static_cast<float>(island.mass_kg / island.lightest_kg);
    if (demand.joints > 0) demand.mass_ratio = std::max(demand.mass_ratio, std::min(pull, kMostPull));
    works.push_back({island.demand.contacts, island.demand.joints, SubstepsFor(island.demand)});
  }
  KeepBudget(works, kWorkBudget);
  auto work = works.begin();
  for (Island& island : islands.all()) {
    if (island.solved) island.batch = std::bit_width(static_cast<unsigned>((work++)->substeps)) - 1;
  }
  for (std::size_t i = 0; i < batches.size(); ++i) batches[i].substeps = 1 << i;
}

}  // namespace tessera::physics

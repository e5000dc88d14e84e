// How hard each island is to solve, and how many substeps it gets.
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

float Approach(const Pair& pair, const Manifold& manifold, const ManifoldPoint& point) {
  const auto velocity = [](const RigidBody& body, Vec3f r) {
    if (!body.awake()) return Vec3f();
    return body.state().linear_velocity + Cross(body.state().angular_velocity, r);
  };
  return -Dot(velocity(*pair.high, point.r_b) - velocity(*pair.low, point.r_a), manifold.normal);
}

// How far a joint's locked axes have come apart, m.
float GapOf(const JointRows& rows) {
  float gap = 0;
  for (int i = 0; i < rows.count; ++i) {
    const Row& row = rows.rows[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::kLocked && row.linear != Vec3f()) gap = std::max(gap, std::abs(row.error));
  }
  return gap;
}

float MassRatio(const RigidBody& a, const RigidBody& b) {
  const double ratio = a.mass_kg() / b.mass_kg();
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
  assemblies.Reset(awake.size());
  for (const Joint* joint : awake_joints) {
    if (joint->b != nullptr && joint->a->awake() && joint->b->awake()) {
      assemblies.Unite(joint->a->awake_index, joint->b->awake_index);
    }
  }
  assemblies.Number();
  for (const RigidBody* body : awake) assemblies.Of(body->awake_index).mass_kg += body->mass_kg();
  for (RigidBody* body : awake) body->tied_kg = assemblies.Of(body->awake_index).mass_kg;
}

// What an island's substeps are chosen by.
void World::Impl::WeighIslands() {
  for (RigidBody* body : awake) {
    Island& island = islands.Of(body->awake_index);
    body->carried_kg = body->tied_kg = body->mass_kg();
    island.mass_kg += body->mass_kg();
    island.lightest_kg = std::min(island.lightest_kg, body->mass_kg());
    island.smallest_m = std::min(island.smallest_m, body->geometry().inner_radius_m);
  }
  if (!awake_joints.empty()) WeighAssemblies();
  const Vec3d gravity = settings.gravity_m_s2;
  const auto g = static_cast<float>(Length(gravity));
  const double pull = Length(gravity) * dt_s * dt_s / kReferencePull_m;
  const Vec3d up = g > 0 ? Normalized(-gravity) : Vec3d();
  for (Island& island : islands.all()) {
    island.laden = g > 0 && island.mass_kg * ScaleOf(island.smallest_m, pull) >= kLightIsland * island.lightest_kg;
  }
  supports.clear();
  for (const Pair* pair : touching) {
    if (!pair->responds()) continue;
    const RigidBody &low = *pair->low, &high = *pair->high;
    Island& island = islands.Of((low.awake() ? low : high).awake_index);
    IslandDemand& demand = island.demand;
    demand.contacts += static_cast<int>(pair->manifolds.size());
    demand.last = std::max(demand.last, pair->substeps);
    if (!pair->live) continue;
    island.solved = true;
    if (island.laden) NoteSupport(*pair, up, pull);
    const bool both = low.awake() && high.awake();
    const auto lighter = static_cast<float>(both          ? std::min(low.tied_kg, high.tied_kg)
                                            : low.awake() ? low.tied_kg
                                                          : high.tied_kg);
    if (both) demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(low, high));
    for (const Manifold& manifold : pair->manifolds) {
      for (int i = 0; i < manifold.count; ++i) {
        const ManifoldPoint& point = manifold.points[static_cast<std::size_t>(i)];
        demand.penetration_m = std::max(demand.penetration_m, -point.separation_m);
        demand.impact_m_s = std::max(demand.impact_m_s, Approach(*pair, manifold, point));
      }
    }
    const float weight = lighter * g * static_cast<float>(dt_s);
    if (weight <= 0) continue;
    const double scale = ScaleOf(pair->inner_m, g * dt_s * dt_s / kReferencePull_m);
    demand.load_ratio = std::max(demand.load_ratio, static_cast<float>(scale) * pair->load_ns / weight);
  }
  for (std::size_t i = 0; i < awake_joints.size(); ++i) {
    const Joint& joint = *awake_joints[i];
    const RigidBody& body = joint.a->awake() ? *joint.a : *joint.b;
    Island& island = islands.Of(body.awake_index);
    island.solved = true;
    IslandDemand& demand = island.demand;
    ++demand.joints;
    demand.last = std::max(demand.last, joint.substeps);
    demand.joint_error_m = std::max(demand.joint_error_m, GapOf(joint_rows[i]));
    if (joint.b != nullptr && joint.a->dynamic() && joint.b->dynamic()) {
      demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(*joint.a, *joint.b));
    }
  }
}

// Which body of a pair that may push stands on the other, if either does. `up`: against gravity.
void World::Impl::NoteSupport(const Pair& pair, Vec3d up, double pull) {
  constexpr float kUnder = 0.3f;  // cosine of how far a support may lie to the side
  const float lift = Dot(pair.manifolds.front().normal, Vec3f(up));
  if (std::abs(lift) <= kUnder) return;
  RigidBody &upper = lift > 0 ? *pair.high : *pair.low, &lower = lift > 0 ? *pair.low : *pair.high;
  if (!upper.awake()) return;
  supports.push_back({Dot(upper.placement().position, up), ScaleOf(pair.inner_m, pull), &upper, &lower});
}

// What lies on a new pile is not felt at its foot before the solver has passed it down, and with too few substeps it
// never is. So for islands that may be heavily laden, weights are passed down body by body from the top, in equal
// shares to all that a body stands on: what statics would say of a tower, and about what it says of a heap.
void World::Impl::PassLoadsDown() {
  std::stable_sort(supports.begin(), supports.end(), [](const Support& a, const Support& b) {
    return a.height_m != b.height_m ? a.height_m > b.height_m : a.upper->id() < b.upper->id();
  });
  for (auto first = supports.begin(); first != supports.end();) {
    const RigidBody& body = *first->upper;
    const auto last = std::find_if(first, supports.end(), [&](const Support& other) { return other.upper != &body; });
    const double share = body.carried_kg / static_cast<double>(last - first);
    const double column = last - first == 1 ? kColumnLoad : 1;
    IslandDemand& demand = islands.Of(body.awake_index).demand;
    for (; first != last; ++first) {
      RigidBody& other = *first->lower;
      const double lighter = other.awake() ? std::min(other.tied_kg, body.tied_kg) : body.tied_kg;
      const double load = column * first->scale * share / lighter;
      demand.load_ratio = std::max(demand.load_ratio, static_cast<float>(load));
      if (other.awake()) other.carried_kg += share;
    }
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

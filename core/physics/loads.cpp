#include "core/physics/loads.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/physics/tuning.h"

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

// Load ratios are scaled to those of a unit cube under 10 m/s^2 at 60 Hz, for which solve/substeps.h has its
// measurements: what counts is how far a body falls in a step against how large it is.
constexpr double kReferencePull_m = 10.0 / 3600;
double ScaleOf(double inner_radius_m, double pull) {
  return pull * std::max(1.0, 0.5 / std::max(inner_radius_m, kLeastInner_m));
}

}  // namespace

void Loads::Run(const LoadInput& in) {
  plans_.assign(in.islands.count(), {});
  propagated_.assign(in.awake.size(), 0);
  bearing_.clear();
  if (!in.contacts.empty() || !in.joints.empty()) {
    pull_ = PullOf(gravity_m_s2_, in.dt_s);
    sums_.assign(in.islands.count(), {});
    supports_.clear();
    WeighBodies(in);
    WeighGroups(in);
    WeighContacts(in);
    WeighJoints(in);
    PropagateLoads(in);
    SmoothLoads();
    if (heavy_ && fixed_substeps_ == 0) FindDirect(in);
    ChooseSubsteps();
  }
  Remember(in);
}

Loads::Pull Loads::PullOf(Vec3d gravity_m_s2, double dt_s) {
  const double g = Length(gravity_m_s2);
  const auto single_g = static_cast<float>(g);
  return {.up = single_g > 0 ? Normalized(-gravity_m_s2) : Vec3d(),
          .g_m_s2 = g,
          .single_g_m_s2 = single_g,
          .share = g * dt_s * dt_s / kReferencePull_m,
          .single_share = single_g * dt_s * dt_s / kReferencePull_m};
}

void Loads::WeighBodies(const LoadInput& in) {
  weights_.resize(in.awake.size());
  shares_.resize(in.awake.size());
  team_.For(in.awake.size(), kChunkBodies, [this, awake = in.awake](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      PrefetchAfter(i, awake, kUpToMass);
      const RigidBody& body = *awake[i];
      const double mass = body.mass_kg();
      weights_[i] = {body.id(), body.support.external, mass, mass, mass, Dot(body.placement().position, pull_.up)};
      shares_[i] = {body.load.substeps, body.load.island_load, body.support.island_load,
                    body.geometry().inner_radius_m};
    }
  });
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    const BodyShare& share = shares_[i];
    const double mass = weights_[i].mass_kg;
    Sums& sums = sums_[in.islands.IndexOf(i)];
    sums.demand.last = std::max(sums.demand.last, share.substeps);
    sums.load_before = std::max(sums.load_before, share.load_before);
    sums.load_outside = std::max(sums.load_outside, share.load_outside);
    sums.mass_kg += mass;
    sums.lightest_kg = std::min(sums.lightest_kg, mass);
    sums.smallest_m = std::min(sums.smallest_m, share.inner_radius_m);
  }
  for (Sums& sums : sums_) {
    sums.loaded = pull_.single_g_m_s2 > 0 &&
                  sums.mass_kg * ScaleOf(sums.smallest_m, pull_.share) >= kLightIsland * sums.lightest_kg;
  }
}

// A jointed group is pushed as one: a hand that carries its body is no light thing under a heavy one.
void Loads::WeighGroups(const LoadInput& in) {
  const std::span<const std::uint32_t> bodies = in.groups.bodies();
  group_kg_.assign(in.groups.count(), 0);
  for (std::size_t i = 0; i < bodies.size(); ++i) group_kg_[in.groups.GroupOf(i)] += weights_[bodies[i]].mass_kg;
  for (std::size_t i = 0; i < bodies.size(); ++i) weights_[bodies[i]].connected_kg = group_kg_[in.groups.GroupOf(i)];
}

void Loads::WeighContacts(const LoadInput& in) {
  const auto externally_supported = [this](std::uint32_t body) {
    return body == kAsleep || weights_[body].externally_supported;
  };
  for (const ActiveContact& contact : in.contacts) {
    if (!contact.responds) continue;
    const std::uint32_t island = in.islands.IndexOf(contact.one());
    Sums& sums = sums_[island];
    IslandPlan& plan = plans_[island];
    sums.demand.contacts += static_cast<int>(contact.count);
    if (!contact.both()) plan.unanchored = false;
    if (!contact.live) continue;
    plan.solved = true;
    // Both lean on bodies outside the world, so what they do to each other counts where those are.
    if (externally_supported(contact.low) && externally_supported(contact.high)) continue;
    if (sums.loaded) NoteSupport(in, contact);
    WeighContact(in, contact, sums);
  }
}

void Loads::WeighContact(const LoadInput& in, const ActiveContact& contact, Sums& sums) {
  IslandDemand& demand = sums.demand;
  auto lighter = static_cast<float>(weights_[contact.one()].connected_kg);
  if (contact.both()) {
    const BodyWeight &low = weights_[contact.low], &high = weights_[contact.high];
    lighter = static_cast<float>(std::min(low.connected_kg, high.connected_kg));
    demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(low.mass_kg, high.mass_kg));
  }
  demand.penetration_m = std::max(demand.penetration_m, contact.penetration_m);
  demand.impact_m_s = std::max(demand.impact_m_s, contact.impact_m_s);
  const float weight = lighter * pull_.single_g_m_s2 * static_cast<float>(in.dt_s);
  if (weight <= 0) return;
  const double scale = ScaleOf(contact.inner_m, pull_.single_share);
  demand.load_ratio = std::max(demand.load_ratio, static_cast<float>(scale) * contact.load_ns / weight);
}

// Notes which body of a pair that may push stands on the other, if either does.
void Loads::NoteSupport(const LoadInput& in, const ActiveContact& contact) {
  constexpr float kUnder = 0.3f;  // cosine of how far a support may lie to the side
  const float lift = Dot(contact.normal, Vec3f(pull_.up));
  if (std::abs(lift) <= kUnder) return;
  const std::uint32_t upper = lift > 0 ? contact.high : contact.low, lower = lift > 0 ? contact.low : contact.high;
  if (upper == kAsleep) return;
  // An externally supported body stands on more than can be seen here. What it pressed with is what it presses with.
  const double known_kg = in.awake[upper]->support.external ? contact.load_ns / (pull_.g_m_s2 * in.dt_s) : -1;
  supports_.push_back({upper, lower, ScaleOf(contact.inner_m, pull_.share), known_kg});
}

void Loads::WeighJoints(const LoadInput& in) {
  for (std::size_t i = 0; i < in.joints.size(); ++i) {
    const Joint& joint = *in.joints[i];
    const std::uint32_t island = in.islands.IndexOf(joint.AwakeBody().awake_index);
    plans_[island].solved = true;
    plans_[island].unanchored = false;
    IslandDemand& demand = sums_[island].demand;
    ++demand.joints;
    demand.joint_error_m = std::max(demand.joint_error_m, GapOf(in.rows[i]));
    if (joint.b != nullptr && joint.a->dynamic() && joint.b->dynamic()) {
      demand.mass_ratio = std::max(demand.mass_ratio, MassRatio(joint.a->mass_kg(), joint.b->mass_kg()));
    }
  }
}

// The lesser load of two steps counts: something that comes down upon a pile lifts much of it off what it stands on for
// a step, and for so long the weight of all seems to rest on a few.
void Loads::PropagateLoads(const LoadInput& in) {
  for (const PropagatedLoad& load : propagation_.Run(supports_, weights_)) {
    propagated_[load.body] = load.load_ratio;
    float& counted = sums_[in.islands.IndexOf(load.body)].demand.load_ratio;
    counted = std::max(counted, std::min(load.load_ratio, in.awake[load.body]->load.propagated));
  }
}

// A load counts as its mean over some ten steps: a body that comes down upon a pile makes it rise and fall from step to
// step, and as many substeps with it, and piles that differ by a hair would fall apart by the substeps that they got.
// Where part of an island is outside the world, all of it gets what the part with the larger load does.
void Loads::SmoothLoads() {
  heavy_ = false;
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (!plans_[i].solved) continue;
    Sums& sums = sums_[i];
    float& load = sums.demand.load_ratio;
    if (sums.load_before >= 0) load = sums.load_before + (load - sums.load_before) / kLoadSteps;
    if (!(load <= kMostIslandLoad)) load = kMostIslandLoad;
    plans_[i].load = load;
    heavy_ |= load >= kDirectLoad;
    load = std::max(load, sums.load_outside);
  }
}

// Islands that carry more than any number of substeps holds, and are whole: with no joint, and no part outside the
// world. While something comes down on them they are left to their substeps: rigid contacts pass a blow on undamped.
void Loads::FindDirect(const LoadInput& in) {
  bool any = false;
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    const Sums& sums = sums_[i];
    plans_[i].direct = plans_[i].load >= kDirectLoad && sums.demand.joints == 0 && sums.load_outside <= 0 &&
                       sums.demand.impact_m_s < kCalm_m_s;
    any |= plans_[i].direct;
  }
  if (!any) return;
  for (std::uint32_t i = 0; i < in.awake.size(); ++i) {
    if (weights_[i].externally_supported) plans_[in.islands.IndexOf(i)].direct = false;
  }
  MarkBearing(in);
}

// All contacts of a small island, of others those that bear much. An island where these are too many is left to its
// substeps.
void Loads::MarkBearing(const LoadInput& in) {
  bearing_.assign(in.contacts.size(), 0);
  bearing_of_.assign(plans_.size(), 0);
  std::vector<float> others(plans_.size(), 0);  // by island: largest load of those that are not solved together
  for (std::size_t i = 0; i < in.contacts.size(); ++i) {
    const ActiveContact& contact = in.contacts[i];
    const std::uint32_t island = in.islands.IndexOf(contact.one());
    if (!contact.responds || !plans_[island].direct) continue;
    const float load = LoadOf(in, contact);
    if (sums_[island].demand.contacts <= kMostBearing || load >= kBearsToo) {
      bearing_[i] = 1;
      bearing_of_[island] += static_cast<int>(contact.count);
    } else if (contact.live) {
      others[island] = std::max(others[island], load);
    }
  }
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (!plans_[i].direct) continue;
    plans_[i].direct = bearing_of_[i] <= kMostBearing;
    if (plans_[i].direct) sums_[i].demand.load_ratio = others[i];
  }
  for (std::size_t i = 0; i < in.contacts.size(); ++i) {
    if (!plans_[in.islands.IndexOf(in.contacts[i].one())].direct) bearing_[i] = 0;
  }
}

// The larger of what a contact bore in the last step and of what the upper of its two presses with, by what stands on
// it; scaled as all loads are.
float Loads::LoadOf(const LoadInput& in, const ActiveContact& contact) const {
  double lighter = weights_[contact.one()].connected_kg;
  if (contact.both()) lighter = std::min(weights_[contact.low].connected_kg, weights_[contact.high].connected_kg);
  const float weight = static_cast<float>(lighter) * pull_.single_g_m_s2 * static_cast<float>(in.dt_s);
  const double scale = ScaleOf(contact.inner_m, pull_.single_share);
  const float measured = weight > 0 ? static_cast<float>(scale) * contact.load_ns / weight : 0;
  const std::uint32_t upper = Dot(contact.normal, Vec3f(pull_.up)) > 0 ? contact.high : contact.low;
  return std::max(measured, upper == kAsleep ? 0 : propagated_[upper]);
}

// Gives each island as many substeps as it needs, all together within a budget of work.
void Loads::ChooseSubsteps() {
  works_.clear();
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (!plans_[i].solved) continue;
    if (fixed_substeps_ > 0) {
      plans_[i].substeps = fixed_substeps_;
      continue;
    }
    IslandDemand& demand = sums_[i].demand;
    // The end of a chain pulls at all of it, however alike its links are.
    const auto pull = static_cast<float>(sums_[i].mass_kg / sums_[i].lightest_kg);
    if (demand.joints > 0) demand.mass_ratio = std::max(demand.mass_ratio, std::min(pull, kMostPull));
    works_.push_back({demand.contacts, demand.joints, SubstepsFor(demand)});
    if (!plans_[i].direct) continue;
    works_.back().substeps = std::max(works_.back().substeps, kDirectSubsteps);
    works_.back().contacts += kDirectWork * bearing_of_[i];
  }
  if (fixed_substeps_ > 0) return;
  KeepBudget(works_, kWorkBudget);
  auto work = works_.begin();
  for (IslandPlan& plan : plans_) {
    if (!plan.solved) continue;
    plan.substeps = (work++)->substeps;
    plan.level = std::bit_width(static_cast<unsigned>(plan.substeps)) - 1;
  }
}

void Loads::Remember(const LoadInput& in) const {
  team_.For(in.awake.size(), kChunkBodies, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const IslandPlan& plan = plans_[in.islands.IndexOf(static_cast<std::uint32_t>(i))];
      in.awake[i]->load = {propagated_[i], plan.substeps, plan.load};
    }
  });
}

bool Loads::Validate() const {
  return std::all_of(plans_.begin(), plans_.end(), [this](const IslandPlan& plan) {
    if (!plan.solved) return plan.substeps == 0 && plan.load == kUnknownLoad;
    if (!(plan.load >= 0 && plan.load <= kMostIslandLoad)) return false;
    if (fixed_substeps_ > 0) return plan.substeps == fixed_substeps_ && plan.level == 0;
    return plan.level >= 0 && plan.level < kSubstepLevels && plan.substeps == 1 << plan.level;
  });
}

}  // namespace tessera::physics

// What a sweep stopped, and what is jointed to it, goes its way only up to there; or is carried on by what it met.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/physics/motion/turn.h"
#include "core/physics/tuning.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

// By how much a body that lay as `from` has been turned, once it lies as `to`.
Quatd TurnFrom(const Placement& from, Quatd to) { return to * Conjugate(from.orientation); }

// Angular momentum of a body that turns at `spin`, rad/s, world axes.
Vec3d SpinMomentum(const RigidBody& body, Quatd orientation, Vec3d spin) {
  const Vec3d w = Rotate(Conjugate(orientation), spin), inertia = body.inertia();
  return Rotate(orientation, Vec3d{inertia.x * w.x, inertia.y * w.y, inertia.z * w.z});
}

}  // namespace

// A joint among what was stopped. A null body stands for what does not move: the world, something static.
struct World::Impl::StoppedJoint {
  RigidBody *a = nullptr, *b = nullptr;
  Vec3d arm_a, arm_b;            // from each centre to its end of the joint, as the bodies lay at the start
  Vec3d anchor_a, anchor_b;      // likewise, in the world
  Vec3d start_gap_m, end_gap_m;  // from a's end to b's, as seen from a: at the start, and had nothing stopped it
  double share = 1;              // of the step that it goes

  // Where a's and b's ends are while the bodies are as in `motions`.
  Vec3d EndA(std::span<const Motion> motions) const { return a != nullptr ? EndOf(*a, motions, arm_a) : anchor_a; }
  Vec3d EndB(std::span<const Motion> motions) const { return b != nullptr ? EndOf(*b, motions, arm_b) : anchor_b; }
  Vec3d Gap(std::span<const Motion> motions) const {
    const Vec3d gap = start_gap_m * (1 - share) + end_gap_m * share;
    return a != nullptr ? Rotate(TurnFrom(a->placement(), motions[a->awake_index].orientation), gap) : gap;
  }

 private:
  static Vec3d EndOf(const RigidBody& body, std::span<const Motion> motions, Vec3d arm) {
    const Motion& motion = motions[body.awake_index];
    return motion.position + Rotate(TurnFrom(body.placement(), motion.orientation), arm);
  }
};

// By awake_index.
struct World::Impl::Anchors {
  // Which one of each assembly stays where its sweep ended: that which was stopped first, and none of what hangs on
  // something that holds still.
  std::vector<bool> placed;
  std::vector<bool> ring;  // there is more than one way from one of its bodies, or from what holds still, to another
};

// Whether a body goes its way, and takes the other along, where the two meet: so does what is much heavier, or a ship
// would stop in its course, with all that stands in it, for a ball that bounces within. What is jointed is not taken
// along, for it would have to be with all that hangs on it.
bool World::Impl::Carries(const RigidBody& body, const RigidBody& other) {
  return body.awake() && other.awake() && other.joints.empty() && body.mass_kg() >= kCarrierMass * other.mass_kg();
}

void World::Impl::MoveStopped() {
  SortStopped();
  const auto has_joints = [&](const Stop& stop) { return !awake[stop.index]->joints.empty(); };
  const bool any_jointed = std::any_of(stopped.begin(), stopped.end(), has_joints);
  Anchors anchors;
  std::vector<StoppedJoint> held;
  if (any_jointed) {
    anchors = StopJointed();
    SortStopped();
    held = ListStopped(anchors);
  }
  for (Stop& stop : stopped) {
    Motion& motion = motions[stop.index];
    const Placement& from = awake[stop.index]->placement();
    stop.end_m = motion.position;
    stop.velocity_m_s = motion.velocity;
    motion.position = from.position + (motion.position - from.position) * stop.share;
    motion.orientation = Turned(from.orientation, Vec3d(motion.turned_rad) * stop.share);
    motion.turned_rad *= static_cast<float>(stop.share);
  }
  if (any_jointed) Rejoin(held, anchors.placed);
  CarryStopped();
  for (const Stop& stop : stopped) KeepTurning(stop);
  stopped.clear();
}

// Ascending by id, for the order in which bodies are listed is no part of a world's state; each once, where it is
// stopped first. What would have taken a body along that something else stops before is stopped by it like any other.
void World::Impl::SortStopped() {
  const auto key = [this](const Stop& stop) { return std::tuple(awake[stop.index]->id(), stop.share, stop.by->id()); };
  const auto before = [&](const Stop& a, const Stop& b) { return key(a) < key(b); };
  const auto same = [](const Stop& a, const Stop& b) { return a.index == b.index; };
  std::sort(stopped.begin(), stopped.end(), before);
  const std::size_t count = stopped.size();
  for (std::size_t i = 1; i < count; ++i) {
    const Stop stop = stopped[i];
    RigidBody* body = awake[stop.index];
    if (same(stopped[i - 1], stop) && Carries(*stop.by, *body)) {
      stopped.push_back({stop.by->awake_index, stop.share, body, {}, {}});
    }
  }
  if (stopped.size() > count) std::sort(stopped.begin(), stopped.end(), before);
  stopped.erase(std::unique(stopped.begin(), stopped.end(), same), stopped.end());
}

// The heaviest first, for what is carried may carry.
void World::Impl::CarryStopped() {
  struct Carried {
    const Stop* stop;
    Placement met;  // of what carries it, where they met
  };
  std::vector<Carried> carried;
  std::vector<double> shares;
  for (const Stop& stop : stopped) {
    if (!Carries(*stop.by, *awake[stop.index])) continue;
    if (shares.empty()) {
      shares.assign(awake.size(), 1.0);
      for (const Stop& any : stopped) shares[any.index] = any.share;
    }
    const double goes = shares[stop.by->awake_index];
    if (goes > stop.share)
      carried.push_back({&stop, WayOf(*stop.by).At(stop.share / goes)});  // else it never got there
  }
  const auto heavier = [](const Carried& a, const Carried& b) { return a.stop->by->mass_kg() > b.stop->by->mass_kg(); };
  std::stable_sort(carried.begin(), carried.end(), heavier);
  for (const auto& [stop, met] : carried) {
    const RigidBody& body = *awake[stop->index];
    const Motion& carrier = motions[stop->by->awake_index];
    const Quatd turn = carrier.orientation * Conjugate(met.orientation);
    Motion& motion = motions[stop->index];
    const Vec3d to = carrier.position + Rotate(turn, motion.position - met.position);
    const Way way{body.geometry(), motion.position, to, motion.orientation, RotationVectorOf(turn)};
    const Placement end = way.At(FreeShare(body, way));
    motion.position = end.position;
    motion.orientation = end.orientation;
  }
}

// How much of a way a body can go before it meets what does not move.
double World::Impl::FreeShare(const RigidBody& body, const Way& way) {
  candidates.clear();
  broad_phase.Overlapping(Passed(way), &candidates);
  double share = 1;
  for (const RigidBody* other : candidates) {
    if (other->awake() || other->trigger() || other->isolated || Jointed(body, *other)) continue;
    const bool low = body.id() < other->id();
    const Way still = WayOf(*other);
    const std::optional<Impact> impact = FirstImpact(low ? way : still, low ? still : way, kImpactDistance_m);
    if (impact) share = std::min(share, impact->fraction);
  }
  return share;
}

// A body that comes to lie elsewhere, and moves as if it had not, takes from the angular momentum of all. It and what
// it met get that back: they turn about each other by as much as one body of both would have to, but by no more than a
// share of the energy with which they move against each other. Nothing where the other holds still: that bears it.
// Nothing for jointed ones.
void World::Impl::KeepTurning(const Stop& stop) {
  constexpr double kMostEnergy = 0.1;
  RigidBody &one = *awake[stop.index], &other = *stop.by;
  if (!other.awake() || !one.joints.empty() || !other.joints.empty()) return;
  const bool one_is_low = one.id() < other.id();
  RigidBody &low = one_is_low ? one : other, &high = one_is_low ? other : one;
  Motion &a = motions[low.awake_index], &b = motions[high.awake_index];
  const Vec3d lacks = Cross(stop.end_m - motions[stop.index].position, Vec3d(stop.velocity_m_s)) * one.mass_kg();
  if (lacks == Vec3d()) return;
  const double mass = low.mass_kg() * high.mass_kg() / (low.mass_kg() + high.mass_kg());
  const Vec3d apart = b.position - a.position;
  const auto momentum = [&](Vec3d spin) {
    return SpinMomentum(low, a.orientation, spin) + SpinMomentum(high, b.orientation, spin) +
           Cross(apart, Cross(spin, apart)) * mass;
  };
  const Vec3d x = momentum({1, 0, 0}), y = momentum({0, 1, 0}), z = momentum({0, 0, 1});
  Vec3d spin = Vec3d{Dot(lacks, Cross(y, z)), Dot(x, Cross(lacks, z)), Dot(x, Cross(y, lacks))} / Dot(x, Cross(y, z));
  const double given = Dot(lacks, spin), most = kMostEnergy * mass * LengthSquared(Vec3d(b.velocity - a.velocity));
  if (given > most) spin *= std::sqrt(most / given);
  PairImpulse turning;
  turning.body_a = low.id();
  turning.body_b = high.id();
  turning.tag_a = low.tag;
  turning.tag_b = high.tag;
  turning.impulse_on_b = Vec3f(Cross(spin, apart) * mass);
  turning.angular_impulse_on_a = Vec3f(SpinMomentum(low, a.orientation, spin));
  turning.angular_impulse_on_b = Vec3f(SpinMomentum(high, b.orientation, spin));
  if (!IsFinite(turning.impulse_on_b) || !IsFinite(turning.angular_impulse_on_a) ||
      !IsFinite(turning.angular_impulse_on_b)) {
    return;
  }
  a.velocity -= turning.impulse_on_b / static_cast<float>(low.mass_kg());
  b.velocity += turning.impulse_on_b / static_cast<float>(high.mass_kg());
  a.angular_momentum += turning.angular_impulse_on_a;
  b.angular_momentum += turning.angular_impulse_on_b;
  turnings.push_back(turning);
}

// What hangs on a body that was stopped stops with it: a link that is held back alone tears its joints open.
World::Impl::Anchors World::Impl::StopJointed() {
  // The assemblies, and what is tied to nothing, each by itself.
  std::vector<std::uint32_t> group_of(awake.size());
  std::iota(group_of.begin(), group_of.end(), static_cast<std::uint32_t>(assemblies.all().size()));
  for (std::uint32_t i = 0; i < tied_bodies.size(); ++i) group_of[tied_bodies[i]] = assemblies.IndexOf(i);
  std::vector<const Stop*> first(assemblies.all().size() + awake.size(), nullptr);
  const auto sooner = [&](const Stop& a, const Stop& b) {
    return a.share != b.share ? a.share < b.share : awake[a.index]->id() < awake[b.index]->id();
  };
  for (const Stop& stop : stopped) {
    const Stop*& of_group = first[group_of[stop.index]];
    if (of_group == nullptr || sooner(stop, *of_group)) of_group = &stop;
  }
  std::vector<bool> hangs(first.size(), false);
  std::vector<std::uint32_t> spare(first.size(), 0);  // bodies less joints
  for (std::uint32_t i = 0; i < awake.size(); ++i) ++spare[group_of[i]];
  for (const Joint* joint : awake_joints) {
    --spare[group_of[(joint->a->awake() ? joint->a : joint->b)->awake_index]];
    for (const RigidBody* body : {joint->a, joint->b}) {
      const RigidBody* other = body == joint->a ? joint->b : joint->a;
      if (body != nullptr && body->awake() && (other == nullptr || !other->awake())) {
        hangs[group_of[body->awake_index]] = true;
      }
    }
  }
  Anchors anchors{std::vector<bool>(awake.size(), false), std::vector<bool>(awake.size(), false)};
  std::vector<Stop> all;
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    const std::uint32_t group = group_of[i];
    if (first[group] == nullptr) continue;
    all.push_back({i, first[group]->share, first[group]->by, {}, {}});
    anchors.placed[i] = first[group]->index == i && !hangs[group];
    anchors.ring[i] = spare[group] != (hangs[group] ? 0 : 1);
  }
  stopped = std::move(all);
  return anchors;
}

// Before any of them is moved back. Ascending by id.
std::vector<World::Impl::StoppedJoint> World::Impl::ListStopped(const Anchors& anchors) {
  std::vector<double> shares(awake.size(), 1.0);
  for (const Stop& stop : stopped) shares[stop.index] = stop.share;
  std::vector<StoppedJoint> held;
  for (std::size_t i = 0; i < awake_joints.size(); ++i) {
    const Joint& joint = *awake_joints[i];
    const JointRows& rows = joint_rows[i];
    RigidBody* a = joint.b != nullptr ? joint.a : nullptr;
    RigidBody* b = joint.b != nullptr ? joint.b : joint.a;
    const std::uint32_t one = (b->awake() ? b : a)->awake_index;
    const double share = shares[one];
    if (share == 1 || anchors.ring[one]) continue;
    StoppedJoint& stop = held.emplace_back();
    stop.arm_a = Vec3d(rows.arm_a);
    stop.arm_b = Vec3d(rows.arm_b);
    stop.anchor_b = b->placement().position + stop.arm_b;
    stop.anchor_a = a != nullptr ? a->placement().position + stop.arm_a : stop.arm_a;
    stop.start_gap_m = Vec3d(rows.gap);
    stop.share = share;
    if (a != nullptr && a->awake()) stop.a = a;
    if (b->awake()) stop.b = b;
    const Vec3d gap = stop.EndB(motions) - stop.EndA(motions);
    stop.end_gap_m =
        stop.a == nullptr ? gap : Rotate(Conjugate(TurnFrom(a->placement(), motions[a->awake_index].orientation)), gap);
  }
  return held;
}

// Bodies that turn go along arcs, and were moved back along their chords. From what holds still, or from the
// body that was stopped first, one after the other is put where its joint has it. Not so in a ring, or where several
// ends are held: all that was put right along the way would be missing where it closes, and a bridge tears there.
void World::Impl::Rejoin(std::span<const StoppedJoint> held, std::vector<bool>& placed) {
  const auto is_placed = [&](const RigidBody* body) { return body == nullptr || placed[body->awake_index]; };
  for (bool any = true; any;) {
    any = false;
    for (const StoppedJoint& joint : held) {
      if (is_placed(joint.a) == is_placed(joint.b)) continue;
      const Vec3d off = joint.EndA(motions) + joint.Gap(motions) - joint.EndB(motions);
      RigidBody& body = is_placed(joint.a) ? *joint.b : *joint.a;
      motions[body.awake_index].position += is_placed(joint.a) ? off : -off;
      placed[body.awake_index] = any = true;
    }
  }
}

}  // namespace tessera::physics

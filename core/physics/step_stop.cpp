// What a sweep stopped, and what is jointed to it, goes its way only up to there.
#include <algorithm>
#include <numeric>

#include "core/physics/motion/turn.h"
#include "core/physics/world_impl.h"

namespace tessera::physics {
namespace {

// By how much a body that lay as `from` has been turned, once it lies as `to`.
Quatd TurnFrom(const Placement& from, Quatd to) { return to * Conjugate(from.orientation); }

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

void World::Impl::MoveStopped() {
  const auto has_joints = [&](const auto& stop) { return !awake[stop.first]->joints.empty(); };
  const bool any_jointed = std::any_of(stopped.begin(), stopped.end(), has_joints);
  Anchors anchors;
  std::vector<StoppedJoint> held;
  if (any_jointed) {
    anchors = StopJointed();
    held = ListStopped(anchors);
  }
  for (const auto& [index, share] : stopped) {
    Motion& motion = motions[index];
    const Placement& from = awake[index]->placement();
    motion.position = from.position + (motion.position - from.position) * share;
    motion.orientation = Turned(from.orientation, Vec3d(motion.turned_rad) * share);
  }
  if (any_jointed) Rejoin(held, anchors.placed);
  stopped.clear();
}

// What hangs on a body that was stopped stops with it: a link that is held back alone tears its joints open.
World::Impl::Anchors World::Impl::StopJointed() {
  // The assemblies, and what is tied to nothing, each by itself.
  std::vector<std::uint32_t> group_of(awake.size());
  std::iota(group_of.begin(), group_of.end(), static_cast<std::uint32_t>(assemblies.all().size()));
  for (std::uint32_t i = 0; i < tied_bodies.size(); ++i) group_of[tied_bodies[i]] = assemblies.IndexOf(i);
  std::vector<double> shares(assemblies.all().size() + awake.size(), 1.0);
  std::vector<RigidBody*> first(shares.size(), nullptr);
  for (const auto& [index, share] : stopped) {
    const std::uint32_t group = group_of[index];
    RigidBody* body = awake[index];
    if (share > shares[group] || (share == shares[group] && first[group] != nullptr && first[group]->id() < body->id()))
      continue;
    shares[group] = share;
    first[group] = body;
  }
  std::vector<bool> hangs(shares.size(), false);
  std::vector<std::uint32_t> spare(shares.size(), 0);  // bodies less joints
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
  stopped.clear();
  for (std::uint32_t i = 0; i < awake.size(); ++i) {
    const std::uint32_t group = group_of[i];
    if (first[group] == nullptr) continue;
    stopped.emplace_back(i, shares[group]);
    anchors.placed[i] = first[group] == awake[i] && !hangs[group];
    anchors.ring[i] = spare[group] != (hangs[group] ? 0 : 1);
  }
  return anchors;
}

// Before any of them is moved back. Ascending by id.
std::vector<World::Impl::StoppedJoint> World::Impl::ListStopped(const Anchors& anchors) {
  std::vector<double> shares(awake.size(), 1.0);
  for (const auto& [index, share] : stopped) shares[index] = share;
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

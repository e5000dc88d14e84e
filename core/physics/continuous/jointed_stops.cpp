#include "core/physics/continuous/jointed_stops.h"

#include <numeric>

namespace tessera::physics {
namespace {

// The turn that takes a body from where it lies as `from` to where it lies as `to`.
Quatd TurnFrom(const Placement& from, Quatd to) { return to * Conjugate(from.orientation); }

Vec3d EndOf(const RigidBody& body, std::span<const BodyMotion> motions, Vec3d arm) {
  const BodyMotion& motion = motions[body.awake_index];
  return motion.position + Rotate(TurnFrom(body.placement(), motion.orientation), arm);
}

}  // namespace

Vec3d JointedStops::StoppedJoint::EndA(std::span<const BodyMotion> motions) const {
  return a != nullptr ? EndOf(*a, motions, arm_a) : anchor_a;
}

Vec3d JointedStops::StoppedJoint::EndB(std::span<const BodyMotion> motions) const {
  return b != nullptr ? EndOf(*b, motions, arm_b) : anchor_b;
}

Vec3d JointedStops::StoppedJoint::Gap(std::span<const BodyMotion> motions) const {
  const Vec3d gap = start_gap_m * (1 - share) + end_gap_m * share;
  return a != nullptr ? Rotate(TurnFrom(a->placement(), motions[a->awake_index].orientation), gap) : gap;
}

// The jointed groups, and after them each awake body as a group of its own.
struct JointedStops::Groups {
  std::vector<std::uint32_t> of;     // by awake_index
  std::vector<const Stop*> first;    // by group: the first stop of its bodies, or null
  std::vector<bool> hangs;           // by group: a joint holds it to something that does not move
  std::vector<std::uint32_t> spare;  // by group: bodies less joints
};

JointedStops::Groups JointedStops::FirstStops(std::span<const Stop> stops) const {
  Groups groups;
  const std::size_t count = groups_.count();
  groups.of.resize(awake_.size());
  std::iota(groups.of.begin(), groups.of.end(), static_cast<std::uint32_t>(count));
  for (std::size_t i = 0; i < groups_.bodies().size(); ++i) groups.of[groups_.bodies()[i]] = groups_.GroupOf(i);
  groups.first.resize(count + awake_.size(), nullptr);
  const auto sooner = [this](const Stop& a, const Stop& b) {
    return a.share != b.share ? a.share < b.share : awake_[a.index]->id() < awake_[b.index]->id();
  };
  for (const Stop& stop : stops) {
    const Stop*& first = groups.first[groups.of[stop.index]];
    if (first == nullptr || sooner(stop, *first)) first = &stop;
  }
  groups.hangs.resize(groups.first.size(), false);
  groups.spare.resize(groups.first.size(), 0);
  for (std::uint32_t i = 0; i < awake_.size(); ++i) ++groups.spare[groups.of[i]];
  for (const Joint* joint : joints_.joints()) {
    const std::uint32_t group = groups.of[joint->AwakeBody().awake_index];
    --groups.spare[group];
    if (!joint->ConnectsAwakeBodies()) groups.hangs[group] = true;
  }
  return groups;
}

void JointedStops::Spread(std::vector<Stop>* stops) {
  const Groups groups = FirstStops(*stops);
  placed_.assign(awake_.size(), false);
  ring_.assign(awake_.size(), false);
  std::vector<Stop> all;
  for (std::uint32_t i = 0; i < awake_.size(); ++i) {
    const std::uint32_t group = groups.of[i];
    const Stop* first = groups.first[group];
    if (first == nullptr) continue;
    all.push_back({i, first->share, first->by});
    placed_[i] = first->index == i && !groups.hangs[group];
    ring_[i] = groups.spare[group] != (groups.hangs[group] ? 0 : 1);
  }
  *stops = std::move(all);
}

void JointedStops::NoteGaps(std::span<const Stop> stops, std::span<const BodyMotion> motions) {
  std::vector<double> shares(awake_.size(), 1.0);
  for (const Stop& stop : stops) shares[stop.index] = stop.share;
  held_.clear();
  for (std::size_t i = 0; i < joints_.joints().size(); ++i) {
    const Joint& joint = *joints_.joints()[i];
    const JointRows& rows = joints_.rows()[i];
    RigidBody* a = joint.b != nullptr ? joint.a : nullptr;
    RigidBody* b = joint.b != nullptr ? joint.b : joint.a;
    const std::uint32_t one = (b->awake() ? b : a)->awake_index;
    const double share = shares[one];
    if (share == 1 || ring_[one]) continue;
    StoppedJoint& held = held_.emplace_back();
    held.arm_a = Vec3d(rows.arm_a);
    held.arm_b = Vec3d(rows.arm_b);
    held.anchor_b = b->placement().position + held.arm_b;
    held.anchor_a = a != nullptr ? a->placement().position + held.arm_a : held.arm_a;
    held.start_gap_m = Vec3d(rows.gap);
    held.share = share;
    if (a != nullptr && a->awake()) held.a = a;
    if (b->awake()) held.b = b;
    const Vec3d gap = held.EndB(motions) - held.EndA(motions);
    held.end_gap_m =
        held.a == nullptr ? gap : Rotate(Conjugate(TurnFrom(a->placement(), motions[a->awake_index].orientation)), gap);
  }
}

// Bodies in a ring, or of which several ends are held, stay where they are: all that was put right along the way would
// be missing where the ring closes, and a bridge tears there.
void JointedStops::Rejoin(std::span<BodyMotion> motions) {
  const auto is_placed = [this](const RigidBody* body) { return body == nullptr || placed_[body->awake_index]; };
  for (bool any = true; any;) {
    any = false;
    for (const StoppedJoint& joint : held_) {
      if (is_placed(joint.a) == is_placed(joint.b)) continue;
      const Vec3d off = joint.EndA(motions) + joint.Gap(motions) - joint.EndB(motions);
      RigidBody& body = is_placed(joint.a) ? *joint.b : *joint.a;
      motions[body.awake_index].position += is_placed(joint.a) ? off : -off;
      placed_[body.awake_index] = any = true;
    }
  }
}

}  // namespace tessera::physics

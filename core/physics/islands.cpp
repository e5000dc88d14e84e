#include "core/physics/islands.h"

#include <algorithm>

namespace tessera::physics {

void Islands::Reset(std::size_t bodies) {
  parent_.resize(bodies);
  for (std::size_t i = 0; i < bodies; ++i) parent_[i] = static_cast<std::uint32_t>(i);
}

std::uint32_t Islands::Root(std::uint32_t node) {
  while (parent_[node] != node) {
    parent_[node] = parent_[parent_[node]];
    node = parent_[node];
  }
  return node;
}

void Islands::Unite(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t x = Root(a), y = Root(b);
  parent_[std::max(x, y)] = std::min(x, y);
}

// A root has the lowest number of its island, so it comes first.
void Islands::Number() {
  island_.resize(parent_.size());
  count_ = 0;
  for (std::uint32_t i = 0; i < parent_.size(); ++i) {
    const std::uint32_t root = Root(i);
    island_[i] = root == i ? count_++ : island_[root];
  }
}

void BuildIslands(std::size_t awake, std::span<const ActiveContact> contacts, std::span<Joint* const> joints,
                  Islands* islands) {
  islands->Reset(awake);
  for (const ActiveContact& contact : contacts) {
    if (contact.responds && contact.both()) islands->Unite(contact.low, contact.high);
  }
  for (const Joint* joint : joints) {
    if (joint->ConnectsAwakeBodies()) islands->Unite(joint->a->awake_index, joint->b->awake_index);
  }
  islands->Number();
}

bool Validate(const Islands& islands, std::span<const ActiveContact> contacts, std::span<Joint* const> joints) {
  std::uint32_t seen = 0;
  for (std::uint32_t i = 0; i < islands.bodies(); ++i) {
    if (islands.IndexOf(i) > seen) return false;
    if (islands.IndexOf(i) == seen) ++seen;
  }
  if (seen != islands.count()) return false;
  const auto together = [&](std::uint32_t a, std::uint32_t b) { return islands.IndexOf(a) == islands.IndexOf(b); };
  return std::all_of(contacts.begin(), contacts.end(),
                     [&](const ActiveContact& contact) {
                       return !contact.responds || !contact.both() || together(contact.low, contact.high);
                     }) &&
         std::all_of(joints.begin(), joints.end(), [&](const Joint* joint) {
           return !joint->ConnectsAwakeBodies() || together(joint->a->awake_index, joint->b->awake_index);
         });
}

void JointedGroups::Run(std::span<Joint* const> joints) {
  bodies_.clear();
  for (const Joint* joint : joints) {
    if (!joint->ConnectsAwakeBodies()) continue;
    bodies_.insert(bodies_.end(), {joint->a->awake_index, joint->b->awake_index});
  }
  std::sort(bodies_.begin(), bodies_.end());
  bodies_.erase(std::unique(bodies_.begin(), bodies_.end()), bodies_.end());
  groups_.Reset(bodies_.size());
  for (const Joint* joint : joints) {
    if (joint->ConnectsAwakeBodies()) groups_.Unite(PlaceOf(*joint->a), PlaceOf(*joint->b));
  }
  groups_.Number();
}

bool JointedGroups::Validate(std::span<Joint* const> joints) const {
  if (groups_.bodies() != bodies_.size() || !std::is_sorted(bodies_.begin(), bodies_.end())) return false;
  std::vector<char> held(bodies_.size());
  for (const Joint* joint : joints) {
    if (!joint->ConnectsAwakeBodies()) continue;
    const std::uint32_t a = PlaceOf(*joint->a), b = PlaceOf(*joint->b);
    if (a >= bodies_.size() || bodies_[a] != joint->a->awake_index) return false;
    if (b >= bodies_.size() || bodies_[b] != joint->b->awake_index) return false;
    if (GroupOf(a) != GroupOf(b)) return false;
    held[a] = held[b] = 1;
  }
  return std::all_of(held.begin(), held.end(), [](char is_held) { return is_held != 0; });
}

std::uint32_t JointedGroups::PlaceOf(const RigidBody& body) const {
  const auto at = std::lower_bound(bodies_.begin(), bodies_.end(), body.awake_index);
  return static_cast<std::uint32_t>(at - bodies_.begin());
}

}  // namespace tessera::physics

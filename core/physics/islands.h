// Islands: awake bodies that act on each other through contacts and joints. Bodies of different islands cannot feel
// each other's solving; an island sleeps as a whole.
//
//   Islands islands;
//   islands.Reset(3);
//   islands.Unite(0, 2);
//   islands.Number();
//   islands.IndexOf(2);   // 0, like that of body 0; body 1 is island 1
//
// Thread rule: one thread at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/joint.h"

namespace tessera::physics {

// Disjoint sets of bodies, which are named by consecutive numbers.
class Islands {
 public:
  // Makes each of so many bodies an island.
  void Reset(std::size_t bodies);
  void Unite(std::uint32_t a, std::uint32_t b);
  // Numbers the islands by their first bodies, after the last `Unite`.
  void Number();

  std::uint32_t IndexOf(std::uint32_t body) const { return island_[body]; }
  std::size_t count() const { return count_; }
  std::size_t bodies() const { return island_.size(); }

 private:
  std::uint32_t Root(std::uint32_t node);

  std::vector<std::uint32_t> parent_, island_;
  std::uint32_t count_ = 0;
};

// The pass: islands of so many awake bodies, which are named by awake_index.
void BuildIslands(std::size_t awake, std::span<const ActiveContact> contacts, std::span<Joint* const> joints,
                  Islands* islands);
// Whether these are the islands of such contacts and joints: what acts on each other is in one, and islands are
// numbered by their first bodies. For assertions; linear.
bool Validate(const Islands& islands, std::span<const ActiveContact> contacts, std::span<Joint* const> joints);

// JointedGroups: awake bodies that joints connect, directly or through others. Such a group is pushed as one, and stops
// as one.
class JointedGroups {
 public:
  void Run(std::span<Joint* const> joints);

  std::span<const std::uint32_t> bodies() const { return bodies_; }  // awake_index of those in a group, ascending
  // Group of bodies()[i].
  std::uint32_t GroupOf(std::size_t i) const { return groups_.IndexOf(static_cast<std::uint32_t>(i)); }
  std::size_t count() const { return bodies_.empty() ? 0 : groups_.count(); }

  // Whether these are the groups of such joints: they hold exactly the awake bodies that joints connect, and both
  // bodies of a joint are in one group. For assertions.
  bool Validate(std::span<Joint* const> joints) const;

 private:
  std::uint32_t PlaceOf(const RigidBody& body) const;

  std::vector<std::uint32_t> bodies_;
  Islands groups_;
};

}  // namespace tessera::physics

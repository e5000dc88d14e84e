// ContactBlocks: the contacts of a batch, in the memory that the kernels work on, sorted by color and kind.
//
// Thread rule: one thread at a time, which may lead a team. Bodies that stand for the world are written too, though
// only with the zeros that they hold; so each thread of the team has one of its own.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/solve/coloring.h"
#include "core/physics/solve/kernel.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

// A run of blocks of one color and kind.
struct ContactRun {
  std::uint8_t kind = 0, color = 0;
  bool bounces = false;  // its contacts have restitution
  std::uint32_t blocks = 0;
  std::uint32_t before = 0;  // blocks of the same color in the runs before this one
  std::size_t offset = 0;    // from the first block of all, in `Lanes`
};

// Runs that are solved at the same time: all of one color, or a single contact that is left over.
struct ContactStage {
  std::uint32_t first = 0, runs = 0;
  std::uint32_t blocks = 0;
};

// Number of blocks that a thread takes at a time. A block takes half a microsecond or so to solve, and to hand out a
// loop as long: fewer are not worth it.
inline constexpr std::size_t kChunkBlocks = 4;

// A soft constraint in the form of Catto, "Soft Constraints", 2011: shares of mass and of impulse, and velocity per
// depth.
struct Softness {
  float mass = 1, impulse = 0, bias_rate = 0;
};
// `share` is the frequency over the substep rate 1 / h.
Softness SoftnessOf(float share, float damping_ratio, float h);

// The place of a contact in the blocks.
struct ContactPlace {
  std::uint8_t kind = 0, lane = 0;
  bool bounces = false;
  std::uint8_t thread = 0;  // that works on its block
  std::size_t offset = 0;   // where its block begins, in `Lanes`
};

// Calls `f` with a null pointer to a block of this kind.
template <class Function>
auto ForKind(int kind, Function&& f) {
  switch (kind) {
    case 0:
      return f(static_cast<ContactBlock<1, Tangent::kNone>*>(nullptr));
    case 1:
      return f(static_cast<ContactBlock<2, Tangent::kNone>*>(nullptr));
    case 2:
      return f(static_cast<ContactBlock<4, Tangent::kNone>*>(nullptr));
    case 3:
      return f(static_cast<ContactBlock<1, Tangent::kFriction>*>(nullptr));
    case 4:
      return f(static_cast<ContactBlock<2, Tangent::kFriction>*>(nullptr));
    case 5:
      return f(static_cast<ContactBlock<4, Tangent::kFriction>*>(nullptr));
    case 6:
      return f(static_cast<ContactBlock<1, Tangent::kRolling>*>(nullptr));
    case 7:
      return f(static_cast<ContactBlock<2, Tangent::kRolling>*>(nullptr));
    default:
      return f(static_cast<ContactBlock<4, Tangent::kRolling>*>(nullptr));
  }
}

class ContactBlocks {
 public:
  // `nobody`: index of the body that stands for the world, and of the first of them, one for each thread.
  void Fill(std::span<const ContactConstraint> contacts, const Coloring& coloring, std::uint32_t nobody, float h,
            ThreadTeam& team);
  // Writes impulses and totals to the manifolds, and corrects the motion of bodies for impulses that acted where the
  // contacts were at the start of the step.
  void Store(std::span<const ContactConstraint> contacts, std::span<SolvedState> states,
             std::span<const SolvedMass> masses, ThreadTeam& team);

  std::span<const ContactRun> runs() const { return runs_; }        // by color; contacts that are left over come last
  std::span<const ContactStage> stages() const { return stages_; }  // in the same order
  std::span<const ContactRun> RunsOf(const ContactStage& stage) const {
    return runs().subspan(stage.first, stage.runs);
  }
  void* BlocksOf(const ContactRun& run, std::size_t first = 0) { return &memory_[OffsetOf(run, first)]; }
  // Where block number `block` of a run begins, as in ContactPlace.
  static std::size_t OffsetOf(const ContactRun& run, std::size_t block) {
    return run.offset + block * kLanesOfKind[run.kind];
  }
  const ContactPlace& PlaceOf(std::size_t contact) const { return places_[contact]; }
  std::size_t lanes() const { return memory_.size(); }  // no block begins beyond

  // Calls `f` with the block.
  template <class Function>
  void Visit(const ContactPlace& place, Function&& f) {
    ForKind(place.kind,
            [&](auto* type) { f(*static_cast<decltype(type)>(static_cast<void*>(&memory_[place.offset]))); });
  }
  // Block number `block` of a run.
  template <class Function>
  void Visit(const ContactRun& run, std::size_t block, Function&& f) {
    ForKind(run.kind, [&](auto* type) { f(static_cast<decltype(type)>(BlocksOf(run))[block]); });
  }

 private:
  // Size of a block of each kind, in `Lanes`.
  static const std::array<std::size_t, kContactKinds> kLanesOfKind;

  // Where the contacts of one color, kind and sort begin.
  struct Start {
    std::size_t offset = 0;
    std::uint32_t before = 0;  // as in ContactRun
  };
  // Turning that a contact takes back in the end, N m s.
  struct Correction {
    Vec3f on_a, on_b;
  };

  void Lay(std::span<const ContactConstraint> contacts, const Coloring& coloring, const ThreadTeam& team);
  void AddRun(const ContactRun& run);
  void DeflectAll(std::span<const ContactConstraint> contacts, std::span<SolvedState> states,
                  std::span<const SolvedMass> masses);

  std::vector<Lanes> memory_;
  std::vector<ContactRun> runs_;
  std::vector<ContactPlace> places_;   // by contact
  std::vector<std::uint32_t> counts_;  // contacts by bucket: color, restitution or not, kind
  std::vector<Start> starts_;
  std::vector<ContactStage> stages_;
  std::vector<Correction> corrections_;  // by contact
};

}  // namespace tessera::physics

// Report: which pairs began or ceased to touch in a step, and what contacts did to bodies.
//
// Events are made in each step. Contacts and impulses are computed only when somebody asks for them: most steps nobody
// does.
//
// Thread rule: one thread at a time, which leads the team.
#pragma once

#include <absl/functional/function_ref.h>

#include <cstdint>
#include <span>
#include <vector>

#include "core/physics/active_contact.h"
#include "core/physics/body_store.h"
#include "core/physics/contact_report.h"
#include "core/physics/pair_table.h"
#include "core/physics/thread_team.h"

namespace tessera::physics {

// The contact of a pair in the last step: points are where they were at its start. Without points it has the middle of
// `low` as its place, and no normal.
Contact ContactOf(const Pair& pair);

// The outcome of a step as far as it is reported. Contacts whose pairs have ended since are left out.
struct StepOutcome {
  std::span<const ActiveContact> contacts;     // ascending by ids
  std::span<Pair* const> parting;              // pairs that touched, and have no manifold any more
  std::span<Pair* const> crossed;              // pairs with a trigger that met within the step, each once or more
  std::span<const PairImpulse> stop_impulses;  // that bodies got because one was stopped at the other
};

class Report {
 public:
  explicit Report(ThreadTeam& team = ThreadTeam::Alone()) : team_(team) {}

  // The pass: writes what pairs remember of the step, and makes its events, together with those of pairs that have
  // ended since the last step.
  void Run(const StepOutcome& outcome, PairTable& pairs);
  // A step in which nothing was awake and no pair ended.
  void RunIdle();

  // Ascending by ids.
  std::span<const PairEvent> events() const { return events_; }
  // Contacts of the step. `outcome` is that of the last `Run`; computed when it is first asked for.
  std::span<const Contact> Contacts(const StepOutcome& outcome, const BodyStore& bodies);
  // Impulses of the pairs whose two bodies have both bits of 3 between them, by what `bits` has at their tags.
  std::span<const PairImpulse> ImpulsesOf(std::span<const std::uint8_t> bits, const StepOutcome& outcome,
                                          const BodyStore& bodies);

  // Each pair began or ended to touch at most once. For assertions; linear in events.
  bool Validate() const;

 private:
  void NoteContacts(std::span<const ActiveContact> contacts, absl::FunctionRef<bool(Pair*)> crossed);
  static void Note(Pair& pair, bool crossed, std::vector<PairEvent>* events);

  ThreadTeam& team_;
  std::vector<std::vector<PairEvent>> noted_;  // by chunk of contacts
  std::vector<PairEvent> events_;
  std::vector<Pair*> crossed_;  // ascending by address, each once
  std::vector<Contact> contacts_;
  bool contacts_known_ = true;
  std::vector<PairImpulse> impulses_;
};

}  // namespace tessera::physics

// The other side of RunAttacks: one attacker, a process of its own.
//
// It stands for another machine: it is scheduled only where the control plane and its operator leave a processor
// (SCHED_IDLE), so what they wait for is what the attack costs the control plane, not what it costs the attacker. Its
// standard output says what came of it: "tries NUMBER", and "through WHAT" for each that should have been refused.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/attacks.h"

namespace tessera::bench {

struct AttackSize {
  std::uint32_t import_mb = 0, lease_requests = 0, join_threads = 0, joins_each = 0;
};

struct AttackSeat {
  std::string name;  // as AttackNames has it
  support::Target target;
  std::string world;
  AttackSize size;
};

// In the order in which the suite makes them.
std::vector<std::string> AttackNames();
// This program's command line for it.
std::vector<std::string> AttackCommand(const AttackSeat& seat);

// Attacks again and again until SIGTERM, when the attack that is under way comes to its end; once, where an attack
// leaves hosts behind. Exit status: 0.
int AttackFromSeat(const AttackSeat& seat);

// As the attacker's output says.
support::Outcome ReadOutcome(const std::string& said);

}  // namespace tessera::bench

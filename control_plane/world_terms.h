// The terms of an instance's world, as its record has them: paused or not, how fast, and which game. Pure: a record in,
// the next record out.
//
// The wanted terms are stored first. A difference from those in force is a planned map that changes nothing but its
// terms, and goes the way of all planned maps (change.h). The end of a pause needs no map: see
// region_worker/core/world_clock.h.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "control_plane/control_records.pb.h"

namespace tessera::control {

// In force. A pause that is over is none.
v1::WorldTerms TermsOf(const records::Instance& record);
bool IsPaused(const records::Instance& record);
// Ticks a second that the world is to make; 0 while it is paused.
double PaceOf(const records::Instance& record);

// The next step towards what is wanted, of a record without a failover or a plan; nothing if it is as wanted, or must
// wait. `game_loaded`: all workers have loaded the game that is to take the place of the one that runs.
std::optional<records::Instance> StepTerms(const records::Instance& record, bool game_loaded);

// The most ticks of one step: ten minutes of a usual world.
inline constexpr std::uint32_t kMaxStepTicks = 36'000;
// A plan for a paused world, all regions of which stand after `tick`: to make so many ticks and stand again. It is the
// map of the next pause. Once all know of it, it is committed and the present pause ends, in one order, so that it
// needs no lead (change.h).
records::Instance PlanTicks(const records::Instance& record, std::uint64_t tick, std::uint32_t ticks);
// The wish that the world goes on forgets a step that nobody makes yet.
void ForgetStep(records::Instance& next);

// Writes terms into a message; those of a world that nobody has changed take no bytes.
void SetTerms(const v1::WorldTerms& terms, v1::PartitionMap& map);

// `map` is about to come into force in `next`, from `tick` on: where it changes the game, the record names that one.
void AdoptTerms(const v1::PartitionMap& map, std::uint64_t tick, records::Instance& next);

// The game with which the world goes on after `tick`.
struct GameName {
  std::string name, hash;
  std::uint32_t number = 0;
};
GameName GameAfter(const records::Instance& record, std::uint64_t tick);

// How `next` differs from `before`, for an event: "paused after tick 700"; empty if it does not.
std::string DescribeTerms(const records::Instance& before, const records::Instance& next, std::uint64_t tick);

}  // namespace tessera::control

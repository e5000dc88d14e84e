// Deaths of workers in the code of their world's native game, as the world's record counts them. Pure: a record in, the
// next record out.
//
// A game that crashes its worker would otherwise go through all hosts: each death is carried on by another worker,
// which comes to the same callback. kMaxGameDeaths in a row, without kGameDeathForgiven of steps in between, end the
// world with the reason. Steps count, not time: a world that stands still proves nothing.
#pragma once

#include <cstdint>
#include <optional>

#include "control_plane/control_records.pb.h"
#include "control_plane/now.h"

namespace tessera::control {

// The record with this death counted; nothing if it is none in the game, if it was counted before, or if the worker was
// not placed on this host. `newest_tick`: that any worker of the world has reported.
std::optional<records::Instance> CountGameDeath(const records::Instance& record, std::uint64_t newest_tick,
                                                const records::Host& host, const v1::WorkerExited& exited);

// FAILED, if workers of a RUNNING world died too often in its game.
std::optional<records::Instance> FailedByGame(const records::Instance& record, Now now);

// The world goes back to `tick`, from which its steps count anew. One that had ended begins without deaths: an operator
// has decided that it shall go on.
void FollowRestore(const records::Instance& before, std::uint64_t tick, records::Instance& next);

}  // namespace tessera::control

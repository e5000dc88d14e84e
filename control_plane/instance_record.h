// Steps of an instance's stored record that several parts take. Pure: a record in, the next record out.
#pragma once

#include <string>

#include "control_plane/control_records.pb.h"
#include "control_plane/instance_plan.h"
#include "control_plane/now.h"
#include "control_plane/placement.h"
#include "control_plane/players.h"
#include "core/world/ids.h"
#include "core/world/partition_map.h"

namespace tessera::control {

// The record of a new instance, without its id and key.
records::Instance NewInstance(const InstancePlan& plan, const PlacementPlan& placed, Now now);

// New workers for all regions, placed as planned, under the plan's map.
records::Instance PlacedAnew(const records::Instance& record, const PlacementPlan& placed);

// The same, starting from a checkpoint, under a new map version and without a change or failover under way.
records::Instance RestoredFrom(const records::Instance& record, const records::Manifest& manifest,
                               const PlacementPlan& placed);

// FAILED, without a change or failover under way.
records::Instance Failed(const records::Instance& record, const std::string& why, Now now);

// Appends an event and drops the oldest beyond kMaxEvents.
void AddEvent(records::Instance& record, Now now, const std::string& text);

// Whether there may be such a body: a dynamic one of the scene, one of a player who has not left, or one that was made.
bool HasBody(const records::Instance& record, const Players& players, BodyId body);

// Threads that work on a step of each of its regions, 1 to region::kMaxRegionThreads.
std::uint32_t RegionThreadsOf(const records::Instance& record);

// So many play in it at one time.
std::uint32_t MaxPlayersOf(const records::Instance& record);

// The region that has the player's spawn point. Requires a spawn point.
std::uint32_t SpawnRegionOf(std::uint32_t player, const records::Instance& record, const PartitionMap& map);

}  // namespace tessera::control

// RegionParts: the parts of a region, each with its own data, and how they are connected. Behind Region: tick.cpp has
// the order in which a tick puts them to work, region_begin.h, region_map.h and region_failover.cpp the rest.
#pragma once

#include "core/region/blast_table.h"
#include "core/region/bodies.h"
#include "core/region/border_loads.h"
#include "core/region/borders.h"
#include "core/region/catalog.h"
#include "core/region/failover.h"
#include "core/region/forces.h"
#include "core/region/grants_in.h"
#include "core/region/grants_out.h"
#include "core/region/impulse_exchange.h"
#include "core/region/map_change.h"
#include "core/region/message_relay.h"
#include "core/region/neighborhood.h"
#include "core/region/outgoing.h"
#include "core/region/output_commit.h"
#include "core/region/ownership.h"
#include "core/region/pair_reports.h"
#include "core/region/question_desk.h"
#include "core/region/record_table.h"
#include "core/region/region.h"
#include "core/region/region_game.h"
#include "core/region/region_players.h"
#include "core/region/relevance.h"
#include "core/region/shared_properties.h"
#include "core/region/tick_log.h"
#include "core/region/tombstones.h"

namespace tessera::region {

struct RegionParts {
  explicit RegionParts(const Config& config);

  RegionId self() const { return neighborhood.self(); }
  const Scene& scene() const { return catalog.scene(); }

  const Incarnation incarnation;
  const RegionSettings settings;
  const double tick_s;
  const Catalog catalog;

  Tick tick;  // after the last step; written by Step, by Resume and by the constructor of Region
  Neighborhood neighborhood;
  MapChange map_change;
  Failover failover;

  Bodies bodies;
  RegionPlayers players;
  PairReports reports;
  RecordTable records;
  Tombstones tombstones;
  OutputCommit output;
  SharedProperties shared;
  BlastTable blasts;    // changes records
  Ownership ownership;  // writes bodies, players, reports and records, and forgets output and shared
  QuestionDesk questions;
  // Changes records and, through the ownership, what is owned; notes it in tombstones, output and shared.
  RegionGame game;

  Borders borders;
  OutgoingMessages outgoing;
  GrantsOut grants_out;
  GrantsIn grants_in;
  ImpulseExchange exchange;
  BorderLoads loads;
  BodyForces forces;
  Relevance relevance;
  bool inland = false;  // nothing here can concern a neighbour soon; written by FindInland
  TickLog log;
  MessageRelay messages;  // changes records and, where a removed body is done, what is owned
};

// All that carries the region on, as it is now.
RegionState StateOf(const RegionParts& parts);

// Asserts what the parts promise, each by itself, at the end of a tick. Does nothing in builds without assertions.
void Validate(const RegionParts& parts);

}  // namespace tessera::region

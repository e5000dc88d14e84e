// Operations: what is done to an instance, from the request or the death that begins it to its end, under one id that
// stands in the logs of control plane, agents and workers (op=) and with the instance's events.
//
// An operation begins with a wish that is stored (another number of regions, a pause, a game, an upgrade, an end), with
// a failover, with a restore, or with a change that nobody asked for, such as balancing. What follows from it belongs
// to it: the maps that carry a wish out, and the worker that takes the place of one that died. One that begins
// meanwhile takes its place. Pure.
//
//   NamedRecord named = NameOperation(before, next, "12-7");
//   if (named.begins) ...                                    // the id is used up
//
// Thread rule: free functions on values.
#pragma once

#include <string>
#include <vector>

#include "control_plane/control_records.pb.h"

namespace tessera::control {

struct NamedRecord {
  records::Instance record;        // with its operation, and that of each new event
  bool begins = false;             // an operation, under the id that was given
  std::vector<std::string> lines;  // the new events, for the log
};
NamedRecord NameOperation(const records::Instance& before, const records::Instance& next, const std::string& id);

// True if `next`, the record after `before`, begins an operation.
bool BeginsOperation(const records::Instance& before, const records::Instance& next);

}  // namespace tessera::control

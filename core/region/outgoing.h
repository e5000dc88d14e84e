// OutgoingMessages: what waits for the next frame to each neighbour beside its ghosts, impulses and acknowledgements.
//
// Promise: messages of a kind leave in the order in which they were added. What is for a region that is no neighbour is
// dropped. Thread rule: one thread at a time.
#pragma once

#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/region/frame.h"

namespace tessera::region {

class OutgoingMessages {
 public:
  explicit OutgoingMessages(std::span<const RegionId> neighbors) { SetNeighbors(neighbors, true); }

  // Another map is in force: messages to neighbours that stay are kept, unless `anew`.
  void SetNeighbors(std::span<const RegionId> neighbors, bool anew);

  void Add(RegionId to, Grant grant);
  void Add(RegionId to, const LateCorrection& late);
  // An input that reached the granter after it had sent the grant.
  void Add(RegionId to, const PlayerInput& input);
  // A packet of the messages of game code.
  void Add(RegionId to, MessagePacket packet);
  // These grants instead of all that wait for a neighbour.
  void ReplaceGrants(RegionId to, std::vector<Grant> grants);
  // Moves everything that waits for a neighbour into the frame; of packets as many as a frame may have.
  void MoveTo(RegionId to, BorderFrame& frame);

  void Validate(std::span<const RegionId> neighbors) const;

 private:
  struct Messages {
    std::vector<Grant> grants;
    std::vector<LateCorrection> late_corrections;
    std::vector<PlayerInput> inputs;
    std::vector<MessagePacket> packets;
  };
  std::map<RegionId, Messages> by_neighbor_;
};

}  // namespace tessera::region

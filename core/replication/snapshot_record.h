// Records: the entries of a snapshot, one for each body that changed and one for each that is there no more.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/world/body_tuning.h"
#include "core/world/ids.h"
#include "core/world/scene.h"

namespace tessera::replication {

using Bytes = std::vector<std::uint8_t>;

// The marks that a game leaves on a body, which a client has to know beside its state. They change seldom.
struct BodyTraits {
  std::uint8_t jumps = 0;  // how often it was put elsewhere; after 255 comes 0. Between two counts it did not move
  BodyTuning tuning;
  bool empty() const { return jumps == 0 && tuning.empty(); }
  friend bool operator==(const BodyTraits&, const BodyTraits&) = default;
};

struct BodyRecord {
  BodyId id;
  Epoch epoch;  // the epoch of its ownership
  BodyState state;
  // PropertySet::Encode of the properties that differ from the scene's. Pushed: null where none does. Received: null
  // where the datagram has no newer ones.
  std::shared_ptr<const Bytes> properties = nullptr;
  BodyTraits traits = {};
  // Pushed, of a player's body: those for that player, where they are others; null: the same.
  std::shared_ptr<const Bytes> own_properties = nullptr;
  // Pushed: who may see the body, and which team it is in. Those for the players of its team, where they are others;
  // null: the same.
  Visibility visible_to = Visibility::kEveryone;
  TeamId team = 0;
  std::shared_ptr<const Bytes> team_properties = nullptr;
};

struct DepartureRecord {
  enum class Why : std::uint8_t {
    kRemoved,        // for good
    kHandedOver,     // to `to`, which sends it from now on under a higher epoch
    kOutOfInterest,  // is there still, with the same owner and epoch, and may come back
  };
  BodyId id;
  Epoch epoch;  // the ownership that ended; if out of interest, the one that goes on
  RegionId to;
  Why why = to == RegionId() ? Why::kRemoved : Why::kHandedOver;
  friend bool operator==(const DepartureRecord&, const DepartureRecord&) = default;
};

}  // namespace tessera::replication

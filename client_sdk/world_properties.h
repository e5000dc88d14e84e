// WorldProperties: the properties of a world that every client may see, as news of regions change them.
//
//   if (properties.Take(news, scene, events) == WorldProperties::News::kNew) ...   // every region sends them
//   properties.Begin(scene, events);                                             // the scene is here
//
// Promise: news of a lower epoch, or of an earlier tick, never replace others. Before the scene is here they wait, for
// nothing says how to read them. An event names each property whose value has changed.
// Pure. Thread rule: one thread at a time.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "client_sdk/client.h"
#include "core/replication/region_message.h"
#include "core/world/properties.h"

namespace tessera::client {

class WorldProperties {
 public:
  using Defs = std::vector<PropertyDef>;  // as the scene declares the world's

  enum class News : std::uint8_t {
    kMalformed,
    kOld,
    kSame,  // newer, with the same properties
    kNew,
  };
  // `defs`: null while the scene is not here.
  News Take(const replication::NewsOfWorld& news, const Defs* defs, std::vector<ClientEvent>& events);
  // The scene is here: reads the news that have waited, and drops malformed ones.
  void Begin(const Defs& defs, std::vector<ClientEvent>& events);
  // For a recording: those that differ from the scene's, from now on.
  void Change(PropertySet changed, const Defs& defs, std::vector<ClientEvent>& events);
  // The world starts over: the next news count, whatever their epoch and tick.
  void ForgetNews() { news_.reset(); }

  // Those that differ from the scene's.
  const PropertySet& changed() const { return changed_; }

 private:
  std::optional<replication::NewsOfWorld> news_;  // the newest
  PropertySet changed_;                           // by it, once the scene is here
};

}  // namespace tessera::client

#include "region_worker/world_news.h"

#include <span>
#include <vector>

#include "core/world/properties.h"

namespace tessera::worker {

std::optional<v1::RegionControl> WorldNewsFor(const region::Region& region, std::optional<WorldVersion>& sent) {
  const std::optional<region::WorldProperties> now = region.world_properties();
  if (!now || sent == WorldVersion(now->epoch, now->made)) return std::nullopt;
  sent = WorldVersion(now->epoch, now->made);
  const std::vector<PropertyDef>& defs = region.catalog().scene().instance_properties;
  // Regions check what they tell each other.
  const PropertySet all = PropertySet::Decode(now->bytes, defs).value_or(PropertySet());
  const std::vector<std::uint8_t> bytes = all.EncodeFor(defs, PropertySet::Viewer::kAnybody);
  v1::RegionControl message;
  v1::WorldNews& news = *message.mutable_world_news();
  news.set_epoch(now->epoch.value());
  news.set_tick(now->made.value());
  news.set_properties(bytes.data(), bytes.size());
  return message;
}

void WorldNewsFeed::AfterTick(const region::Region& region, GamePort& port) {
  if (region.catalog().scene().instance_properties.empty()) return;
  auto sent = sent_.begin();  // ascending by peer, as the clients are
  for (const auto& [peer, client] : port.clients()) {
    while (sent != sent_.end() && sent->first < peer) sent = sent_.erase(sent);
    if (sent == sent_.end() || sent->first != peer) sent = sent_.emplace_hint(sent, peer, std::nullopt);
    if (const std::optional<v1::RegionControl> message = WorldNewsFor(region, sent->second)) port.Send(peer, *message);
    ++sent;
  }
  sent_.erase(sent, sent_.end());
}

}  // namespace tessera::worker

#include "client_sdk/world_properties.h"

#include <utility>

namespace tessera::client {

WorldProperties::News WorldProperties::Take(const replication::NewsOfWorld& news, const Defs* defs,
                                            std::vector<ClientEvent>& events) {
  const auto version = [](const replication::NewsOfWorld& of) { return std::pair(of.epoch, of.tick); };
  if (news_ && version(news) <= version(*news_)) return News::kOld;
  if (defs != nullptr && !PropertySet::Decode(news.properties, *defs).ok()) return News::kMalformed;
  const bool same = news_ && news_->properties == news.properties;
  news_ = news;
  if (defs != nullptr) Begin(*defs, events);
  return same ? News::kSame : News::kNew;
}

void WorldProperties::Begin(const Defs& defs, std::vector<ClientEvent>& events) {
  if (!news_) return;
  absl::StatusOr<PropertySet> now = PropertySet::Decode(news_->properties, defs);
  if (!now.ok()) return news_.reset();
  Change(*std::move(now), defs, events);
}

void WorldProperties::Change(PropertySet changed, const Defs& defs, std::vector<ClientEvent>& events) {
  // A value that was set to the scene's own is no change.
  for (const PropertyDef& def : defs) {
    if (ValueOf(defs, {}, changed_, def.name) == ValueOf(defs, {}, changed, def.name)) continue;
    events.push_back({.kind = ClientEvent::Kind::kWorldPropertyChanged, .property = def.name});
  }
  changed_ = std::move(changed);
}

}  // namespace tessera::client

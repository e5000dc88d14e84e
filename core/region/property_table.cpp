#include "core/region/property_table.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/ascends.h"
#include "core/region/catalog.h"

namespace tessera::region {
namespace {

const auto kByBody = [](const ChangedProperties& entry, BodyId wanted) { return entry.body < wanted; };

}  // namespace

absl::Status CheckProperties(BodyId id, const CarriedProperties& properties, const Catalog& catalog) {
  const auto bad = [id](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat("body ", id.value(), ": ", what));
  };
  if (properties.bytes.empty() != properties.empty()) return bad("properties: changed by nobody, or to nothing");
  if (properties.empty()) return absl::OkStatus();
  const auto set = PropertySet::Decode(properties.bytes, catalog.scene().properties);
  return set.ok() ? absl::OkStatus() : bad(set.status().message());
}

const ChangedProperties* PropertyTable::Find(BodyId id) const {
  const auto at = std::lower_bound(all_.begin(), all_.end(), id, kByBody);
  return at != all_.end() && at->body == id ? &*at : nullptr;
}

CarriedProperties PropertyTable::Of(BodyId id) const {
  const ChangedProperties* entry = Find(id);
  return entry == nullptr ? CarriedProperties() : CarriedProperties{entry->change, *entry->bytes};
}

absl::Status PropertyTable::Set(BodyId id, std::span<const PropertyDef> defs, std::string_view name,
                                PropertyValue value, std::uint64_t change) {
  assert(change > 0);
  PropertySet set;
  if (const ChangedProperties* entry = Find(id); entry != nullptr) {
    if (change <= entry->change) return absl::OkStatus();
    absl::StatusOr<PropertySet> now = PropertySet::Decode(*entry->bytes, defs);
    if (!now.ok()) return now.status();
    set = *std::move(now);
  }
  if (absl::Status status = set.Set(defs, name, std::move(value)); !status.ok()) return status;
  Put({id, change, std::make_shared<const std::vector<std::uint8_t>>(set.Encode())});
  return absl::OkStatus();
}

void PropertyTable::Adopt(BodyId id, const CarriedProperties& properties) {
  if (properties.empty()) return Release(id);
  Put({id, properties.change, std::make_shared<const std::vector<std::uint8_t>>(properties.bytes)});
}

void PropertyTable::Put(ChangedProperties entry) {
  if (keep_news_) news_.push_back(entry.body);
  const auto at = std::lower_bound(all_.begin(), all_.end(), entry.body, kByBody);
  if (at != all_.end() && at->body == entry.body) {
    *at = std::move(entry);
  } else {
    all_.insert(at, std::move(entry));
  }
}

void PropertyTable::Release(BodyId id) {
  if (const ChangedProperties* entry = Find(id); entry != nullptr) all_.erase(all_.begin() + (entry - all_.data()));
}

void PropertyTable::KeepNews(bool on) {
  keep_news_ = on;
  news_.clear();
}

std::vector<ChangedProperties> PropertyTable::TakeNews() {
  std::sort(news_.begin(), news_.end());
  news_.erase(std::unique(news_.begin(), news_.end()), news_.end());
  std::vector<ChangedProperties> news;
  news.reserve(news_.size());
  for (const BodyId id : news_) {
    if (const ChangedProperties* entry = Find(id); entry != nullptr) news.push_back(*entry);
  }
  news_.clear();
  return news;
}

void PropertyTable::Validate() const {
  assert(Ascends(all_, &ChangedProperties::body));
  assert(std::ranges::none_of(all_, [](const ChangedProperties& entry) { return entry.change == 0; }));
}

}  // namespace tessera::region

#include "region_worker/core/property_orders.h"

#include <algorithm>

#include "core/region/catalog.h"

namespace tessera::worker {
namespace {

// Number of the last change that a body here has seen.
std::uint64_t LastChange(const region::Region& region, BodyId body) {
  const region::KeptRecord* entry = region.records().Find(body);
  return entry == nullptr ? 0 : entry->change;
}

bool Declares(const Scene& scene, BodyId body, const std::string& name) {
  const std::vector<PropertyDef>& declared = body == kInstanceBody ? scene.instance_properties : scene.properties;
  return std::ranges::find(declared, name, &PropertyDef::name) != declared.end();
}

bool OwnsRecord(const region::Region& region, BodyId body) {
  return body == kInstanceBody ? region.OwnsWorld() : region.Owns(body);
}

}  // namespace

void PropertyOrders::Set(std::vector<PropertyOrder> orders) {
  orders_ = std::move(orders);
  const auto over = [this](const auto& entry) {
    const auto at =
        std::lower_bound(orders_.begin(), orders_.end(), entry.first,
                         [](const PropertyOrder& order, std::uint64_t number) { return order.number < number; });
    return at == orders_.end() || at->number != entry.first;
  };
  std::erase_if(made_, over);
  std::erase_if(refused_, over);
}

void PropertyOrders::Apply(region::Region& region) {
  for (const PropertyOrder& order : orders_) {
    if (refused_.contains(order.number)) continue;
    if (!Declares(region.catalog().scene(), order.body, order.name)) {
      refused_[order.number] = "no property \"" + order.name + "\"";
      continue;
    }
    if (!OwnsRecord(region, order.body)) {
      made_.erase(order.number);
      continue;
    }
    // A body that went and came back may be an older copy of itself: each time anew.
    const bool news = LastChange(region, order.body) < order.number;
    const absl::Status status = region.SetProperty(order.body, order.name, order.value, order.number);
    if (absl::IsNotFound(status)) {
      made_.erase(order.number);
    } else if (!status.ok()) {
      refused_[order.number] = std::string(status.message());
    } else if (news) {
      made_[order.number] = region.tick() + 1;
    } else {
      made_.try_emplace(order.number, region.tick() + 1);
    }
  }
}

std::vector<PropertyAnswer> PropertyOrders::Answers(const region::Region& region, bool has_standby) const {
  std::vector<PropertyAnswer> answers;
  for (const PropertyOrder& order : orders_) {
    if (const auto refused = refused_.find(order.number); refused != refused_.end()) {
      answers.push_back({order.number, refused->second});
      continue;
    }
    const auto made = made_.find(order.number);
    if (made == made_.end() || !OwnsRecord(region, order.body)) continue;
    const Tick safe = has_standby ? region.acknowledged() : region.tick();
    if (made->second <= safe) answers.push_back({order.number});
  }
  return answers;
}

}  // namespace tessera::worker

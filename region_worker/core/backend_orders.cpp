#include "region_worker/core/backend_orders.h"

#include <algorithm>
#include <set>
#include <utility>

namespace tessera::worker {
namespace {

bool HasTaken(const region::Region& region, const BackendOrder& order) {
  const region::KeptRecord* record = region.records().Find(order.target);
  return record != nullptr && record->game.mail.backend >= order.number;
}

}  // namespace

void BackendOrders::Set(BackendOrderList orders) {
  orders_ = std::move(orders);
  const auto over = [this](const auto& entry) {
    return std::ranges::none_of(orders_.messages,
                                [&](const BackendOrder& order) { return order.number == entry.first; });
  };
  std::erase_if(taken_, over);
  std::erase_if(refused_, over);
}

void BackendOrders::Apply(region::Region& region) {
  region.AcknowledgePublished(orders_.published_up_to);
  std::set<BodyId> full;  // where one found no room, later ones of the same target must not overtake it
  for (const BackendOrder& order : orders_.messages) {
    if (refused_.contains(order.number) || full.contains(order.target)) continue;
    // A body that went and came back may be an older copy of itself: each time anew.
    const absl::Status status = region.TakeFromBackend(order.target, order.number, order.message);
    if (status.ok()) {
      taken_[order.number] = region.tick() + 1;
    } else if (absl::IsAlreadyExists(status)) {
      taken_.try_emplace(order.number, region.tick() + 1);
    } else {
      taken_.erase(order.number);
      if (absl::IsFailedPrecondition(status)) refused_[order.number] = std::string(status.message());
      if (absl::IsResourceExhausted(status)) full.insert(order.target);
    }
  }
}

std::vector<BackendAnswer> BackendOrders::Answers(const region::Region& region) const {
  std::vector<BackendAnswer> answers;
  for (const BackendOrder& order : orders_.messages) {
    if (const auto refused = refused_.find(order.number); refused != refused_.end()) {
      answers.push_back({order.number, refused->second});
      continue;
    }
    const auto taken = taken_.find(order.number);
    if (taken == taken_.end() || taken->second > region.committed_tick()) continue;
    if (HasTaken(region, order)) answers.push_back({order.number});
  }
  return answers;
}

}  // namespace tessera::worker

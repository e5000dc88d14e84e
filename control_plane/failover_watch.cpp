#include "control_plane/failover_watch.h"

#include <algorithm>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "control_plane/control_settings.h"
#include "core/region/failover_io.h"

namespace tessera::control {

void FailoverWatch::Begin(const records::Instance& record, const std::map<std::uint64_t, Steady>& leased_at, Now now) {
  since_ = now.steady;
  inventories_.clear();
  const std::map<std::uint64_t, Steady> before = std::exchange(stands_still_at_, {});
  for (const records::Dead& dead : record.failover().dead()) {
    if (dead.exit_seen()) exited_.insert(dead.incarnation());
    if (const auto known = before.find(dead.incarnation()); known != before.end()) stands_still_at_.insert(*known);
    const auto leased = leased_at.find(dead.incarnation());
    if (leased == leased_at.end()) continue;
    stands_still_at_[dead.incarnation()] =
        leased->second.count() == 0 ? Steady(0) : leased->second + kLeaseTtl + kLeaseDrift;
  }
}

absl::StatusOr<bool> FailoverWatch::Add(const records::Instance& record, std::uint32_t region,
                                        const v1::Inventory& inventory, Now now) {
  if (!record.has_failover() || record.failover().has_resolution()) return false;
  if (inventory.version() != record.map().version()) return false;
  if (inventory.region() != region) {
    return absl::InvalidArgumentError(
        absl::StrCat("inventory.region: ", inventory.region(), ", but it comes from region ", region));
  }
  if (const auto read = region::FromProto(inventory); !read.ok()) return read.status();
  inventories_[region] = inventory;
  for (const v1::StandbyCopyInventory& copy : inventory.standby_copies()) {
    const auto& all = record.failover().dead();
    const bool awaited = std::any_of(all.begin(), all.end(), [&](const records::Dead& dead) {
      return dead.region() == copy.region() && dead.incarnation() == copy.incarnation();
    });
    if (!awaited) continue;
    const Steady acknowledged = now.steady - std::chrono::milliseconds(copy.last_acknowledged_ms());
    Steady& until = stands_still_at_.try_emplace(copy.incarnation(), Steady(0)).first->second;
    until = std::max(until, acknowledged + kLeaseTtl + kLeaseDrift);
  }
  return true;
}

std::string FailoverWatch::WaitsFor(const records::Instance& record, Now now) const {
  std::vector<std::uint32_t> silent;
  for (const records::Placement& placement : record.placements()) {
    if (!inventories_.contains(placement.region())) silent.push_back(placement.region());
  }
  if (!silent.empty()) {
    return absl::StrCat("the inventor", silent.size() == 1 ? "y of region " : "ies of regions ",
                        absl::StrJoin(silent, ", "));
  }
  for (const records::Dead& dead : record.failover().dead()) {
    if (dead.exit_seen() || exited_.contains(dead.incarnation())) continue;
    const auto known = stands_still_at_.find(dead.incarnation());
    const Steady until = known == stands_still_at_.end() ? since_ + kLeaseTtl + kLeaseDrift : known->second;
    if (now.steady < until) return absl::StrCat("the lease of region ", dead.region(), " to run out");
  }
  return "";
}

}  // namespace tessera::control

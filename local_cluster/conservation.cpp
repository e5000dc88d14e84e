#include "local_cluster/conservation.h"

#include <algorithm>

#include "core/region/census.h"

namespace tessera::local {

Conservation::Conservation(std::span<const BodyId> bodies) {
  for (const BodyId body : bodies) Expect(body, 0);
}

void Conservation::Expect(BodyId body, std::uint64_t from_tick) {
  if (bodies_.insert(body).second) checksum_ += region::Mix(body);
  from_tick_ = std::max(from_tick_, from_tick);
}

bool Conservation::FollowMap(const v1::Instance& instance) {
  if (instance.map().version() != map_version_) {
    in_force_ = map_version_ == 0;
    map_version_ = instance.map().version();
  }
  if (in_force_) return true;
  std::set<std::uint32_t> here;
  for (const v1::RegionStatus& region : instance.region_status()) {
    if (region.report().map_version() >= map_version_) here.insert(region.region());
  }
  const auto& regions = instance.map().regions();
  in_force_ =
      std::all_of(regions.begin(), regions.end(), [&](const auto& region) { return here.contains(region.id()); });
  CountFromNow(instance);
  return in_force_;
}

// Earlier counts may or may not include the bodies that are expected now.
void Conservation::CountFromNow(const v1::Instance& instance) {
  for (const v1::RegionStatus& region : instance.region_status()) {
    from_tick_ = std::max(from_tick_, region.report().tick() + 1);
  }
  open_.clear();
}

void Conservation::NoteTakenOut(const v1::Instance& instance) {
  bool changed = false;
  for (const v1::RegionStatus& region : instance.region_status()) {
    for (const std::uint64_t id : region.report().nonfinite_ids()) {
      if (bodies_.erase(BodyId(id)) == 0) continue;
      checksum_ -= region::Mix(BodyId(id));
      taken_out_.insert(BodyId(id));
      changed = true;
    }
    changed |= NoteRemoved(region.report());
  }
  if (changed) CountFromNow(instance);
}

// Bodies that the game removed are as if they had never been.
bool Conservation::NoteRemoved(const v1::WorkerReport& report) {
  bool changed = false;
  const int runs = std::min(report.removed_first_size(), report.removed_last_size());
  for (int i = 0; i < runs; ++i) {
    const auto end = bodies_.upper_bound(BodyId(report.removed_last(i)));
    for (auto body = bodies_.lower_bound(BodyId(report.removed_first(i))); body != end;) {
      checksum_ -= region::Mix(*body);
      body = bodies_.erase(body);
      changed = true;
    }
  }
  return changed;
}

void Conservation::Observe(const v1::Instance& instance) {
  NoteTakenOut(instance);
  if (!FollowMap(instance)) return;
  std::set<std::uint32_t> regions;
  for (const v1::MapRegion& region : instance.map().regions()) regions.insert(region.id());
  const std::size_t expected_regions = regions.empty() ? instance.regions() : regions.size();
  for (const v1::RegionStatus& region : instance.region_status()) {
    if (!regions.empty() && !regions.contains(region.region())) continue;
    for (const v1::Census& census : region.report().censuses()) {
      if (census.tick() <= last_compared_ || census.tick() < from_tick_) continue;
      Sum& sum = open_[census.tick()];
      if (!sum.regions.insert(region.region()).second) continue;
      sum.owned += census.owned();
      sum.checksum += census.id_checksum();
    }
  }
  while (!open_.empty()) {
    const auto oldest = std::find_if(
        open_.begin(), open_.end(), [&](const auto& entry) { return entry.second.regions.size() == expected_regions; });
    if (oldest == open_.end()) return;
    if (oldest->first >= from_tick_) Compare(oldest->first, oldest->second);
    open_.erase(open_.begin(), std::next(oldest));
  }
}

void Conservation::Compare(std::uint64_t tick, const Sum& sum) {
  if (!result_) result_.emplace();
  last_compared_ = tick;
  result_->tick = tick;
  result_->expected = bodies_.size();
  result_->taken_out = taken_out_.size();
  result_->found = sum.owned;
  ++result_->censuses;
  const std::uint64_t expected = bodies_.size();
  std::uint64_t lost = sum.owned < expected ? expected - sum.owned : 0;
  std::uint64_t duplicated = sum.owned > expected ? sum.owned - expected : 0;
  if (sum.owned == expected && sum.checksum != checksum_) lost = duplicated = 1;
  result_->lost = lost;
  result_->duplicated = std::max(result_->duplicated, duplicated);
}

}  // namespace tessera::local

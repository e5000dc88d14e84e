#include "bench/borders_instance.h"

#include <algorithm>
#include <stdexcept>

#include "bench/engine.h"

namespace tessera::bench {

BorderInstance::BorderInstance(std::shared_ptr<const Scene> scene, const PartitionMap& map,
                               const BorderSettings& settings)
    : scene_(std::move(scene)), settings_(settings) {
  for (const MapRegion& region : map.regions()) {
    regions_.push_back(std::make_unique<region::Region>(
        region::Config{region.id, Incarnation(region.id.value()), scene_, map, settings.region}));
  }
  cpu_s_.resize(regions_.size());
  told_.resize(regions_.size());
  for (auto& told : told_) told.resize(1);
  for (const auto& region : regions_) Send(region->id(), region->Start());
}

void BorderInstance::Tick() {
  std::vector<std::pair<RegionId, std::vector<region::OutgoingFrame>>> sent;
  for (const auto& region : regions_) {
    const double before = ThreadCpuSeconds();
    region::StepResult result = region->Step();
    cpu_s_[region->id().value() - 1] += ThreadCpuSeconds() - before;
    NoteHandovers(region->id(), result);
    NoteStrays(*region);
    ghosts_ += static_cast<double>(region->ghost_count());
    bodies_ += static_cast<double>(region->owned_count());
    lost_ += result.nonfinite.size();
    sent.emplace_back(region->id(), std::move(result.frames));
  }
  for (auto& told : told_) told.emplace_back();
  for (auto& [from, frames] : sent) Send(from, std::move(frames));
}

void BorderInstance::Send(RegionId from, std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    const std::size_t to = frame.to.value() - 1;
    frame_bytes_ += frame.bytes.size();
    const double before = ThreadCpuSeconds();
    const absl::Status status = regions_.at(to)->Receive(from, frame.bytes);
    cpu_s_[to] += ThreadCpuSeconds() - before;
    if (!status.ok()) throw std::runtime_error("a frame was refused: " + status.ToString());
    if (!settings_.keep_told) continue;
    told_[to].back().push_back({from, std::make_shared<const region::Bytes>(std::move(frame.bytes))});
  }
}

void BorderInstance::NoteHandovers(RegionId from, const region::StepResult& result) {
  handovers_ += result.handed_in;
  for (const region::Departure& departure : result.departures) {
    if (departure.reason != region::DepartureReason::kHandedOver || departure.to == from) continue;
    const auto since = stray_since_.find({from, departure.body});
    if (since == stray_since_.end()) continue;
    handover_ticks_.push_back(static_cast<double>(result.tick.value() - since->second));
    stray_since_.erase(since);
  }
}

void BorderInstance::NoteStrays(const region::Region& region) {
  if (regions_.size() == 1) return;
  for (const region::OwnedBody& body : region.owned()) {
    const double out = region.map().DistanceTo(region.id(), body.state.position);
    const bool home = region.map().OwnerOf(body.state.position) == region.id();
    if (home || out <= settings_.region.hysteresis_m) {
      stray_since_.erase({region.id(), body.def->id});
    } else {
      stray_since_.emplace(std::pair(region.id(), body.def->id), region.tick().value());
    }
  }
}

const region::OwnedBody* BorderInstance::Find(BodyId id) const {
  for (const auto& region : regions_) {
    const std::span<const region::OwnedBody> owned = region->owned();
    const auto at = std::lower_bound(owned.begin(), owned.end(), id, [](const region::OwnedBody& body, BodyId wanted) {
      return body.def->id < wanted;
    });
    if (at != owned.end() && at->def->id == id) return &*at;
  }
  return nullptr;
}

BodyState BorderInstance::StateOf(BodyId id) const {
  const region::OwnedBody* body = Find(id);
  return body == nullptr ? BodyState() : body->state;
}

RegionId BorderInstance::OwnerOf(BodyId id) const {
  for (const auto& region : regions_) {
    if (region->Owns(id)) return region->id();
  }
  return RegionId();
}

std::vector<const region::Region*> BorderInstance::regions() const {
  std::vector<const region::Region*> all;
  all.reserve(regions_.size());
  for (const auto& region : regions_) all.push_back(region.get());
  return all;
}

LoneRegion::LoneRegion(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings,
                       RegionId id, const Told& told)
    : told_(told.at(id.value() - 1)), region_({id, Incarnation(id.value()), std::move(scene), map, settings.region}) {
  region_.Start();
}

double LoneRegion::Seconds(int ticks) {
  const double before = ThreadCpuSeconds();
  for (int i = 0; i < ticks && region_.tick().value() + 1 < told_.size(); ++i) {
    for (const ToldFrame& frame : told_[region_.tick().value()]) {
      const absl::Status status = region_.Receive(frame.from, *frame.bytes);
      if (!status.ok()) throw std::runtime_error("a frame was refused: " + status.ToString());
    }
    region_.Step();
  }
  return ThreadCpuSeconds() - before;
}

}  // namespace tessera::bench

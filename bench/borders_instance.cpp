#include "bench/borders_instance.h"

#include <algorithm>
#include <stdexcept>

#include "bench/engine.h"
#include "bench/thread_cpu.h"

namespace tessera::bench {

BorderInstance::BorderInstance(std::shared_ptr<const Scene> scene, const PartitionMap& map,
                               const BorderSettings& settings)
    : scene_(std::move(scene)),
      settings_(settings),
      cpu_s_(map.regions().size()),
      received_(map.regions().size(), std::vector<std::vector<ReceivedFrame>>(1)),
      regions_(scene_, map, settings.region,
               {.stepped = [this](const auto& region, const auto& result, double s) { OnStep(region, result, s); },
                .received = [this](RegionId from, auto& frame, double s) { OnFrame(from, frame, s); }}) {}

void BorderInstance::Tick() {
  if (settings_.keep_frames) {
    for (auto& ticks : received_) ticks.emplace_back();
  }
  regions_.Tick();
}

void BorderInstance::OnStep(const region::Region& region, const region::StepResult& result, double cpu_s) {
  cpu_s_[region.id().value() - 1] += cpu_s;
  NoteHandovers(region.id(), result);
  NoteStrays(region);
  ghosts_ += static_cast<double>(region.ghost_count());
  bodies_ += static_cast<double>(region.owned().size());
  lost_ += result.nonfinite.size();
}

void BorderInstance::OnFrame(RegionId from, region::OutgoingFrame& frame, double cpu_s) {
  const std::size_t to = frame.to.value() - 1;
  cpu_s_[to] += cpu_s;
  frame_bytes_ += frame.bytes.size();
  if (!settings_.keep_frames) return;
  received_[to].back().push_back({from, std::make_shared<const region::Bytes>(std::move(frame.bytes))});
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
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    const std::span<const region::OwnedBody> owned = regions_.region(i).owned();
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
  for (std::size_t i = 0; i < regions_.size(); ++i) {
    if (regions_.region(i).Owns(id)) return regions_.region(i).id();
  }
  return RegionId();
}

std::vector<const region::Region*> BorderInstance::regions() const {
  std::vector<const region::Region*> all;
  all.reserve(regions_.size());
  for (std::size_t i = 0; i < regions_.size(); ++i) all.push_back(&regions_.region(i));
  return all;
}

LoneRegion::LoneRegion(std::shared_ptr<const Scene> scene, const PartitionMap& map, const BorderSettings& settings,
                       RegionId id, const ReceivedFrames& received)
    : received_(received.at(id.value() - 1)),
      region_({id, Incarnation(id.value()), std::move(scene), map, settings.region}) {
  region_.Start();
}

double LoneRegion::Seconds(int ticks) {
  const double before = ThreadCpuSeconds();
  for (int i = 0; i < ticks && region_.tick().value() + 1 < received_.size(); ++i) {
    for (const ReceivedFrame& frame : received_[region_.tick().value()]) {
      const absl::Status status = region_.Receive(frame.from, *frame.bytes);
      if (!status.ok()) throw std::runtime_error("a frame was refused: " + status.ToString());
    }
    region_.Step();
  }
  return ThreadCpuSeconds() - before;
}

}  // namespace tessera::bench

#include "bench/lockstep.h"

#include <stdexcept>
#include <utility>

#include "bench/engine.h"
#include "bench/thread_cpu.h"

namespace tessera::bench {

Lockstep::Lockstep(const std::shared_ptr<const Scene>& scene, const PartitionMap& map,
                   const region::RegionSettings& settings, Observer observer, const GameMaker& game)
    : observer_(std::move(observer)) {
  for (const MapRegion& region : map.regions()) {
    region::Config config{region.id, Incarnation(region.id.value()), scene, map, settings};
    if (game) config.game = game(region.id);
    regions_.push_back(std::make_unique<region::Region>(std::move(config)));
  }
  for (const auto& region : regions_) Send(region->id(), region->Start());
}

void Lockstep::Tick(const region::PhaseObserver& phases) {
  std::vector<std::pair<RegionId, std::vector<region::OutgoingFrame>>> sent;
  for (const auto& region : regions_) {
    const double before = observer_.stepped ? ThreadCpuSeconds() : 0;
    region::StepResult result = region->Step(phases);
    if (observer_.stepped) observer_.stepped(*region, result, ThreadCpuSeconds() - before);
    sent.emplace_back(region->id(), std::move(result.frames));
  }
  for (auto& [from, frames] : sent) Send(from, std::move(frames));
}

void Lockstep::Send(RegionId from, std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    const double before = observer_.received ? ThreadCpuSeconds() : 0;
    const absl::Status status = regions_.at(frame.to.value() - 1)->Receive(from, frame.bytes);
    if (!status.ok()) throw std::runtime_error("a frame was refused: " + status.ToString());
    if (observer_.received) observer_.received(from, frame, ThreadCpuSeconds() - before);
  }
}

}  // namespace tessera::bench

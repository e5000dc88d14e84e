#include "tests/simulation/world_watch.h"

#include <algorithm>

namespace tessera::simulation {
namespace {

constexpr int kReignBits = 32;  // for the lives of a control plane; above them is its number

bool LeadsIndeed(const SimulatedControl& control) {
  return control.leads() && !control.stopped() && control.ReachesStore();
}

}  // namespace

WorldWatch::WorldWatch(Deployment& deployment, const WordBounds& bounds)
    : deployment_(deployment),
      words_(bounds, deployment.timeline().now()),
      leaderless_since_(deployment.timeline().now()),
      led_(LeadsIndeed(deployment.control())) {
  deployment_.on_step = [this](const SimulatedWorker& worker, const region::StepResult& result) {
    const worker::Identity& identity = worker.identity();
    words_.Stepped(identity.region, identity.incarnation, result.tick, deployment_.timeline().now());
    stepped_.insert(worker.node());
  };
}

void WorldWatch::RunFor(Micros span) {
  for (const Micros end = deployment_.timeline().now() + span; deployment_.timeline().now() < end;) {
    deployment_.RunFor(std::min(kLook, end - deployment_.timeline().now()));
    Look();
  }
}

// The regions of the newest map that anybody runs by. Those who run may go by a newer one than is answered.
std::vector<RegionId> WorldWatch::Regions() const {
  const PartitionMap* newest = nullptr;
  for (const SimulatedWorker* worker : deployment_.Workers()) {
    if (worker->region() == nullptr || !stepped_.contains(worker->node())) continue;
    const PartitionMap& map = worker->region()->map();
    if (newest == nullptr || map.version() > newest->version()) newest = &map;
  }
  std::vector<RegionId> regions;
  if (newest != nullptr) {
    for (const MapRegion& region : newest->regions()) regions.push_back(region.id);
  }
  return regions;
}

void WorldWatch::Look() {
  const Micros now = deployment_.timeline().now();
  std::vector<Word> words;
  bool led = false;
  for (const auto& control : deployment_.controls()) {
    led = led || LeadsIndeed(*control);
    if (!control->answers()) continue;
    const std::uint64_t reign = std::uint64_t{control->number()} << kReignBits | control->life();
    words.push_back({.reign = reign, .said = deployment_.SaidBy(*control), .sees = sees(*control)});
  }
  words_.Look(now, Regions(), words);
  if (led && !led_) leader_gaps_.push_back(now - leaderless_since_);
  if (led) leaderless_since_ = now;
  led_ = led;
}

}  // namespace tessera::simulation

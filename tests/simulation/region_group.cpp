#include "tests/simulation/region_group.h"

#include <algorithm>
#include <bit>
#include <sstream>

#include "core/world/state_check.h"

namespace tessera::simulation {
namespace {

constexpr std::size_t kMostProblems = 20;
constexpr std::uint64_t kMaxStuckRounds = 1000;

void Mix(std::uint64_t& hash, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) hash = (hash ^ ((value >> (8 * i)) & 0xff)) * 0x100000001b3;
}

void Mix(std::uint64_t& hash, const BodyState& state) {
  for (const double v : {state.position.x, state.position.y, state.position.z, state.orientation.x, state.orientation.y,
                         state.orientation.z, state.orientation.w}) {
    Mix(hash, std::bit_cast<std::uint64_t>(v));
  }
  for (const float v : {state.linear_velocity.x, state.linear_velocity.y, state.linear_velocity.z,
                        state.angular_velocity.x, state.angular_velocity.y, state.angular_velocity.z,
                        state.angular_momentum.x, state.angular_momentum.y, state.angular_momentum.z, state.still_s}) {
    Mix(hash, std::bit_cast<std::uint32_t>(v));
  }
  Mix(hash, state.asleep ? 1 : 0);
}

}  // namespace

RegionGroup::RegionGroup(std::shared_ptr<const Scene> scene, const PartitionMap& map, const RegionGroupOptions& options)
    : scene_(std::move(scene)), options_(options), random_(options.seed) {
  for (const MapRegion& region : map.regions()) {
    regions_.push_back(std::make_unique<region::Region>(
        region::Config{region.id, Incarnation(region.id.value()), scene_, map, options.settings}));
  }
  for (const BodyDef& def : scene_->bodies) {
    if (def.motion == Motion::kDynamic) bodies_[def.id] = Epoch(1);
  }
  for (const auto& region : regions_) {
    Send(region->id(), region->Start());
    records_[Tick()].regions++;
    for (const region::OwnedBody& body : region->owned()) {
      records_[Tick()].bodies.push_back({body.def->id, {region->id(), body.epoch, body.state}});
    }
  }
  Check(Tick(), records_[Tick()]);
  records_.erase(Tick());
}

Tick RegionGroup::tick() const {
  Tick lowest = regions_.front()->tick();
  for (const auto& region : regions_) lowest = std::min(lowest, region->tick());
  return lowest;
}

void RegionGroup::RunTo(Tick target) {
  std::uint64_t stuck = 0;
  while (tick() < target && problems_.size() < kMostProblems) {
    const Tick before = tick();
    Round(target);
    stuck = tick() == before ? stuck + 1 : 0;
    if (stuck > kMaxStuckRounds) return Problem(before, "the regions wait for each other for ever");
  }
}

void RegionGroup::Round(Tick target) {
  ++round_;
  Deliver();
  std::vector<region::Region*> order;
  for (const auto& region : regions_) order.push_back(region.get());
  std::shuffle(order.begin(), order.end(), random_);
  for (region::Region* region : order) {
    if (region->tick() < target && region->CanStep()) StepOne(*region);
  }
}

void RegionGroup::Send(RegionId from, std::vector<region::OutgoingFrame> frames) {
  for (region::OutgoingFrame& frame : frames) {
    if (options_.on_frame) options_.on_frame(from, frame);
    ++totals_.frames;
    totals_.frame_bytes += frame.bytes.size();
    const std::uint64_t delay = random_() % (options_.max_delay_rounds + 1);
    links_[{from, frame.to}].push_back({round_ + 1 + delay, std::move(frame.bytes)});
  }
}

void RegionGroup::Deliver() {
  std::vector<Link> order;
  for (const auto& [link, queue] : links_) {
    if (!queue.empty()) order.push_back(link);
  }
  std::shuffle(order.begin(), order.end(), random_);
  for (const Link& link : order) {
    std::deque<Message>& queue = links_[link];
    while (!queue.empty() && queue.front().due <= round_) {
      region::Region& to = region(link.second.value());
      const absl::Status status = to.Receive(link.first, queue.front().bytes);
      if (!status.ok()) Problem(to.tick(), "a frame was refused: " + status.ToString());
      queue.pop_front();
    }
  }
}

void RegionGroup::StepOne(region::Region& region) {
  region::StepResult result = region.Step();
  if (on_step) on_step(region.id(), result);
  Record& record = records_[result.tick];
  for (const region::OwnedBody& body : region.owned()) {
    record.bodies.push_back({body.def->id, {region.id(), body.epoch, body.state}});
  }
  for (const region::Departure& departure : result.departures) {
    if (departure.reason == region::DepartureReason::kRemoved) record.removed.push_back(departure.body);
  }
  totals_.handovers += result.handed_in;
  totals_.max_ghosts = std::max<std::uint64_t>(totals_.max_ghosts, region.ghost_count());
  totals_.events.insert(totals_.events.end(), result.events.begin(), result.events.end());
  totals_.nonfinite.insert(totals_.nonfinite.end(), result.nonfinite.begin(), result.nonfinite.end());
  Send(region.id(), std::move(result.frames));
  if (++record.regions == regions_.size()) {
    Check(result.tick, record);
    records_.erase(result.tick);
  }
}

void RegionGroup::Check(Tick tick, Record& record) {
  std::sort(record.bodies.begin(), record.bodies.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first, a.second.region) < std::tie(b.first, b.second.region);
  });
  for (const BodyId id : record.removed) bodies_.erase(id);
  std::map<BodyId, Epoch> now;
  Mix(hash_, tick.value());
  for (const auto& [id, owned] : record.bodies) {
    std::ostringstream name;
    name << "body " << id << " of region " << owned.region;
    if (!now.emplace(id, owned.epoch).second) Problem(tick, name.str() + " has two owners");
    const auto before = bodies_.find(id);
    if (before == bodies_.end() && awaited_.erase(id) == 0) Problem(tick, name.str() + " came from nowhere");
    if (before != bodies_.end() && owned.epoch < before->second) Problem(tick, name.str() + ": its epoch shrank");
    if (!IsSane(owned.state)) Problem(tick, name.str() + " has a state that no region takes");
    Mix(hash_, id.value());
    Mix(hash_, owned.state);
  }
  for (const auto& [id, epoch] : bodies_) {
    if (!now.contains(id)) Problem(tick, "body " + std::to_string(id.value()) + " has no owner");
  }
  bodies_ = std::move(now);
}

void RegionGroup::Problem(Tick tick, const std::string& what) {
  if (problems_.size() < kMostProblems) problems_.push_back("tick " + std::to_string(tick.value()) + ": " + what);
}

RegionId RegionGroup::OwnerOf(BodyId id) const {
  for (const auto& region : regions_) {
    if (region->Owns(id)) return region->id();
  }
  return RegionId();
}

BodyState RegionGroup::StateOf(BodyId id) const {
  const RegionId owner = OwnerOf(id);
  return owner == RegionId() ? BodyState() : regions_.at(owner.value() - 1)->world().StateOf(id);
}

std::map<BodyId, BodyState> RegionGroup::States() const {
  std::map<BodyId, BodyState> states;
  for (const auto& region : regions_) {
    for (const region::OwnedBody& body : region->owned()) states[body.def->id] = body.state;
  }
  return states;
}

void RegionGroup::SpawnPlayer(PlayerNumber player, std::uint32_t region_id) {
  region(region_id).SpawnPlayer(player);
  awaited_.insert(PlayerBodyId(player));
}

void RegionGroup::RemovePlayer(PlayerNumber player) {
  for (const auto& region : regions_) region->RemovePlayer(player);
}

absl::Status RegionGroup::QueueInput(const PlayerInput& input) {
  const RegionId owner = OwnerOf(input.body);
  if (owner == RegionId()) return absl::NotFoundError("nobody owns it");
  return region(owner.value()).QueueInput(input);
}

}  // namespace tessera::simulation

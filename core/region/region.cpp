#include "core/region/region.h"

#include <algorithm>
#include <cassert>

#include "absl/strings/str_cat.h"
#include "core/region/step.h"

namespace tessera::region {

struct Region::Impl : RegionStep {
  using RegionStep::RegionStep;
};

Region::Region(Config config) : impl_(std::make_unique<Impl>(std::move(config))) {}
Region::~Region() = default;

RegionId Region::id() const { return impl_->config.self; }
Tick Region::tick() const { return impl_->tick; }
const PartitionMap& Region::map() const { return impl_->config.map; }
std::span<const RegionId> Region::neighbors() const { return impl_->neighbors; }

std::vector<OutgoingFrame> Region::Start() { return impl_->Start(); }

absl::Status Region::Receive(RegionId from, std::span<const std::uint8_t> frame) {
  const Frame* taken = nullptr;
  if (absl::Status status = impl_->inbox.Put(from, frame, impl_->tick, &taken); !status.ok()) return status;
  impl_->change.Heard(impl_->inbox.newest_commit());
  if (taken == nullptr) return absl::OkStatus();
  absl::Status claims = impl_->CheckClaims(*taken);
  if (!claims.ok()) impl_->inbox.Reject(from);
  return claims;
}

bool Region::CanStep() const {
  if (halted()) return false;
  for (std::size_t i = 0; i < impl_->neighbors.size(); ++i) {
    if (!impl_->inbox.link(i).Ready()) return false;
  }
  return true;
}

std::vector<RegionId> Region::WaitingFor() const {
  std::vector<RegionId> missing;
  for (std::size_t i = 0; i < impl_->neighbors.size(); ++i) {
    if (!impl_->inbox.link(i).Ready()) missing.push_back(impl_->neighbors[i]);
  }
  return missing;
}

void Region::Close(RegionId neighbor) { impl_->Close(neighbor); }
bool Region::IsOpen(RegionId neighbor) const { return impl_->OpenTo(neighbor); }

StepResult Region::Step(const PhaseObserver& observer) {
  assert(CanStep());
  return impl_->Step(observer);
}

absl::Status Region::QueueInput(const PlayerInput& input) { return impl_->players.Queue(input); }

void Region::SpawnPlayer(PlayerNumber player) {
  assert(impl_->config.scene->player.has_value());
  impl_->players.Spawn(player);
}

void Region::MarkSpawned(PlayerNumber player) { impl_->players.MarkSpawned(player); }
void Region::RemovePlayer(PlayerNumber player) { impl_->players.Leave(player); }

void Region::ParkPlayer(PlayerNumber player, bool parked) { impl_->players.Park(player, parked); }

std::uint32_t Region::LastInput(PlayerNumber player) const {
  const PlayerControl* control = impl_->players.Find(player);
  return control == nullptr ? 0 : control->last_input;
}

std::size_t Region::QueuedInputs(PlayerNumber player) const {
  const PlayerControl* control = impl_->players.Find(player);
  return control == nullptr ? 0 : control->queue.size();
}

absl::Status Region::SetProperty(BodyId body, std::string_view name, PropertyValue value, std::uint64_t change) {
  return impl_->SetProperty(body, name, std::move(value), change);
}
std::span<const ChangedProperties> Region::properties() const { return impl_->properties.all(); }
const ChangedProperties* Region::FindProperties(BodyId body) const { return impl_->properties.Find(body); }

void Region::SetStandby(bool on) { impl_->SetStandby(on); }
void Region::LogAcknowledged(Tick tick) { impl_->LogAcknowledged(tick); }
Tick Region::acknowledged() const { return impl_->acknowledged; }
Bytes Region::SaveState() const { return EncodeState(impl_->State()); }
const Catalog& Region::catalog() const { return impl_->catalog; }

absl::Status Region::Announce(const PartitionMap& map, Tick effective) { return impl_->Announce(map, effective); }

absl::Status Region::Commit(MapVersion version) {
  if (halted()) return absl::FailedPreconditionError("a failover is under way");
  return impl_->change.Commit(version, impl_->tick,
                              FurthestRegion(impl_->config.map, id()) * (impl_->config.settings.vouch_ticks + 1));
}

MapVersion Region::announced() const { return impl_->change.announced(); }
bool Region::committed() const { return impl_->change.committed(); }
std::size_t Region::away_count() const { return impl_->AwayCount(); }

absl::StatusOr<Inventory> Region::BeginFailover(const PartitionMap& map, std::span<const Standby* const> wards) {
  return impl_->BeginFailover(map, wards);
}
bool Region::halted() const { return impl_->failover.has_value(); }
absl::StatusOr<StepResult> Region::Resume(const Resolution& resolution, std::span<const Standby* const> wards) {
  return impl_->Resume(resolution, wards);
}

std::size_t Region::owned_count() const { return impl_->bodies.owned().size(); }
std::size_t Region::ghost_count() const { return impl_->bodies.ghosts().size(); }

std::size_t Region::asleep_count() const {
  const std::span<const OwnedBody> bodies = impl_->bodies.owned();
  return static_cast<std::size_t>(
      std::count_if(bodies.begin(), bodies.end(), [](const OwnedBody& body) { return body.state.asleep; }));
}

std::size_t Region::unconfirmed_grants() const { return impl_->unconfirmed.size(); }
std::vector<BodyId> Region::KeptBodies() const {
  std::vector<BodyId> kept;
  kept.reserve(impl_->unconfirmed.size());
  for (const auto& [key, grant] : impl_->unconfirmed) kept.push_back(key.first);
  return kept;
}
bool Region::Owns(BodyId body) const { return impl_->bodies.Owns(body); }
std::vector<physics::PairEvent> Region::touching() const {
  const std::vector<TouchingPair> all = impl_->reports.All();
  std::vector<physics::PairEvent> touching;
  touching.reserve(all.size());
  for (const TouchingPair& pair : all) {
    touching.push_back({pair.body_a, pair.body_b, pair.trigger, true});
  }
  return touching;
}
std::span<const OwnedBody> Region::owned() const { return impl_->bodies.owned(); }
std::span<const OwedImpulse> Region::owed() const { return impl_->owed; }
const physics::World& Region::world() const { return impl_->bodies.world(); }

}  // namespace tessera::region

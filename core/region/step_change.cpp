// Another map: planned, in force at the same tick everywhere; or a failover's, after which what the dead owned is taken
// up.
#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/region/step.h"

namespace tessera::region {
namespace {

const Standby* WardOf(RegionId region, std::span<const Standby* const> wards) {
  for (const Standby* ward : wards) {
    if (ward->whole() && ward->region() == region) return ward;
  }
  return nullptr;
}

// The newest grant of a body; null if there is none.
const KeptGrant* NewestGrant(const KeptGrants& grants, BodyId id) {
  auto after = grants.upper_bound({id, Epoch(0xffffffff)});
  if (after == grants.begin()) return nullptr;
  --after;
  return after->first.first == id ? &after->second : nullptr;
}

}  // namespace

absl::Status RegionStep::Announce(const PartitionMap& map, Tick effective) {
  if (failover.has_value()) return absl::FailedPreconditionError("a failover is under way");
  if (absl::Status status = change.Announce(map, effective, config.map.version(), tick); !status.ok()) return status;
  const std::vector<RegionId> next = map.Neighbors(config.self);
  inbox.Expect(map.version(), next);
  // Who will be no neighbour any more gets nothing that it would have to confirm.
  grantable.clear();
  std::set_intersection(neighbors.begin(), neighbors.end(), next.begin(), next.end(), std::back_inserter(grantable));
  return absl::OkStatus();
}

void RegionStep::ChangeMapIfDue() {
  if (!change.DueAt(tick)) return;
  const PartitionMap map = *change.map();
  change.Clear();
  AdoptMap(map, false);
}

// Frames that were early are put after it, when neighbours and ticks are right.
void RegionStep::AdoptMap(PartitionMap map, bool anew) {
  const std::vector<RegionId> old = std::exchange(neighbors, map.Neighbors(config.self));
  config.map = std::move(map);
  std::vector<Outbox> outboxes(neighbors.size());
  for (std::size_t i = 0; i < neighbors.size() && !anew; ++i) {
    const auto before = std::lower_bound(old.begin(), old.end(), neighbors[i]);
    if (before == old.end() || *before != neighbors[i]) continue;
    outboxes[i] = std::move(outboxes_[static_cast<std::size_t>(before - old.begin())]);
  }
  outboxes_ = std::move(outboxes);
  grantable = neighbors;
  reach.SetNeighbors(neighbors);
  for (const auto& [from, bytes] : inbox.ChangeMap(config.map.version(), neighbors, anew)) {
    const Frame* taken = nullptr;
    if (!inbox.Put(from, bytes, tick, &taken).ok() || taken == nullptr) continue;
    if (!CheckClaims(*taken).ok()) inbox.Reject(from);
  }
}

// What a settled map must not find: bodies, or copies of what was granted, too far from home to be shown to those whom
// they could touch. What crosses a border fast is that far out for a tick or two in any map: in a world of fast bodies
// there is always one.
std::size_t RegionStep::AwayCount() const {
  constexpr double kCrossingTicks = 2;
  const double far = config.settings.hysteresis_m + config.settings.aura_m;
  const Rect& bounds = config.map.bounds();
  const auto away = [&](const BodyState& state) {
    Vec3d place = state.position;
    place = {std::clamp(place.x, bounds.min_x, bounds.max_x), place.y, std::clamp(place.z, bounds.min_z, bounds.max_z)};
    const double crossing = Length(state.linear_velocity) * tick_s * kCrossingTicks;
    return config.map.DistanceTo(config.self, place) > far + crossing;
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const bool tied = catalog.AssemblyOf(body.def->id).size() > 1;
    if (tied && OwnedAssembly(i).front() != i) continue;  // the lowest says where they belong
    count += away(body.state) ? 1 : 0;
  }
  for (const auto& [key, grant] : unconfirmed) {
    if (catalog.AssemblyOf(key.first).front() != key.first) continue;
    count += away(grant.state) ? 1 : 0;
  }
  return count;
}

absl::StatusOr<Inventory> RegionStep::BeginFailover(const PartitionMap& map, std::span<const Standby* const> wards) {
  const MapVersion known = failover.has_value() ? failover->version() : config.map.version();
  const bool again = failover.has_value() && map.version() == known;
  if (map.version() <= known && !again) {
    return absl::FailedPreconditionError(
        absl::StrCat("map version ", map.version().value(), " is not above ", known.value()));
  }
  if (!again) {
    failover = map;
    change.Clear();
    inbox.Expect(map.version(), map.Neighbors(config.self));
  }
  Inventory inventory;
  inventory.version = map.version();
  inventory.region = config.self;
  inventory.tick = tick;
  WardInventory own = InventoryOf(State());
  inventory.owned = std::move(own.bodies);
  inventory.grants = std::move(own.grants);
  for (const Standby* ward : wards) {
    if (ward->whole()) inventory.wards.push_back(InventoryOf(ward->state()));
  }
  std::sort(inventory.wards.begin(), inventory.wards.end(),
            [](const WardInventory& a, const WardInventory& b) { return a.region < b.region; });
  return inventory;
}

// What is to be taken up here, by body; an error if any of it is not here.
absl::Status RegionStep::FindCopies(const Resolution& resolution, std::span<const Standby* const> wards,
                                    std::map<BodyId, KeptGrant>& copies) const {
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != config.self) continue;
    const auto missing = [&] {
      return absl::FailedPreconditionError(
          absl::StrCat("body ", takeover.body.value(), " is to be taken up and is not here"));
    };
    if (!catalog.Known(takeover.body)) return missing();
    const Standby* ward = WardOf(takeover.from, wards);
    if (takeover.from != RegionId() && ward == nullptr) return missing();
    const RegionState* state = ward == nullptr ? nullptr : &ward->state();
    if (takeover.revived) {
      const KeptGrant* copy = NewestGrant(state == nullptr ? unconfirmed : state->grants, takeover.body);
      if (copy == nullptr) return missing();
      copies[takeover.body] = *copy;
      continue;
    }
    const StateBody* body = state == nullptr ? nullptr : state->Find(takeover.body);
    if (body == nullptr) return missing();
    KeptGrant& copy = copies[takeover.body];
    copy.tick = state->tick;
    copy.state = body->state;
    copy.properties = state->PropertiesOf(takeover.body);
    if (IsPlayerBody(takeover.body)) copy.control = state->controls.at(PlayerOf(takeover.body));
    const auto reported_by = [&](const TouchingPair& pair) { return reports.ReporterOf(pair) == takeover.body; };
    std::copy_if(state->touching.begin(), state->touching.end(), std::back_inserter(copy.touching), reported_by);
  }
  return absl::OkStatus();
}

absl::StatusOr<StepResult> RegionStep::Resume(const Resolution& resolution, std::span<const Standby* const> wards) {
  if (!failover.has_value()) return absl::FailedPreconditionError("no failover is under way");
  if (resolution.version != failover->version()) {
    return absl::FailedPreconditionError(absl::StrCat("a resolution of version ", resolution.version.value(),
                                                      ", the failover is ", failover->version().value()));
  }
  if (resolution.resume_tick <= tick + 1) return absl::FailedPreconditionError("resume_tick: it has passed here");
  if (absl::Status status = CheckResolution(resolution); !status.ok()) return status;
  std::map<BodyId, KeptGrant> copies;
  if (absl::Status status = FindCopies(resolution, wards, copies); !status.ok()) return status;

  StepResult result;
  tick = Tick(resolution.resume_tick.value() - 1);
  result.tick = tick;
  // Every grant that is under way from here has been settled: its body is somebody else's, or revived here. One that
  // has come back since is owned by a higher epoch.
  for (const auto& [key, grant] : unconfirmed) {
    const std::ptrdiff_t index = bodies.IndexOf(key.first);
    if (index >= 0 && bodies.owned()[static_cast<std::size_t>(index)].epoch > key.second) continue;
    LetGo(key.first, grant.to, copies, result);
  }
  KeepPending(resolution, wards);
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != config.self) LetGo(takeover.body, takeover.region, copies, result);
  }
  for (const Takeover& takeover : resolution.takeovers) {
    if (takeover.region != config.self) continue;
    const bool left = IsPlayerBody(takeover.body) && players.HasLeft(PlayerOf(takeover.body));
    if (!left) TakeUp(takeover, copies.at(takeover.body));
  }
  for (const PlayerNumber player : resolution.players) players.MarkSpawned(player);
  for (const Standby* ward : wards) {
    for (const PlayerNumber player : ward->state().spawned) players.MarkSpawned(player);
  }
  handed_out.clear();
  taken_in.clear();
  border.clear();
  touching_.clear();
  touched_before_.clear();
  bodies.ForgetGrants();
  bodies.TieJoints();
  const PartitionMap map = *std::exchange(failover, std::nullopt);
  AdoptMap(map, true);
  log_.Restart();
  reports.TakeChanges();
  properties.TakeNews();
  acknowledged = Tick();
  Predict();
  ReleaseConfirmations();
  result.frames = MakeFrames();
  WriteLog(result);
  return result;
}

// It is owned elsewhere, or begins anew here.
void RegionStep::LetGo(BodyId id, RegionId to, const std::map<BodyId, KeptGrant>& copies, StepResult& result) {
  const std::ptrdiff_t index = bodies.IndexOf(id);
  if (index < 0) return;
  const Epoch epoch = bodies.owned()[static_cast<std::size_t>(index)].epoch;
  if (!copies.contains(id)) result.departures.push_back({id, epoch, DepartureReason::kHandedOver, to});
  if (IsPlayerBody(id)) players.Release(PlayerOf(id));
  reports.Release(id);
  properties.Release(id);
  bodies.RemoveOwned(id);
}

void RegionStep::TakeUp(const Takeover& takeover, const KeptGrant& copy) {
  bodies.Own(takeover.body, takeover.epoch, copy.state);
  rehearse_ = true;
  if (IsPlayerBody(takeover.body)) players.Adopt(PlayerOf(takeover.body), copy.control);
  properties.Adopt(takeover.body, copy.properties);
  reports.Adopt(copy.touching);
}

// What others have and have not confirmed is kept for the next failure; what came here so is to be confirmed.
void RegionStep::KeepPending(const Resolution& resolution, std::span<const Standby* const> wards) {
  KeptGrants kept;
  for (const PendingGrant& grant : resolution.pending) {
    if (grant.to == config.self) due_confirmations.push_back({grant.body, grant.epoch, grant.granter, tick});
    if (grant.granter != config.self) continue;
    const KeptGrant* copy = NewestGrant(unconfirmed, grant.body);
    for (const Standby* ward : wards) {
      const KeptGrant* theirs = NewestGrant(ward->state().grants, grant.body);
      if (theirs != nullptr && (copy == nullptr || theirs->tick > copy->tick)) copy = theirs;
    }
    if (copy == nullptr) continue;
    KeptGrant& again = kept[{grant.body, grant.epoch}] = *copy;
    again.to = grant.to;
  }
  unconfirmed = std::move(kept);
}

}  // namespace tessera::region

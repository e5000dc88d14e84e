#include "core/region/region.h"

#include <algorithm>
#include <cassert>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/region/claims.h"
#include "core/region/log.h"
#include "core/region/region_begin.h"
#include "core/region/region_parts.h"
#include "core/region/tick_end.h"

namespace tessera::region {

Region::Region(Config config) : parts_(std::make_unique<RegionParts>(config)) {
  if (config.initial == nullptr) {
    OwnFromScene(*parts_);
  } else {
    OwnFromState(*config.initial, *parts_);
  }
}
Region::~Region() = default;

RegionId Region::id() const { return parts_->self(); }
Tick Region::tick() const { return parts_->tick; }
const PartitionMap& Region::map() const { return parts_->neighborhood.map(); }
std::span<const RegionId> Region::neighbors() const { return parts_->neighborhood.neighbors(); }
const Catalog& Region::catalog() const { return parts_->catalog; }

std::vector<OutgoingFrame> Region::Start() {
  FindRelevant(*parts_);
  return MakeFrames(*parts_);
}

absl::Status Region::Receive(RegionId from, std::span<const std::uint8_t> frame) {
  RegionParts& parts = *parts_;
  const BorderFrame* taken = nullptr;
  if (absl::Status status = parts.borders.Put(from, frame, parts.tick, &taken); !status.ok()) return status;
  parts.map_change.Heard(parts.borders.newest_commit());
  if (taken == nullptr) return absl::OkStatus();
  absl::Status claims = CheckClaims(*taken, parts.bodies, parts.grants_out.departing(), parts.grants_in);
  if (!claims.ok()) parts.borders.Reject(from);
  return claims;
}

bool Region::CanStep() const { return !halted() && parts_->borders.Ready(); }
std::vector<RegionId> Region::WaitingFor() const { return parts_->borders.WaitingFor(); }

bool Region::NeighborsGoOn() const {
  const Borders& borders = parts_->borders;
  return borders.newest() > parts_->tick || borders.newest_commit() > map().version();
}

void Region::TakeLinkDown(RegionId neighbor) { parts_->borders.TakeDown(neighbor); }
bool Region::IsLinkUp(RegionId neighbor) const { return parts_->borders.IsUp(neighbor); }

absl::Status Region::QueueInput(const PlayerInput& input) { return parts_->players.Queue(input); }

std::uint32_t Region::LastInput(PlayerNumber player) const {
  const PlayerControl* control = parts_->players.Find(player);
  return control == nullptr ? 0 : control->last_input;
}

void Region::SpawnPlayer(PlayerNumber player, std::string_view name, std::span<const NamedProperty> properties) {
  assert(parts_->scene().player.has_value());
  PropertySet begins;
  for (const auto& [property, value] : properties) {
    // The control plane has checked them with the scene.
    [[maybe_unused]] const absl::Status ignored = begins.Set(parts_->scene().properties, property, value);
  }
  begins.set_player_name(std::string(name));
  parts_->players.Spawn(player, std::move(begins));
}

void Region::MarkSpawned(PlayerNumber player) { parts_->players.MarkSpawned(player); }
void Region::RemovePlayer(PlayerNumber player) { parts_->players.Leave(player); }
void Region::ParkPlayer(PlayerNumber player, bool parked) { parts_->players.Park(player, parked); }

// The grant of a body that is being handed over has left, with its properties: the new owner is to be asked.
absl::Status Region::SetProperty(BodyId body, std::string_view name, PropertyValue value, std::uint64_t change) {
  RegionParts& parts = *parts_;
  const bool world = body == kInstanceBody;
  if (world ? !OwnsWorld() : !Owns(body)) {
    return absl::NotFoundError(absl::StrCat("body ", body.value(), " is not owned here"));
  }
  if (FindDeparting(parts.grants_out.departing(), body) != nullptr) {
    return absl::NotFoundError(absl::StrCat("body ", body.value(), " is being handed over"));
  }
  const KeptRecord* const now = parts.records.Find(body);
  const std::optional<KeptRecord> before = now == nullptr ? std::nullopt : std::optional(*now);
  const std::vector<PropertyDef>& declared = world ? parts.scene().instance_properties : parts.scene().properties;
  absl::Status status = parts.records.Set(body, declared, name, std::move(value), change);
  if (!status.ok()) return status;
  const KeptRecord& after = *parts.records.Find(body);
  parts.output.Changed(before ? &*before : nullptr, after, parts.tick + 1);
  if (parts.catalog.has_game() && !world) parts.shared.Changed(before ? &*before : nullptr, after, parts.tick + 1);
  return status;
}
bool Region::OwnsWorld() const { return parts_->bodies.FindBodiless(kInstanceBody) != nullptr; }
std::optional<WorldProperties> Region::world_properties() const {
  return parts_->messages.WorldForClients(parts_->tick, committed_tick());
}
const RecordTable& Region::records() const { return parts_->records; }

const game::GameHost* Region::game() const { return parts_->game.host(); }
game::GameHost* Region::game() { return parts_->game.host(); }
void Region::PrepareGame(std::shared_ptr<game::GameHost> next) { parts_->game.Prepare(std::move(next)); }

std::vector<BodyId> Region::removed() const {
  std::vector<BodyId> removed = parts_->tombstones.SceneBodies(committed_tick());
  for (const OwnedBody& entity : parts_->bodies.bodiless()) {
    const BodyId id = entity.def->id;
    if (id.value() >= kFirstPlayerBody || parts_->game.LivedAfter(id, committed_tick())) continue;
    removed.insert(std::ranges::lower_bound(removed, id), id);
  }
  return removed;
}
const RelayStatistics& Region::messages() const { return parts_->messages.statistics(); }

const OutputCommit& Region::output() const { return parts_->output; }
Tick Region::committed_tick() const { return parts_->log.standby_has().value_or(parts_->tick); }

void Region::SetStandby(bool on) {
  parts_->log.Switch(on);
  parts_->reports.KeepChanges(on);
  parts_->reports.TakeChanges();
  parts_->records.KeepNews(on);
}
void Region::LogAcknowledged(Tick tick) { parts_->log.Acknowledged(tick, parts_->tick); }
Tick Region::acknowledged() const { return parts_->log.acknowledged(); }
Bytes Region::WriteLogStanding() {
  return !halted() && parts_->log.on() && parts_->log.whole() ? WriteLog(*parts_) : Bytes();
}
Bytes Region::SaveState() const { return EncodeState(StateOf(*parts_)); }

void Region::InspectGame(absl::FunctionRef<void(const tessera_game_host&, tessera_game_call*)> act) const {
  parts_->game.Inspect(parts_->tick, act);
}

MapVersion Region::announced() const { return parts_->map_change.announced(); }
bool Region::committed() const { return parts_->map_change.committed(); }
bool Region::halted() const { return parts_->failover.under_way(); }

std::span<const OwnedBody> Region::owned() const { return parts_->bodies.owned(); }
bool Region::Owns(BodyId body) const { return parts_->bodies.IndexOf(body) >= 0; }
std::size_t Region::asleep_count() const {
  const auto asleep = [](const OwnedBody& body) { return body.state.asleep; };
  return static_cast<std::size_t>(std::ranges::count_if(owned(), asleep));
}
std::size_t Region::ghost_count() const { return parts_->bodies.ghosts().size(); }
const physics::World& Region::world() const { return parts_->bodies.world(); }
std::vector<physics::PairEvent> Region::touching() const {
  std::vector<physics::PairEvent> touching;
  for (const TouchingPair& pair : parts_->reports.All()) {
    touching.push_back({pair.body_a, pair.body_b, pair.trigger, true});
  }
  return touching;
}
std::span<const OwedImpulse> Region::owed() const { return parts_->exchange.owed(); }

}  // namespace tessera::region

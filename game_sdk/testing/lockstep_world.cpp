#include "game_sdk/testing/lockstep_world.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/region/catalog.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

using region::Region;
using region::StepResult;

// Functions that change nothing, so that calling them once is enough.
constexpr std::array<std::uint32_t, 32> kReads = {
    kWorldTick,      kWorldTickRate,    kWorldRandom,        kWorldRay,     kWorldRayAll,
    kWorldSweep,     kWorldOverlap,     kBodyIsHere,         kBodyIsOwn,    kBodyKind,
    kBodyPosition,   kBodyRotation,     kBodyVelocity,       kBodySpin,     kBodyMass,
    kBodyPlayer,     kBodyGet,          kBodyMember,         kWorldPlayers, kPlayerName,
    kPlayerBody,     kPlayerIsOwn,      kPlayerIsSpectating, kWorldTime,    kWorldGet,
    kWorldIsOwn,     kPlayerInput,      kPlayerShownTime,    kPlayerNumber, kBodyIsConnected,
    kBodyController, kPlayerControlled,
};

// The body that a call of this function is for; nothing for those of the world.
std::optional<BodyId> BodyOfCall(const Function& function, std::span<const tessera_game_value> arguments) {
  if (function.receiver == Receiver::kWorld || arguments.empty()) return std::nullopt;
  const std::uint64_t id = arguments.front().as.id;
  if (function.receiver == Receiver::kBody) return BodyId(id);
  return PlayerBodyId(PlayerNumber(static_cast<std::uint32_t>(id)));
}

// A watched module has no movement, so that the inner one's comes with the file.
GameFile WithMovementOf(const tessera_game_module& module, GameFile game) {
  if (game.movement == nullptr) game.movement = OwnMovement(module);
  return game;
}

bool Succeeds(const tessera_game_host& host, tessera_game_call* call, std::uint32_t function,
              std::span<const tessera_game_value> arguments, tessera_game_value& result) {
  result = {};
  return host.call(call, function, arguments.data(), static_cast<std::uint32_t>(arguments.size()), &result) == 0;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LockstepWorld>> LockstepWorld::Create(const tessera_game_module& module, GameFile game,
                                                                     std::shared_ptr<const Scene> scene,
                                                                     const LockstepOptions& options) {
  auto world = std::unique_ptr<LockstepWorld>(new LockstepWorld(module, std::move(game), std::move(scene), options));
  if (absl::Status status = world->Begin(nullptr); !status.ok()) return status;
  return world;
}

LockstepWorld::LockstepWorld(const tessera_game_module& module, GameFile game, std::shared_ptr<const Scene> scene,
                             const LockstepOptions& options)
    : module_(module),
      game_(WithMovementOf(module, std::move(game))),
      scene_(std::move(scene)),
      options_(options),
      random_(options.seed) {}

LockstepWorld::~LockstepWorld() = default;

absl::Status LockstepWorld::Begin(std::shared_ptr<const region::RegionState> initial) {
  absl::StatusOr<PartitionMap> map = MakeGridMap(scene_->ground(), options_.regions);
  if (!map.ok()) return map.status();
  const WatchScope scope(module_, *this);
  std::map<RegionId, Member> begun;
  for (const MapRegion& entry : map->regions()) {
    auto host = GameHost::Load(WatchedModule(), game_, scene_, options_.settings, options_.seed);
    if (!host.ok()) return host.status();
    Member& member = begun[entry.id];
    member.host = *std::move(host);
    region::Config config{entry.id, Incarnation(++incarnations_), scene_, *map, {}, initial};
    config.game = member.host;
    member.region = std::make_unique<Region>(std::move(config));
  }
  map_ = *std::move(map);
  regions_ = std::move(begun);
  std::vector<std::pair<RegionId, std::vector<region::OutgoingFrame>>> frames;
  for (auto& [id, member] : regions_) {
    Protect(member);
    frames.emplace_back(id, member.region->Start());
  }
  for (const auto& [id, sent] : frames) {
    if (absl::Status status = Deliver(id, sent); !status.ok()) return status;
  }
  return absl::OkStatus();
}

void LockstepWorld::Protect(Member& member) {
  member.region->SetStandby(map_.Find(member.region->id())->standby != RegionId());
}

absl::Status LockstepWorld::Deliver(RegionId from, const std::vector<region::OutgoingFrame>& frames) {
  for (const region::OutgoingFrame& frame : frames) {
    const auto to = regions_.find(frame.to);
    if (to == regions_.end()) continue;
    if (absl::Status status = to->second.region->Receive(from, frame.bytes); !status.ok()) {
      return absl::InternalError(absl::StrCat("region ", frame.to.value(), " refuses a frame of region ", from.value(),
                                              ": ", status.message()));
    }
  }
  return absl::OkStatus();
}

absl::Status LockstepWorld::Distribute(RegionId from, const StepResult& result) {
  if (absl::Status status = Deliver(from, result.frames); !status.ok()) return status;
  const auto standby = regions_.find(map_.Find(from)->standby);
  if (result.log.empty() || standby == regions_.end()) return absl::OkStatus();
  region::StandbyCopy& copy =
      standby->second.copies.try_emplace(from, from, standby->second.region->catalog()).first->second;
  if (absl::Status status = copy.Receive(result.log); !status.ok()) {
    return absl::InternalError(absl::StrCat("the standby of region ", from.value(), ": ", status.message()));
  }
  regions_.at(from).region->LogAcknowledged(copy.tick());
  return absl::OkStatus();
}

absl::Status LockstepWorld::Step() {
  for (const auto& [player, name] : std::exchange(joining_, {})) {
    regions_.begin()->second.region->SpawnPlayer(player, name);
  }
  GiveCommands();
  pending_error_.clear();
  std::vector<std::pair<RegionId, StepResult>> results;
  for (auto& [id, member] : regions_) {
    if (!member.region->CanStep()) return absl::InternalError(absl::StrCat("region ", id.value(), " cannot step"));
    acting_ = id;
    results.emplace_back(id, member.region->Step());
    handovers_ += results.back().second.handed_out;
    for (GameLine& line : member.host->TakeLines()) lines_.push_back(std::move(line));
  }
  const bool all_done = std::ranges::all_of(pending_, &PendingCall::done);
  pending_.clear();
  for (const auto& [id, result] : results) {
    if (absl::Status status = Distribute(id, result); !status.ok()) return status;
  }
  // There is no backend, and nobody is to run out of room for its events.
  for (auto& [id, member] : regions_) {
    member.region->AcknowledgePublished(std::numeric_limits<std::uint64_t>::max());
  }
  HearGame();
  if (!pending_error_.empty()) return absl::InvalidArgumentError(pending_error_);
  if (!all_done) return absl::InvalidArgumentError("a body that was to be changed is gone");
  return options_.deaths ? Disturb() : absl::OkStatus();
}

// --- The game

const Region& LockstepWorld::RegionFor(const Function& function, std::span<const tessera_game_value> arguments) const {
  if (const std::optional<BodyId> body = BodyOfCall(function, arguments)) {
    const auto owner = regions_.find(OwnerOf(*body));
    if (owner != regions_.end()) return *owner->second.region;
  }
  return *regions_.begin()->second.region;
}

bool LockstepWorld::Concerns(const PendingCall& pending, const tessera_game_host& host, tessera_game_call* call) const {
  if (const std::optional<BodyId> body = BodyOfCall(*FindFunction(pending.function), pending.arguments.Expose())) {
    const BodyDef* def = regions_.begin()->second.region->catalog().Find(*body);
    const tessera_game_value argument = ToInterface(GameValue(*body));
    tessera_game_value own{};
    if (def == nullptr || def->motion == Motion::kDynamic) {
      return Succeeds(host, call, kBodyIsOwn, {&argument, 1}, own) && own.as.whole != 0;
    }
  }
  return acting_ == regions_.begin()->first;
}

void LockstepWorld::AtTick(const tessera_game_host& host, tessera_game_call* call) {
  for (PendingCall& pending : pending_) {
    if (pending.done || !Concerns(pending, host, call)) continue;
    pending.done = true;
    tessera_game_value result{};
    if (Succeeds(host, call, pending.function, pending.arguments.Expose(), result)) continue;
    if (pending_error_.empty()) pending_error_ = host.error(call);
  }
}

bool LockstepWorld::WantsFreshState() {
  if (!options_.fresh_states) return false;
  return ++callbacks_ <= kAlwaysFresh || random_() % kThenFreshOf == 0;
}

bool LockstepWorld::Call(std::uint32_t function, std::span<const tessera_game_value> arguments, KeptValue& result,
                         std::string& error) {
  const Region& asked = RegionFor(*FindFunction(function), arguments);
  acting_ = asked.id();
  bool done = false;
  asked.InspectGame([&](const tessera_game_host& host, tessera_game_call* call) {
    tessera_game_value value{};
    for (const PendingCall& pending : pending_) {
      if (Concerns(pending, host, call)) Succeeds(host, call, pending.function, pending.arguments.Expose(), value);
    }
    done = Succeeds(host, call, function, arguments, value);
    if (done) {
      result = KeptValue(value);
    } else {
      error = host.error(call);
    }
  });
  const bool reads = std::ranges::find(kReads, function) != kReads.end();
  if (done && !reads) {
    pending_.push_back({function, KeptArguments(arguments.data(), arguments.size())});
  }
  return done;
}

std::vector<GameLine> LockstepWorld::TakeLines() { return std::exchange(lines_, {}); }

// --- What is there

Tick LockstepWorld::tick() const { return regions_.begin()->second.region->tick(); }

RegionId LockstepWorld::OwnerOf(BodyId body) const {
  for (const auto& [id, member] : regions_) {
    if (member.region->Owns(body)) return id;
  }
  return {};
}

void LockstepWorld::ForEachBody(absl::FunctionRef<void(const region::OwnedBody&)> visit) const {
  std::map<BodyId, const region::OwnedBody*> bodies;
  for (const auto& [id, member] : regions_) {
    for (const region::OwnedBody& body : member.region->owned()) bodies[body.def->id] = &body;
  }
  for (const auto& [id, body] : bodies) visit(*body);
}

std::vector<std::pair<std::string, PropertyValue>> LockstepWorld::PropertiesOf(BodyId body) const {
  const auto owner = regions_.find(OwnerOf(body));
  const Region& region = owner == regions_.end() ? *regions_.begin()->second.region : *owner->second.region;
  const region::KeptRecord* record = region.records().Find(body);
  PropertySet changed;
  if (record != nullptr) changed = PropertySet::Decode(*record->bytes, scene_->properties).value_or(PropertySet());
  const BodyDef* def = region.catalog().Find(body);
  std::vector<std::pair<std::string, PropertyValue>> values;
  for (const PropertyDef& property : scene_->properties) {
    values.emplace_back(property.name, *ValueOf(scene_->properties, def == nullptr ? PropertySet() : def->properties,
                                                changed, property.name));
  }
  return values;
}

std::uint64_t LockstepWorld::Hash() const {
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a
  for (const auto& [id, member] : regions_) {
    for (const std::uint8_t byte : member.region->SaveState()) hash = (hash ^ byte) * 0x100000001b3;
  }
  return hash;
}

}  // namespace tessera::game

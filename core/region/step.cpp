#include "core/region/step.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/region/fields.h"

namespace tessera::region {
namespace {

// Of the contacts of bodies that come out of a saved state. A pile of 1240 moves by .05 mm in the next tick then, by
// .8 after none.
constexpr int kRehearsals = 6;

double ToGrid(double v) { return std::round(v / kOriginGrid_m) * kOriginGrid_m; }

Vec3d OriginFor(const Config& config) {
  const Aabb& bounds = config.scene->bounds;
  Vec3d center = (bounds.min + bounds.max) * 0.5;
  if (!config.settings.shared_origin) {
    Rect area;
    bool first = true;
    for (const Cell& cell : config.map.cells()) {
      if (cell.owner != config.self) continue;
      const Rect& more = cell.area;
      area = first ? more
                   : Rect{std::min(area.min_x, more.min_x), std::min(area.min_z, more.min_z),
                          std::max(area.max_x, more.max_x), std::max(area.max_z, more.max_z)};
      first = false;
    }
    if (!first) center = {(area.min_x + area.max_x) / 2, center.y, (area.min_z + area.max_z) / 2};
  }
  return {ToGrid(center.x), ToGrid(center.y), ToGrid(center.z)};
}

physics::Settings WorldSettings(const Config& config) {
  physics::Settings settings;
  settings.origin = OriginFor(config);
  settings.gravity_m_s2 = config.scene->gravity_m_s2;
  return settings;
}

}  // namespace

RegionStep::RegionStep(Config config_in)
    : config(std::move(config_in)),
      neighbors(config.map.Neighbors(config.self)),
      grantable(neighbors),
      tick_s(1.0 / config.scene->tick_rate_hz),
      catalog(config.scene),
      bodies(catalog, WorldSettings(config)),
      players(*config.scene),
      inbox(config.self, neighbors, config.map.version(), catalog),
      reports(catalog),
      reach(config.map, config.self, neighbors, config.settings, tick_s),
      outboxes_(neighbors.size()),
      log_(tick_s) {
  OwnInitial();
  bodies.TieJoints();
}

void RegionStep::OwnInitial() {
  if (config.initial == nullptr) {
    for (const BodyDef& def : config.scene->bodies) {
      if (def.motion != Motion::kDynamic) continue;
      const BodyDef* anchor = catalog.Find(catalog.AssemblyOf(def.id).front());
      if (config.map.OwnerOf(anchor->initial.position) == config.self) bodies.Own(def.id, Epoch(1), def.initial);
    }
    return;
  }
  const RegionState& initial = *config.initial;
  tick = initial.tick;
  inbox.ChangeMap(config.map.version(), neighbors, true);
  for (const StateBody& body : initial.bodies) {
    // The lowest that is there: others of the assembly may have been taken out.
    const StateBody* anchor = nullptr;
    for (const BodyId id : catalog.AssemblyOf(body.id)) {
      if (anchor == nullptr) anchor = initial.Find(id);
    }
    // A state of this region alone is taken whole: what lies a little beyond its cells is in nobody else's.
    const bool mine = initial.region == config.self || config.map.OwnerOf(anchor->state.position) == config.self;
    if (!mine) continue;
    bodies.Own(body.id, body.epoch, body.state);
    rehearse_ = true;
    if (IsPlayerBody(body.id)) players.Adopt(PlayerOf(body.id), initial.controls.at(PlayerOf(body.id)));
    // Whoever orders changes from here on counts anew: the state may be another cluster's.
    CarriedProperties changed = initial.PropertiesOf(body.id);
    changed.change = std::min<std::uint64_t>(changed.change, 1);
    properties.Adopt(body.id, changed);
  }
  for (const PlayerNumber player : initial.spawned) players.MarkSpawned(player);
  const auto reported_here = [&](const TouchingPair& pair) { return bodies.Owns(reports.ReporterOf(pair)); };
  std::vector<TouchingPair> touching;
  std::copy_if(initial.touching.begin(), initial.touching.end(), std::back_inserter(touching), reported_here);
  reports.Adopt(touching);
}

std::vector<OutgoingFrame> RegionStep::Start() {
  Predict();
  return MakeFrames();
}

StepResult RegionStep::Step(const PhaseObserver& observer) {
  const auto enter = [&](Phase phase) {
    if (observer) observer(phase);
  };
  StepResult result;
  enter(Phase::kPlaceGhosts);
  const Frames frames = TakeFrames();
  HandOut(result);
  TakeIn(frames, result);
  PlaceGhosts(frames);
  bodies.TieJoints();
  bodies.NotePlaces();
  ExchangeImpulses(frames);
  UpdatePlayers(result);
  bodies.NotePlaces();
  ApplyForces();
  enter(Phase::kPhysics);
  if (std::exchange(rehearse_, false)) bodies.world().Rehearse(tick_s, kRehearsals);
  bodies.world().Step(tick_s);
  stepped_ = true;
  stepped_places_ = bodies.owned().size() + bodies.ghosts().size();
  ++tick;
  result.tick = tick;
  ReadBack(result);
  enter(Phase::kPrediction);
  MeasurePrediction(result);
  CommitInputs();
  ChangeMapIfDue();
  DecideHandovers();
  Predict();
  enter(Phase::kFrames);
  NoteContacts();
  ReleaseConfirmations();
  result.frames = MakeFrames();
  WriteLog(result);
  enter(Phase::kDone);
  return result;
}

absl::Status RegionStep::CheckClaims(const Frame& frame) const {
  const auto owned_here = [this](BodyId id) { return bodies.Owns(id) && FindHandedOut(id) == nullptr; };
  for (const GhostRecord& ghost : frame.ghosts) {
    if (owned_here(ghost.id)) {
      return absl::PermissionDeniedError(absl::StrCat("body ", ghost.id.value(), " is owned here"));
    }
  }
  const std::ptrdiff_t neighbor = NeighborIndex(frame.sender);
  for (const Grant& grant : frame.grants) {
    for (const GrantedBody& body : grant.bodies) {
      if (neighbor >= 0 && IsRepeat(static_cast<std::size_t>(neighbor), body)) continue;
      if (owned_here(body.id)) {
        return absl::PermissionDeniedError(absl::StrCat("body ", body.id.value(), " is owned here and granted"));
      }
      const Ghost* ghost = bodies.FindGhost(body.id);
      if (ghost != nullptr && body.epoch <= ghost->record.epoch) {
        return absl::PermissionDeniedError(absl::StrCat("body ", body.id.value(), " is granted with epoch ",
                                                        body.epoch.value(), " after ", ghost->record.epoch.value()));
      }
    }
  }
  return absl::OkStatus();
}

// What a grant has told already cannot be changed any more; the new owner is to be asked.
absl::Status RegionStep::SetProperty(BodyId id, std::string_view name, PropertyValue value,
                                     std::uint64_t change_number) {
  if (!bodies.Owns(id)) return absl::NotFoundError(absl::StrCat("body ", id.value(), " is not owned here"));
  if (FindHandedOut(id) != nullptr) {
    return absl::NotFoundError(absl::StrCat("body ", id.value(), " is being handed over"));
  }
  return properties.Set(id, config.scene->properties, name, std::move(value), change_number);
}

RegionStep::Frames RegionStep::TakeFrames() {
  Frames frames;
  frames.reserve(neighbors.size());
  const Tick before = tick;
  bool jumped = false;
  for (std::size_t i = 0; i < neighbors.size(); ++i) {
    frames.push_back(inbox.link(i).Take(before));
    // Who is behind adopts the later tick.
    jumped = jumped || frames.back().tick > before;
    tick = std::max(tick, frames.back().tick);
    std::erase_if(outboxes_[i].unheard, [&](const auto& sent) {
      return frames.back().sender != RegionId() && sent.second < frames.back().stamp.number;
    });
    for (const Confirmation& confirmation : frames.back().confirmations) {
      const auto grant = unconfirmed.find({confirmation.id, confirmation.epoch});
      if (grant == unconfirmed.end() || grant->second.to != neighbors[i]) continue;
      unconfirmed.erase(grant);
      // Who granted it here may forget it too, whether or not our heir has ever had it.
      for (DueConfirmation& due : due_confirmations) {
        if (due.id == confirmation.id && due.epoch < confirmation.epoch) due.since = Tick();
      }
    }
  }
  for (std::size_t i = 0; jumped && i < neighbors.size(); ++i) inbox.link(i).Jumped();
  return frames;
}

void RegionStep::HandOut(StepResult& result) {
  for (const HandedOut& out : handed_out) {
    const BodyId id = out.record.id;
    if (!bodies.Owns(id)) continue;
    if (IsPlayerBody(id)) {
      for (const QueuedInput& input : players.Release(PlayerOf(id))) {
        if (Outbox* box = OutboxTo(out.to); box != nullptr) box->inputs.push_back({id, input});
      }
    }
    const auto rest = std::find_if(owed.begin(), owed.end(), [id](const OwedImpulse& one) { return one.id == id; });
    if (rest != owed.end()) {
      // It is for where the body will be in a tick; AddLate takes it to be a tick and a half old then.
      const Vec3d moved = out.record.state.position - rest->at;
      SendLate(out, -0.5, rest->impulse_ns, rest->angular_nms - Cross(moved, rest->impulse_ns));
      owed.erase(rest);
    }
    reports.Release(id);
    result.departures.push_back({id, Epoch(out.record.epoch.value() - 1), DepartureReason::kHandedOver, out.to});
    bodies.BecomeGhost(out.record, out.to);
    properties.Release(id);
    ++result.handed_out;
  }
}

void RegionStep::TakeIn(const Frames& frames, StepResult& result) {
  taken_in.clear();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (const Grant& grant : frames[i].grants) {
      bool news = false;
      for (const GrantedBody& body : grant.bodies) {
        if (IsRepeat(i, body)) {
          if (!Confirms(i, body)) due_confirmations.push_back({body.id, body.epoch, neighbors[i], tick + 1});
          continue;
        }
        if (bodies.Owns(body.id)) continue;  // two neighbours grant one body: the first counts
        news = true;
        // Who granted it sends what it is still to get.
        std::erase_if(owed, [&](const OwedImpulse& rest) { return rest.id == body.id; });
        bodies.Own(body.id, body.epoch, body.state);
        ForgetGrantsBefore(body.id, body.epoch);
        taken_in.push_back(body.id);
        due_confirmations.push_back({body.id, body.epoch, neighbors[i], tick + 1});
        if (IsPlayerBody(body.id)) players.Adopt(PlayerOf(body.id), grant.control);
        properties.Adopt(body.id, body.properties);
        ++result.handed_in;
      }
      if (news) reports.Adopt(grant.touching);
    }
    for (const ForwardedInput& forwarded : frames[i].inputs) {
      players.QueueForwarded(PlayerOf(forwarded.body), forwarded.input);
    }
  }
  std::sort(taken_in.begin(), taken_in.end());
}

void RegionStep::PlaceGhosts(const Frames& frames) {
  struct Shown {
    BodyId id;
    Epoch epoch;
    RegionId owner;
    const GhostRecord* told;  // null: of a closed border, goes on by what this region made of it
  };
  std::vector<Shown> shown;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (const GhostRecord& record : frames[i].ghosts) {
      if (!bodies.Owns(record.id)) shown.push_back({record.id, record.epoch, neighbors[i], &record});
    }
    if (inbox.link(i).open()) continue;
    for (const Ghost& ghost : bodies.ghosts()) {
      if (ghost.owner == neighbors[i]) shown.push_back({ghost.record.id, ghost.record.epoch, ghost.owner, nullptr});
    }
  }
  // One body shown by two: the higher epoch is right.
  std::stable_sort(shown.begin(), shown.end(),
                   [](const Shown& a, const Shown& b) { return a.id != b.id ? a.id < b.id : a.epoch > b.epoch; });
  const auto same = [](const Shown& a, const Shown& b) { return a.id == b.id; };
  shown.erase(std::unique(shown.begin(), shown.end(), same), shown.end());
  std::vector<Ghost> ghosts;
  ghosts.reserve(shown.size());
  for (const Shown& one : shown) {
    Ghost& ghost = ghosts.emplace_back(Ghost{.record = {}, .owner = one.owner, .told = one.told != nullptr});
    if (one.told != nullptr) {
      ghost.record = *one.told;
    } else {
      ghost.record.id = one.id;
      ghost.record.epoch = one.epoch;
      ghost.record.state = bodies.world().StateOf(one.id);
    }
  }
  bodies.PlaceGhosts(ghosts);
}

void RegionStep::UpdatePlayers(StepResult& result) {
  for (const PlayerNumber player : players.left()) {
    const BodyId id = PlayerBodyId(player);
    const std::ptrdiff_t index = bodies.IndexOf(id);
    if (index < 0) continue;
    const Epoch epoch = bodies.owned()[static_cast<std::size_t>(index)].epoch;
    result.departures.push_back({id, epoch, DepartureReason::kRemoved, RegionId()});
    players.Release(player);
    properties.Release(id);
    bodies.RemoveOwned(id);
  }
  for (const PlayerNumber player : players.TakeSpawns()) {
    const BodyId id = PlayerBodyId(player);
    if (bodies.Owns(id) || bodies.FindGhost(id) != nullptr) continue;
    bodies.Own(id, Epoch(1), catalog.MakePlayer(player).initial);
    players.Adopt(player, {});
  }
  physics::World& world = bodies.world();
  for (const PlayerNumber player : players.TakeUnparked()) {
    if (world.Has(PlayerBodyId(player))) world.Unpark(PlayerBodyId(player));
  }
  for (const PlayerNumber player : players.parked()) {
    if (!world.Has(PlayerBodyId(player)) || world.IsParked(PlayerBodyId(player))) continue;
    world.Park(PlayerBodyId(player));
    reports.BodyLeft(PlayerBodyId(player));
  }
}

void RegionStep::ApplyForces() {
  const std::vector<Field>& fields = config.scene->fields;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const BodyId id = body.def->id;
    if (fields.empty() && !IsPlayerBody(id)) continue;
    Vec3f force, torque;
    if (const PlayerControl* control = ControlOf(id); control != nullptr) {
      force = control->force_n;
      torque = control->torque_nm;
      players.Applied(PlayerOf(id));
    }
    if (!fields.empty() && !body.state.asleep) force += Vec3f(FieldOn(i) * body.def->mass_kg);
    bodies.world().ApplyForce(id, force, torque);
  }
  const auto per_tick = static_cast<float>(1 / tick_s);
  for (const Ghost& ghost : bodies.ghosts()) {
    const GhostRecord& told = ghost.record;
    Vec3f force = told.force_n, torque = told.torque_nm;
    // One that came to rest here a tick before it does with its owner is not woken by what it carries.
    const BodyState state = bodies.world().StateOf(told.id);
    if (!state.asleep) {
      force += told.load_ns * per_tick;
      torque += told.load_nms * per_tick;
      if (!fields.empty()) force += Vec3f(FieldAcceleration(fields, state) * ghost.def->mass_kg);
    }
    bodies.world().ApplyForce(told.id, force, torque);
  }
}

Vec3d RegionStep::FieldOn(std::size_t index) {
  OwnedExtra& extra = bodies.extras()[index];
  if (!extra.field_known) extra.field_m_s2 = FieldAcceleration(config.scene->fields, bodies.owned()[index].state);
  extra.field_known = true;
  return extra.field_m_s2;
}

void RegionStep::ReadBack(StepResult& result) {
  for (const BodyId id : bodies.TakeLeft()) reports.BodyLeft(id);
  result.events = reports.Report(
      bodies.world().events(), [this](BodyId id) { return bodies.Owns(id); },
      [this](BodyId id) { return bodies.world().Has(id); });
  for (const auto& [id, epoch] : bodies.ReadBack()) {
    result.departures.push_back({id, epoch, DepartureReason::kRemoved, RegionId()});
    result.nonfinite.push_back(id);
    if (IsPlayerBody(id)) players.Release(PlayerOf(id));
    properties.Release(id);
  }
}

const RegionStep::HandedOut* RegionStep::FindHandedOut(BodyId id) const {
  const auto it = std::lower_bound(handed_out.begin(), handed_out.end(), id,
                                   [](const HandedOut& out, BodyId wanted) { return out.record.id < wanted; });
  return it != handed_out.end() && it->record.id == id ? &*it : nullptr;
}

std::ptrdiff_t RegionStep::NeighborIndex(RegionId id) const {
  const auto it = std::lower_bound(neighbors.begin(), neighbors.end(), id);
  return it != neighbors.end() && *it == id ? it - neighbors.begin() : -1;
}

RegionStep::Outbox* RegionStep::OutboxTo(RegionId id) {
  const std::ptrdiff_t index = NeighborIndex(id);
  return index < 0 ? nullptr : &outboxes_[static_cast<std::size_t>(index)];
}

const PlayerControl* RegionStep::ControlOf(BodyId id) const {
  return IsPlayerBody(id) ? players.Find(PlayerOf(id)) : nullptr;
}

}  // namespace tessera::region

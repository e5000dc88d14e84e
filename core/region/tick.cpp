// One tick of a region: the order in which its parts are put to work, as docs/architecture.md describes it.
#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

#include "core/region/game_control.h"
#include "core/region/game_joints.h"
#include "core/region/game_motion.h"
#include "core/region/ghosts.h"
#include "core/region/handover.h"
#include "core/region/region_map.h"
#include "core/region/region_parts.h"
#include "core/region/tick_end.h"

namespace tessera::region {
namespace {

// The neighbours' frames of the tick before. Who is behind adopts the later tick.
std::vector<BorderFrame> TakeFrames(RegionParts& parts) {
  auto [frames, tick] = parts.borders.Take(parts.tick);
  parts.tick = tick;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    const RegionId from = parts.neighborhood[n];
    if (frames[n].sender != RegionId()) parts.grants_in.Heard(from, frames[n].stamp.number);
    parts.shared.Take(frames[n].properties);
    for (const GrantAcknowledgement& acknowledgement : frames[n].acknowledgements) {
      if (!parts.grants_out.Acknowledged(from, acknowledgement)) continue;
      parts.grants_in.WentOn(acknowledgement.id, acknowledgement.epoch);
    }
  }
  return std::move(frames);
}

// Handovers that the last tick decided take effect here.
void HandOut(RegionParts& parts, StepResult& result) {
  for (const DepartingBody& body : parts.grants_out.departing()) {
    const bool bodiless = parts.bodies.FindBodiless(body.record.id) != nullptr;
    const KeptRecord* const record = parts.records.Find(body.record.id);
    if (record != nullptr && !bodiless) parts.shared.GoesOnAsGhost(*record);
    const auto [departure, late_inputs] = parts.ownership.HandOver(body);
    parts.messages.HandedOver(body.record.id, body.to, parts.tick + 1);
    if (bodiless) continue;
    for (const PlayerInput& input : late_inputs) parts.outgoing.Add(body.to, input);
    if (const auto late = parts.exchange.PassOn(body)) parts.outgoing.Add(late->to, late->late);
    result.departures.push_back(departure);
    ++result.handed_out;
  }
}

// Grants of the neighbours take effect here.
void TakeIn(std::span<const BorderFrame> frames, RegionParts& parts, StepResult& result) {
  parts.grants_in.StartStep();
  for (std::size_t n = 0; n < frames.size(); ++n) {
    for (const Grant& grant : frames[n].grants) {
      const auto fresh = parts.grants_in.Accept(parts.neighborhood[n], grant, parts.bodies, parts.tick + 1);
      for (const GrantedBody* body : fresh) {
        parts.exchange.Forget(body->id);
        parts.grants_out.ForgetBefore(body->id, body->epoch);
        parts.ownership.Take(*body, grant.control);
        parts.messages.TakenIn(body->id, parts.neighborhood[n], parts.tick + 1);
        if (parts.bodies.FindBodiless(body->id) == nullptr) ++result.handed_in;
      }
      if (fresh.empty()) continue;
      // The contacts of a body that was put elsewhere have ended, and nobody has said so yet.
      const bool jumped = std::ranges::any_of(fresh, [](const GrantedBody* body) { return body->record.game.jumped; });
      if (jumped) {
        parts.reports.Restore(grant.touching);
      } else {
        parts.reports.Adopt(grant.touching);
      }
    }
    for (const PlayerInput& input : frames[n].inputs) parts.players.QueueForwarded(input);
  }
  for (std::size_t n = 0; n < frames.size(); ++n) {
    parts.messages.Receive(parts.neighborhood[n], frames[n].packets, parts.tick + 1);
    parts.blasts.Receive(frames[n].packets, parts.tick + 1);
  }
}

void PlaceGhosts(std::span<const BorderFrame> frames, RegionParts& parts) {
  const auto link_up = [&](std::size_t n) { return parts.borders.IsUp(n); };
  parts.bodies.PlaceGhosts(GhostsFrom(frames, parts.neighborhood.neighbors(), link_up, parts.bodies));
  parts.shared.KeepOnly(parts.bodies.ghosts());
  parts.bodies.ConnectJoints();
  if (parts.catalog.has_game()) {
    ConnectGameJoints(parts.records, parts.bodies);
    FindDriven(parts);
  }
  parts.bodies.NotePlaces();
}

// Balances the impulses of the last step at contacts across borders.
void ExchangeImpulses(std::span<const BorderFrame> frames, RegionParts& parts) {
  const ImpulseExchange::Settlement settlement =
      parts.exchange.Settle({parts.bodies, parts.neighborhood, frames, parts.grants_out.departing(),
                             parts.grants_in.taken_in(), parts.borders.LinksUp()});
  for (const auto& [to, late] : settlement.late) parts.outgoing.Add(to, late);
  for (const auto& [id, force, torque] : settlement.pushes) parts.bodies.ApplyForce(id, force, torque);
}

// Players whom a game keeps out of the world stand aside, and those whom it does not any more take part.
void ParkHidden(RegionParts& parts) {
  for (const BodyId id : parts.records.hidden()) {
    if (parts.bodies.Park(id)) parts.reports.BodyLeft(id);
  }
  for (const BodyId id : parts.players.SetHidden(parts.records.hidden())) {
    if (parts.bodies.Owns(id) && !parts.players.parked().contains(PlayerOf(id))) parts.bodies.Unpark(id);
  }
}

// Players' bodies come and go, and are parked. Returns who came, and whose leave the game is to be told of before the
// body goes.
game::PlayerChanges UpdatePlayers(RegionParts& parts, StepResult& result) {
  RegionPlayers& players = parts.players;
  Bodies& bodies = parts.bodies;
  game::PlayerChanges changes;
  const bool game_takes_leave = parts.game.TakesLeave();
  for (const PlayerNumber player : players.left()) {
    const BodyId id = PlayerBodyId(player);
    if (bodies.IndexOf(id) < 0) continue;  // the record of one who has messages under way is no body
    if (game_takes_leave) {
      changes.leaving.push_back(player);
    } else {
      result.departures.push_back(parts.ownership.Remove(id));
    }
  }
  for (const auto& [player, begins] : players.TakeSpawns()) {
    const BodyId id = PlayerBodyId(player);
    if (bodies.Owns(id) || bodies.FindGhost(id) != nullptr) continue;
    parts.ownership.Spawn(player, begins);
    parts.game.NoteMade(id);
    changes.joined.push_back(player);
  }
  for (const PlayerNumber player : players.TakeUnparked()) bodies.Unpark(PlayerBodyId(player));
  for (const PlayerNumber player : players.parked()) {
    if (bodies.Park(PlayerBodyId(player))) parts.reports.BodyLeft(PlayerBodyId(player));
  }
  ParkHidden(parts);
  bodies.NotePlaces();
  return changes;
}

// As far as a game may look back, and as long as a question from another region may take.
std::size_t LookBackTicks(const Scene& scene) {
  return static_cast<std::size_t>(std::ceil(kMaxLookBack_s * scene.tick_rate_hz)) + kQuestionDelayTicks;
}

// One that the step took out has gone already.
void RunGame(game::PlayerChanges players, RegionParts& parts, StepResult& result) {
  const auto gone = [&](PlayerNumber player) { return !parts.bodies.Owns(PlayerBodyId(player)); };
  std::erase_if(players.joined, gone);
  std::erase_if(players.leaving, gone);
  for (const Departure& departure : parts.game.Run(parts.tick, result.events, players)) {
    result.departures.push_back(departure);
  }
  ParkHidden(parts);
  // Bodies that the game connected are handed over together from now on.
  if (!parts.catalog.has_game()) return;
  ConnectGameJoints(parts.records, parts.bodies);
  FindDriven(parts);
  FollowDriven(parts);
}

void ApplyForces(RegionParts& parts) {
  parts.forces.Apply(parts.players, parts.records, parts.bodies);
  parts.records.Acted(parts.tick + 1);
  if (!parts.scene().player.has_value()) return;
  for (const OwnedBody& body : parts.bodies.owned()) {
    if (IsPlayerBody(body.def->id)) parts.players.Applied(PlayerOf(body.def->id));
  }
}

// Nothing while both sleep, or one is not here.
std::optional<bool> Touch(const TouchingPair& pair, const physics::World& world) {
  const auto moves = [&](BodyId id) { return world.MassOf(id) > 0 && !world.StateOf(id).asleep; };
  if (!world.Has(pair.body_a) || !world.Has(pair.body_b)) return std::nullopt;
  if (!moves(pair.body_a) && !moves(pair.body_b)) return std::nullopt;
  return world.AreTouching(pair.body_a, pair.body_b);
}

// States and events of the step. A body whose state is absurd is taken out.
void ReadBack(RegionParts& parts, StepResult& result) {
  for (const BodyId id : parts.bodies.TakeLeft()) parts.reports.BodyLeft(id);
  result.events = parts.reports.Report(
      parts.bodies.world().events(), [&](BodyId id) { return parts.bodies.Owns(id); },
      [&](BodyId id) { return parts.bodies.world().Has(id); },
      [&](const TouchingPair& pair) { return Touch(pair, parts.bodies.world()); });
  for (const Departure& departure : parts.ownership.ReadBack()) {
    result.departures.push_back(departure);
    result.nonfinite.push_back(departure.body);
  }
}

const PlayerLimits& LimitsOf(BodyId id, const RecordTable& records) {
  static const PlayerLimits kNone;
  if (records.limited().empty()) return kNone;
  const KeptRecord* const record = records.Find(id);
  return record == nullptr ? kNone : record->game.player->limits;
}

// Chooses each player's input of the next step: neighbours that have the body as a ghost apply the same force.
void CommitInputs(RegionParts& parts) {
  const Scene& scene = parts.scene();
  if (!scene.player.has_value()) return;
  const GameMovement* const game = parts.game.movement();
  for (std::size_t i = 0; i < parts.bodies.owned().size(); ++i) {
    const BodyId id = parts.bodies.owned()[i].def->id;
    if (!IsPlayerBody(id)) continue;
    const PlayerNumber player = PlayerOf(id);
    const BodyId moved = parts.players.MovedBy(player);
    const auto at = moved == id ? i : static_cast<std::size_t>(parts.bodies.IndexOf(moved));
    const MovementKind kind = KindOfMovement(scene, *parts.bodies.owned()[at].def, moved == id, game);
    const Mover mover{parts.bodies.world(),        scene, kind, moved, parts.bodies.radius_m(at), parts.tick_s,
                      LimitsOf(id, parts.records), game};
    parts.players.Commit(player, GoesOn(kind), [&](const PlayerInput& input, const MovementState& state) {
      Moved found = Move(mover, input, state);
      if (kind == MovementKind::kGame) parts.game.NoteMoved(parts.tick, player, found.error);
      return found;
    });
  }
}

void DecideHandovers(RegionParts& parts) {
  const auto may_grant = [&](RegionId to) { return parts.borders.Speaks(to); };
  std::vector<PreparedGrant> grants;
  const std::vector<Summons> summoned = FindSummoned(parts.records, parts.bodies);
  for (const PlannedHandover& planned : PlanHandovers(parts.bodies, parts.neighborhood, parts.settings, may_grant,
                                                      summoned, parts.players.driven(), parts.inland)) {
    std::vector<BodyId> assembly;
    for (const std::size_t index : planned.assembly) assembly.push_back(parts.bodies.EntityAt(index).def->id);
    if (parts.output.MustWait(assembly, parts.tick)) continue;
    parts.game.PackEvents(assembly);
    grants.push_back(parts.ownership.Prepare(planned, parts.tick));
    parts.outgoing.Add(planned.to, std::move(grants.back().grant));
  }
  parts.grants_out.Decide(std::move(grants));
}

// Keeps the contacts near borders, whose impulses and loads the frames report.
void NoteContacts(RegionParts& parts) {
  if (parts.neighborhood.size() == 0) return parts.exchange.Clear();
  const RelevanceTable& table = parts.relevance.table();
  const auto near = [&](std::size_t i) { return table.ToAny(i); };
  const std::span<const physics::PairImpulse> contacts = parts.bodies.ImpulsesNearBorders(near, table.Any());
  parts.loads.Note(contacts);
  parts.exchange.Note(contacts, parts.bodies, parts.borders.LinksUp());
}

}  // namespace

StepResult Region::Step(const PhaseObserver& observer) {
  assert(CanStep());
  RegionParts& parts = *parts_;
  const auto enter = [&](Phase phase) {
    if (observer) observer(phase);
  };
  StepResult result;

  enter(Phase::kPlaceGhosts);
  const std::vector<BorderFrame> frames = TakeFrames(parts);
  HandOut(parts, result);
  TakeIn(frames, parts, result);
  PlaceGhosts(frames, parts);
  ExchangeImpulses(frames, parts);
  game::PlayerChanges players = UpdatePlayers(parts, result);
  ApplyForces(parts);

  enter(Phase::kPhysics);
  parts.bodies.Step(parts.tick_s, parts.tick);
  result.tick = ++parts.tick;
  ReadBack(parts, result);
  if (parts.catalog.has_game()) parts.bodies.NotePoses(parts.tick, parts.tick_s, LookBackTicks(parts.scene()));

  enter(Phase::kPrediction);
  parts.output.Release(parts.log.standby_has(), parts.tick);
  RunGame(std::move(players), parts, result);
  MoveByGame(parts);
  if (!parts.log.on()) parts.output.Release(std::nullopt, parts.tick);
  parts.shared.Release(parts.log.standby_has().value_or(parts.tick), parts.tick);
  CommitInputs(parts);
  AdoptMapIfDue(parts);
  parts.messages.Send(parts.tick, parts.log.standby_has());
  SendBlasts(parts);
  FindInland(parts);
  DecideHandovers(parts);
  FindRelevant(parts);

  enter(Phase::kFrames);
  NoteContacts(parts);
  parts.grants_in.Release(parts.log.standby_has());
  result.frames = MakeFrames(parts);
  if (parts.log.on()) result.log = WriteLog(parts);

  enter(Phase::kDone);
  Validate(parts);
  return result;
}

}  // namespace tessera::region

#include "core/region/tick_end.h"

#include "core/region/game_motion.h"
#include "core/region/inland.h"
#include "core/region/lookahead_promise.h"

namespace tessera::region {
namespace {

BorderFrame EmptyFrame(const RegionParts& parts) {
  BorderFrame frame;
  frame.tick = parts.tick;
  frame.sender = parts.self();
  frame.map_version = parts.neighborhood.map().version();
  frame.committed_version = parts.map_change.newest_commit();
  return frame;
}

GhostRecord RecordOf(std::size_t index, const RegionParts& parts) {
  const OwnedBody& body = parts.bodies.owned()[index];
  const BodyId id = body.def->id;
  GhostRecord record;
  record.id = id;
  record.epoch = body.epoch;
  record.state = body.state;
  record.settled = parts.relevance.IsSettled(index, body);
  const PlayerControl* control = parts.players.MoverOf(id);
  if (control != nullptr) {
    record.force_n = control->next.force_n;
    record.torque_nm = control->next.torque_nm;
  }
  if (const KeptRecord* kept = parts.records.Find(id); kept != nullptr) {
    AddGame(kept->game, static_cast<float>(1 / parts.tick_s), record);
  }
  return record;
}

BorderFrame MakeFrame(std::size_t neighbor, RegionParts& parts) {
  const RegionId to = parts.neighborhood[neighbor];
  const std::span<const DepartingBody> departing = parts.grants_out.departing();
  const std::span<const OwnedBody> owned = parts.bodies.owned();
  BorderFrame frame = EmptyFrame(parts);
  std::vector<std::uint32_t> in_frame(owned.size(), BorderLoads::kNotInFrame);
  for (std::size_t i = 0; i < owned.size(); ++i) {
    if (!parts.relevance.table().To(i, neighbor) || DepartsTo(departing, owned[i].def->id, to)) continue;
    in_frame[i] = static_cast<std::uint32_t>(frame.ghosts.size());
    frame.ghosts.push_back(RecordOf(i, parts));
  }
  parts.loads.AddTo(frame.ghosts, {parts.bodies, parts.neighborhood, parts.relevance, departing, neighbor, in_frame});
  frame.impulses = parts.exchange.RecordsFor(to, [&](std::size_t i) {
    return in_frame[i] != BorderLoads::kNotInFrame || DepartsTo(departing, owned[i].def->id, to);
  });
  frame.acknowledgements = parts.grants_in.TakeReady(to);
  if (parts.catalog.has_game()) frame.properties = parts.shared.For(to, frame.ghosts, parts.records);
  parts.outgoing.MoveTo(to, frame);
  return frame;
}

// A link is up again: what the outage may have lost is sent again.
void RepeatLost(std::size_t neighbor, RegionParts& parts) {
  const RegionId to = parts.neighborhood[neighbor];
  parts.borders.ForgetSent(neighbor);
  parts.shared.Forget(to);
  parts.blasts.Forget(to);
  SendBlasts(parts);
  parts.grants_in.Repeat(to);
  parts.outgoing.ReplaceGrants(to, parts.grants_out.Repeated(to, parts.bodies));
}

}  // namespace

// Ghosts, players, fields and games are too much for so quick a look.
void FindInland(RegionParts& parts) {
  parts.inland = false;
  if (parts.neighborhood.size() == 0 || !parts.bodies.stepped() || !parts.bodies.ghosts().empty()) return;
  const bool steered = !PlayersAmong(parts.bodies.owned()).empty() || !parts.players.driven().empty();
  if (steered || !parts.scene().fields.empty() || parts.records.AnyActs()) return;
  parts.inland = AllInland(parts.bodies, parts.neighborhood, parts.settings, parts.scene().gravity_m_s2, parts.tick_s);
}

void SendBlasts(RegionParts& parts) {
  parts.blasts.Send(parts.tick, parts.log.standby_has(), parts.neighborhood, parts.borders, parts.outgoing);
}

void FindRelevant(RegionParts& parts) {
  const bool alone = parts.neighborhood.size() == 0;
  parts.forces.StatesChanged();
  if (!alone) parts.bodies.NotePlaces();
  if (!parts.grants_out.departing().empty()) parts.inland = false;
  std::span<const physics::Forces> forces;
  if (!alone && !parts.inland) forces = parts.forces.Find(parts.bodies, parts.players, parts.records);
  std::vector<std::span<const GhostRecord>> sent;
  for (std::size_t n = 0; n < parts.neighborhood.size(); ++n) sent.push_back(parts.borders.sent(n));
  parts.relevance.Update({parts.bodies, parts.neighborhood, forces, parts.grants_out.departing(), sent,
                          parts.records.hidden(), parts.inland});
}

std::vector<OutgoingFrame> MakeFrames(RegionParts& parts) {
  std::vector<OutgoingFrame> out;
  LookaheadPromise promise({parts.bodies, parts.catalog, parts.neighborhood, parts.settings, parts.forces.found(),
                            parts.tick_s,
                            parts.map_change.map() != nullptr || AnyoneWaits(parts) || parts.messages.waits() ||
                                parts.shared.waits() || parts.blasts.waits() || !parts.players.driven().empty() ||
                                !parts.records.limited().empty() || parts.game.movement() != nullptr,
                            parts.inland});
  for (std::size_t n = 0; n < parts.neighborhood.size(); ++n) {
    const RegionId to = parts.neighborhood[n];
    const BorderLink::Duty duty = parts.borders.DutyNow(n, parts.tick);
    if (duty == BorderLink::Duty::kNothing) continue;
    if (duty == BorderLink::Duty::kReconnect) {
      out.push_back(parts.borders.SendReconnect(n, EmptyFrame(parts)));
      continue;
    }
    if (duty == BorderLink::Duty::kFirstFrame) RepeatLost(n, parts);
    BorderFrame frame = MakeFrame(n, parts);
    const std::uint32_t promised = promise.For(to, frame);
    const std::vector<GrantAcknowledgement> acknowledgements = frame.acknowledgements;
    Borders::SentFrame sent = parts.borders.SendFrame(n, std::move(frame), promised);
    parts.grants_in.Sent(to, acknowledgements, sent.number);
    out.push_back(std::move(sent.out));
  }
  return out;
}

Bytes WriteLog(RegionParts& parts) {
  const std::vector<PairChange> changes = parts.reports.TakeChanges();
  std::vector<KeptRecord> news = parts.records.TakeNews();
  const bool whole = parts.log.whole();
  if (whole) news.assign(parts.records.all().begin(), parts.records.all().end());
  LogView view{parts.self(), parts.incarnation,        parts.tick, parts.bodies.owned(), {}, {},
               changes,      &parts.grants_out.kept(), {}};
  view.records = news;
  view.tombstones = parts.tombstones.All();
  view.bodiless = parts.bodies.bodiless();
  view.blasts = parts.blasts.all();
  if (parts.game.host() != nullptr) view.host = parts.game.host()->State();
  if (parts.scene().player.has_value()) {
    view.controls = parts.players.Controls();
    view.spawned.assign(parts.players.spawned().begin(), parts.players.spawned().end());
  }
  return parts.log.Write(view, whole ? parts.reports.All() : std::vector<TouchingPair>());
}

}  // namespace tessera::region

// The end of a tick: inputs are chosen, bodies that left are granted, the rest is predicted, and each neighbour is
// told.
#include <algorithm>

#include "core/region/fields.h"
#include "core/region/handover.h"
#include "core/region/step.h"

namespace tessera::region {

physics::Forces RegionStep::ForcesOn(std::size_t index) {
  const OwnedBody& body = bodies.owned()[index];
  physics::Forces forces;
  if (body.state.asleep) return forces;
  forces.acceleration_m_s2 = config.scene->gravity_m_s2 * body.def->gravity_scale;
  if (!config.scene->fields.empty()) forces.acceleration_m_s2 += FieldOn(index);
  if (const PlayerControl* control = ControlOf(body.def->id); control != nullptr) {
    forces.acceleration_m_s2 += Vec3d(control->force_n) / body.def->mass_kg;
  }
  return forces;
}

void RegionStep::MeasurePrediction(StepResult& result) const {
  double sum = 0;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedExtra& extra = bodies.extras()[i];
    if (!extra.predicted) continue;
    const double error = Length(bodies.owned()[i].state.position - extra.predicted_position);
    sum += error;
    result.max_prediction_error_m = std::max(result.max_prediction_error_m, error);
    ++result.predicted;
  }
  if (result.predicted > 0) result.mean_prediction_error_m = sum / result.predicted;
}

void RegionStep::CommitInputs() {
  if (!config.scene->player.has_value()) return;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    if (IsPlayerBody(body.def->id)) {
      players.Commit(PlayerOf(body.def->id), body.state, bodies.extras()[i].radius_m);
    }
  }
}

std::vector<std::size_t> RegionStep::OwnedAssembly(std::size_t index) const {
  std::vector<std::size_t> members;
  for (const BodyId id : catalog.AssemblyOf(bodies.owned()[index].def->id)) {
    const std::ptrdiff_t member = bodies.IndexOf(id);
    if (member >= 0) members.push_back(static_cast<std::size_t>(member));
  }
  return members;
}

void RegionStep::DecideHandovers() {
  handed_out.clear();
  if (neighbors.empty()) return;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    if (handed_out.size() >= config.settings.max_grants_per_tick) break;
    const OwnedBody& body = bodies.owned()[i];
    const bool tied = catalog.AssemblyOf(body.def->id).size() > 1;
    if (tied && OwnedAssembly(i).front() != i) continue;  // the lowest body is the anchor
    const std::optional<RegionId> to =
        HandoverTarget(config.map, config.self, grantable, body.state.position, config.settings.hysteresis_m);
    if (!to.has_value() || !MayGrant(*to)) continue;
    if (tied) {
      GrantTo(*to, OwnedAssembly(i));
    } else {
      GrantTo(*to, std::span(&i, 1));
    }
  }
  std::sort(handed_out.begin(), handed_out.end(),
            [](const HandedOut& a, const HandedOut& b) { return a.record.id < b.record.id; });
}

void RegionStep::GrantTo(RegionId to, std::span<const std::size_t> assembly) {
  Grant grant;
  for (const std::size_t index : assembly) {
    const OwnedBody& body = bodies.owned()[index];
    const BodyId id = body.def->id;
    const Epoch epoch(body.epoch.value() + 1);
    GhostRecord record{id, epoch, body.state, {}, {}, {}, {}, false};
    if (const PlayerControl* control = ControlOf(id); control != nullptr) {
      record.force_n = control->force_n;
      record.torque_nm = control->torque_nm;
      grant.control = players.MakeGrant(PlayerOf(id));
    }
    grant.bodies.push_back({id, epoch, body.state, properties.Of(id)});
    std::vector<TouchingPair> touching = reports.Pairs(id);
    grant.touching.insert(grant.touching.end(), touching.begin(), touching.end());
    handed_out.push_back({record, to});
    unconfirmed[{id, epoch}] = {to, tick, body.state, grant.control, std::move(touching), properties.Of(id)};
  }
  OutboxTo(to)->grants.push_back(std::move(grant));
}

void RegionStep::Predict() {
  for (OwnedExtra& extra : bodies.extras()) extra.field_known = extra.predicted = false;
  if (neighbors.empty()) return;
  bodies.NotePlaces();
  reach.Clear(bodies.owned().size());
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    OwnedExtra& extra = bodies.extras()[i];
    const physics::Forces forces = ForcesOn(i);
    const bool near = reach.Look(i, *body.def, body.state, forces, extra.radius_m);
    extra.predicted = near && !body.state.asleep && extra.still_ticks < kCalmTicks;
    if (extra.predicted) {
      extra.predicted_position = physics::Predict(*body.def, body.state, forces, tick_s).position;
    }
  }
  if (!stepped_) ShowFirst();
  ShowNear();
  ShowDeeper();
  ShowWhole();
  ShowSleepers();
  NoteStill();
  if (config.scene->joints.empty()) return;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    if (catalog.AssemblyOf(bodies.owned()[i].def->id).size() == 1) continue;
    const std::vector<std::size_t> members = OwnedAssembly(i);
    if (members.front() == i) reach.Unite(members);
  }
}

// A sleeper stays with whoever saw it fall asleep: taking it away would wake what leans on it.
void RegionStep::ShowSleepers() {
  for (std::size_t n = 0; n < neighbors.size(); ++n) {
    for (const GhostRecord& told : outboxes_[n].told) {
      if (!told.state.asleep) continue;
      const std::ptrdiff_t index = bodies.IndexOf(told.id);
      if (index < 0) continue;
      const auto i = static_cast<std::size_t>(index);
      if (bodies.owned()[i].state.asleep) reach.Show(i, n);
    }
  }
}

std::vector<OutgoingFrame> RegionStep::MakeFrames() {
  std::vector<OutgoingFrame> out;
  std::optional<Unrest> unrest;
  for (std::size_t n = 0; n < neighbors.size(); ++n) {
    Link& link = inbox.link(n);
    Outbox& box = outboxes_[n];
    switch (link.DutyNow(tick)) {
      case Link::Duty::kNothing:
        continue;
      case Link::Duty::kOffer: {
        Frame offer = EmptyFrame();
        offer.stamp = link.StampOffer();
        out.push_back({neighbors[n], Encode(offer, {})});
        continue;
      }
      case Link::Duty::kFirstFrame:
        SayAgain(n);
        break;
      case Link::Duty::kFrame:
        break;
    }
    Frame frame = MakeFrame(n);
    frame.stamp = link.StampFrame(VouchFor(n, frame, unrest));
    for (const Confirmation& confirmation : frame.confirmations) {
      box.unheard.emplace_back(confirmation, frame.stamp.number);
    }
    out.push_back({neighbors[n], Encode(frame, box.told)});
    box.told = std::move(frame.ghosts);
  }
  return out;
}

Frame RegionStep::EmptyFrame() const {
  Frame frame;
  frame.tick = tick;
  frame.sender = config.self;
  frame.map_version = config.map.version();
  frame.committed_version = change.newest_commit();
  return frame;
}

Frame RegionStep::MakeFrame(std::size_t neighbor) {
  const RegionId to = neighbors[neighbor];
  Frame frame = EmptyFrame();
  const auto granted = [&](BodyId id) {
    const HandedOut* out = FindHandedOut(id);
    return out != nullptr && out->to == to;
  };
  std::vector<std::uint32_t> shown(bodies.owned().size(), kNotShown);  // index into frame.ghosts
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const BodyId id = body.def->id;
    if (!reach.Shows(i, neighbor) || granted(id)) continue;
    shown[i] = static_cast<std::uint32_t>(frame.ghosts.size());
    GhostRecord record{id, body.epoch, body.state, {}, {}, {}, {}, IsCalm(i)};
    if (const PlayerControl* control = ControlOf(id); control != nullptr) {
      record.force_n = control->force_n;
      record.torque_nm = control->torque_nm;
    }
    frame.ghosts.push_back(record);
  }
  AddLoads(frame, shown, neighbor);
  for (const BorderContact& contact : border) {
    const Solution& s = contact.solution;
    const bool own_a = s.by_owner_of_a;
    const BodyId own = own_a ? s.a : s.b, other = own_a ? s.b : s.a;
    const bool told = shown[contact.own] != kNotShown || granted(own);
    if (!told && s.other != to) continue;
    frame.impulses.push_back({own, other, own_a ? -s.impulse_on_b : s.impulse_on_b,
                              own_a ? s.angular_on_a : s.angular_on_b, own_a ? s.angular_on_b : s.angular_on_a});
  }
  Outbox& box = outboxes_[neighbor];
  frame.grants = std::exchange(box.grants, {});
  frame.confirmations = std::exchange(box.confirmations, {});
  frame.late_corrections = std::exchange(box.late_corrections, {});
  frame.inputs = std::exchange(box.inputs, {});
  return frame;
}

}  // namespace tessera::region

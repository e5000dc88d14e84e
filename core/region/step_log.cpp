// What a region tells its heir, and what it tells others only once the heir has it.
#include <algorithm>

#include "core/region/step.h"

namespace tessera::region {

void RegionStep::SetStandby(bool on) {
  standby_on = on;
  acknowledged = Tick();
  reports.KeepChanges(on);
  reports.TakeChanges();
  properties.KeepNews(on);
  log_.Restart();
}

void RegionStep::LogAcknowledged(Tick up_to) {
  if (standby_on && up_to <= tick) acknowledged = std::max(acknowledged, up_to);
}

RegionState RegionStep::State() const {
  RegionState state;
  state.region = config.self;
  state.incarnation = config.incarnation;
  state.tick = tick;
  state.bodies.reserve(bodies.owned().size());
  for (const OwnedBody& body : bodies.owned()) state.bodies.push_back({body.def->id, body.epoch, body.state});
  state.controls = players.Controls();
  state.spawned.assign(players.spawned().begin(), players.spawned().end());
  state.touching = reports.All();
  state.grants = unconfirmed;
  for (const ChangedProperties& entry : properties.all()) {
    state.properties[entry.body] = {entry.change, *entry.bytes};
  }
  return state;
}

void RegionStep::WriteLog(StepResult& result) {
  if (!standby_on) return;
  const std::vector<PairChange> changes = reports.TakeChanges();
  LogView view{config.self, config.incarnation, tick, bodies.owned(), {}, {}, changes, &unconfirmed, {}};
  const std::vector<ChangedProperties> news = properties.TakeNews();
  view.properties = log_.whole() ? properties.all() : std::span<const ChangedProperties>(news);
  if (config.scene->player.has_value()) {
    view.controls = players.Controls();
    view.spawned.assign(players.spawned().begin(), players.spawned().end());
  }
  result.log = log_.Write(view, log_.whole() ? reports.All() : std::vector<TouchingPair>());
}

void RegionStep::ReleaseConfirmations() {
  std::erase_if(due_confirmations, [this](const DueConfirmation& due) {
    if (standby_on && due.since > acknowledged) return false;
    if (Outbox* box = OutboxTo(due.to); box != nullptr) box->confirmations.push_back({due.id, due.epoch});
    return true;
  });
}

}  // namespace tessera::region

// Borders that close and open, and what a region vouches for so that nobody need wait for it.
#include <algorithm>

#include "core/region/step.h"

namespace tessera::region {

void RegionStep::Close(RegionId neighbor) {
  const std::ptrdiff_t index = NeighborIndex(neighbor);
  if (index >= 0) inbox.link(static_cast<std::size_t>(index)).Close();
}

bool RegionStep::OpenTo(RegionId region) const {
  const std::ptrdiff_t index = NeighborIndex(region);
  return index >= 0 && inbox.link(static_cast<std::size_t>(index)).open();
}

bool RegionStep::MayGrant(RegionId to) const {
  const std::ptrdiff_t index = NeighborIndex(to);
  return index >= 0 && inbox.link(static_cast<std::size_t>(index)).Speaks();
}

// They were kept for the case that who had the body died with it. It is here; until our heir has it, who granted it
// back keeps it.
void RegionStep::ForgetGrantsBefore(BodyId id, Epoch epoch) {
  unconfirmed.erase(unconfirmed.lower_bound({id, Epoch(0)}), unconfirmed.lower_bound({id, epoch}));
}

// What was taken in is known until the granter has the confirmation: it owns the body, or it has passed it on and still
// keeps the confirmation.
bool RegionStep::IsRepeat(std::size_t neighbor, const GrantedBody& body) const {
  const std::ptrdiff_t index = bodies.IndexOf(body.id);
  if (index >= 0 && bodies.owned()[static_cast<std::size_t>(index)].epoch >= body.epoch) return true;
  return Confirms(neighbor, body);
}

bool RegionStep::Confirms(std::size_t neighbor, const GrantedBody& body) const {
  const auto same = [&](const auto& confirmation) {
    return confirmation.id == body.id && confirmation.epoch == body.epoch;
  };
  const Outbox& box = outboxes_[neighbor];
  return std::any_of(box.confirmations.begin(), box.confirmations.end(), same) ||
         std::any_of(box.unheard.begin(), box.unheard.end(), [&](const auto& sent) { return same(sent.first); }) ||
         std::any_of(due_confirmations.begin(), due_confirmations.end(),
                     [&](const DueConfirmation& due) { return due.to == neighbors[neighbor] && same(due); });
}

void RegionStep::SayAgain(std::size_t neighbor) {
  Outbox& box = outboxes_[neighbor];
  box.told.clear();
  std::vector<Confirmation> again;
  again.reserve(box.unheard.size() + box.confirmations.size());
  for (const auto& [confirmation, number] : box.unheard) again.push_back(confirmation);
  again.insert(again.end(), box.confirmations.begin(), box.confirmations.end());
  box.confirmations = std::move(again);
  box.unheard.clear();
  for (auto it = unconfirmed.begin(); it != unconfirmed.end(); ++it) {
    const auto& [key, kept] = *it;
    const auto& [id, epoch] = key;
    const auto next = std::next(it);
    const bool newest = next == unconfirmed.end() || next->first.first != id;
    if (!newest || kept.to != neighbors[neighbor] || bodies.Owns(id)) continue;
    // It went on here meanwhile.
    const Ghost* ghost = bodies.FindGhost(id);
    const bool went_on = ghost != nullptr && ghost->owner == kept.to && ghost->record.epoch == epoch;
    const GrantedBody body{id, epoch, went_on ? bodies.world().StateOf(id) : kept.state, kept.properties};
    const BodyId anchor = catalog.AssemblyOf(id).front();
    const auto of_assembly = [&](const Grant& grant) {
      return catalog.AssemblyOf(grant.bodies.front().id).front() == anchor;
    };
    auto grant = std::find_if(box.grants.begin(), box.grants.end(), of_assembly);
    if (grant == box.grants.end()) {
      box.grants.emplace_back();
      grant = box.grants.end() - 1;
      grant->control = kept.control;
    }
    grant->bodies.push_back(body);
    grant->touching.insert(grant->touching.end(), kept.touching.begin(), kept.touching.end());
  }
}

// What is awake, or may be steered, and where it may come to be within what is vouched for and what a neighbour must
// see in advance. What cannot leave this region's cell by then disturbs nobody; it is most of what there is.
RegionStep::Unrest RegionStep::FindUnrest() {
  const double horizon_s = (config.settings.vouch_ticks + config.settings.lookahead_ticks) * tick_s;
  Unrest unrest;
  const auto look_at = [&](BodyId id, const BodyState& state, double radius_m, double acceleration_m_s2) {
    const bool steered = IsPlayerBody(id);
    if (state.asleep && !steered) return;
    unrest.any = true;
    if (steered) acceleration_m_s2 += config.scene->player->max_force_n / catalog.MassOf(id);
    const double far = radius_m + config.settings.aura_m +
                       horizon_s * (Length(Vec3d(state.linear_velocity)) + 0.5 * acceleration_m_s2 * horizon_s);
    const Vec3d at = state.position;
    const Cell& cell = config.map.CellAt(at.x, at.z);
    const double inside =
        std::min({at.x - cell.area.min_x, cell.area.max_x - at.x, at.z - cell.area.min_z, cell.area.max_z - at.z});
    if (cell.owner == config.self && inside > far) return;
    const Vec3d around{far, far, far};
    unrest.places.push_back({at - around, at + around});
  };
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    look_at(body.def->id, body.state, bodies.extras()[i].radius_m, Length(ForcesOn(i).acceleration_m_s2));
  }
  for (const Ghost& ghost : bodies.ghosts()) {
    const BodyId id = ghost.record.id;
    const Aabb box = bodies.world().BoundsOf(id);
    const double acceleration = Length(config.scene->gravity_m_s2 * ghost.def->gravity_scale);
    look_at(id, bodies.world().StateOf(id), Length(box.max - box.min) / 2, acceleration);
  }
  return unrest;
}

// Sleepers that are shown stay as they are while nothing here is awake to push them. Where nothing is shown, nothing
// awake may come near; nor may ghosts, which may be granted to this region next.
std::uint32_t RegionStep::VouchFor(std::size_t neighbor, const Frame& frame, std::optional<Unrest>& unrest) {
  const std::uint32_t ticks = config.settings.vouch_ticks;
  const bool quiet = frame.impulses.empty() && frame.grants.empty() && frame.confirmations.empty() &&
                     frame.late_corrections.empty() && frame.inputs.empty();
  if (ticks == 0 || !quiet || change.map() != nullptr) return 0;
  const auto sleeps = [](const GhostRecord& ghost) { return ghost.state.asleep && !IsPlayerBody(ghost.id); };
  if (!std::all_of(frame.ghosts.begin(), frame.ghosts.end(), sleeps)) return 0;
  if (!unrest.has_value()) unrest = FindUnrest();
  if (!frame.ghosts.empty()) return unrest->any ? 0 : ticks;
  const auto disturbs = [&](const Aabb& place) { return config.map.Reaches(neighbors[neighbor], place); };
  return std::any_of(unrest->places.begin(), unrest->places.end(), disturbs) ? 0 : ticks;
}

}  // namespace tessera::region

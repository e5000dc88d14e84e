#include "core/region/grants_out.h"

#include <algorithm>
#include <cassert>
#include <iterator>

#include "core/region/ascends.h"

namespace tessera::region {

void GrantsOut::Decide(std::vector<PreparedGrant> grants) {
  departing_.clear();
  for (PreparedGrant& grant : grants) {
    departing_.insert(departing_.end(), grant.departing.begin(), grant.departing.end());
    for (auto& [key, copy] : grant.copies) kept_.insert_or_assign(key, std::move(copy));
  }
  std::ranges::sort(departing_, {}, [](const DepartingBody& body) { return body.record.id; });
}

bool GrantsOut::Acknowledged(RegionId from, const GrantAcknowledgement& acknowledgement) {
  const auto copy = kept_.find({acknowledgement.id, acknowledgement.epoch});
  if (copy == kept_.end() || copy->second.to != from) return false;
  kept_.erase(copy);
  return true;
}

void GrantsOut::ForgetBefore(BodyId id, Epoch epoch) {
  kept_.erase(kept_.lower_bound({id, Epoch(0)}), kept_.lower_bound({id, epoch}));
}

std::vector<Grant> GrantsOut::Repeated(RegionId to, const Bodies& bodies) const {
  std::vector<Grant> grants;
  for (auto it = kept_.begin(); it != kept_.end(); ++it) {
    const auto& [key, copy] = *it;
    const auto& [id, epoch] = key;
    const auto next = std::next(it);
    const bool newest = next == kept_.end() || next->first.first != id;
    if (!newest || copy.to != to || bodies.Owns(id)) continue;
    const Ghost* ghost = bodies.FindGhost(id);
    const bool went_on = ghost != nullptr && ghost->owner == to && ghost->record.epoch == epoch;
    const BodyId anchor = catalog_.AssemblyOf(id).front();
    auto grant = std::ranges::find_if(
        grants, [&](const Grant& other) { return catalog_.AssemblyOf(other.bodies.front().id).front() == anchor; });
    if (grant == grants.end()) {
      grant = grants.insert(grant, Grant());
      grant->control = copy.control;
    }
    grant->bodies.push_back({id, epoch, went_on ? bodies.world().StateOf(id) : copy.state, copy.record});
    grant->touching.insert(grant->touching.end(), copy.touching.begin(), copy.touching.end());
  }
  return grants;
}

void GrantsOut::Settle(KeptGrants still_needed) {
  departing_.clear();
  kept_ = std::move(still_needed);
}

void GrantsOut::Validate([[maybe_unused]] const Bodies& bodies) const {
  assert(Ascends(departing_, [](const DepartingBody& body) { return body.record.id; }));
  assert(std::ranges::all_of(departing_, [&](const DepartingBody& body) {
    return bodies.Owns(body.record.id) && kept_.contains({body.record.id, body.record.epoch});
  }));
}

}  // namespace tessera::region

#include "core/region/grants_in.h"

#include <algorithm>
#include <cassert>

#include "core/region/ascends.h"

namespace tessera::region {

void GrantsIn::SetNeighbors(std::span<const RegionId> neighbors, bool anew) {
  std::map<RegionId, UnderWay> before = std::exchange(under_way_, {});
  if (anew) before.clear();
  for (const RegionId neighbor : neighbors) under_way_.emplace(neighbor, std::move(before[neighbor]));
}

std::vector<const GrantedBody*> GrantsIn::Accept(RegionId from, const Grant& grant, const Bodies& bodies, Tick since) {
  std::vector<const GrantedBody*> fresh;
  for (const GrantedBody& body : grant.bodies) {
    if (IsRepeat(from, body, bodies)) {
      if (!Acknowledges(from, body)) Owe(body.id, body.epoch, from, since);
    } else if (!bodies.Owns(body.id)) {
      Owe(body.id, body.epoch, from, since);
      taken_in_.insert(std::ranges::lower_bound(taken_in_, body.id), body.id);
      fresh.push_back(&body);
    }
  }
  return fresh;
}

// The region owns the body, or it has passed it on and still keeps the acknowledgement.
bool GrantsIn::IsRepeat(RegionId from, const GrantedBody& body, const Bodies& bodies) const {
  if (bodies.EpochOf(body.id) >= body.epoch) return true;
  return Acknowledges(from, body);
}

bool GrantsIn::Acknowledges(RegionId to, const GrantedBody& body) const {
  const auto same = [&](const auto& one) { return one.id == body.id && one.epoch == body.epoch; };
  if (std::ranges::any_of(due_, [&](const Due& due) { return due.to == to && same(due); })) return true;
  const auto it = under_way_.find(to);
  if (it == under_way_.end()) return false;
  return std::ranges::any_of(it->second.ready, same) ||
         std::ranges::any_of(it->second.unheard, [&](const auto& sent) { return same(sent.first); });
}

void GrantsIn::WentOn(BodyId id, Epoch epoch) {
  for (Due& due : due_) {
    if (due.id == id && due.epoch < epoch) due.since = Tick();
  }
}

void GrantsIn::Release(std::optional<Tick> standby_has) {
  std::erase_if(due_, [&](const Due& due) {
    if (standby_has.has_value() && due.since > *standby_has) return false;
    const auto it = under_way_.find(due.to);
    if (it != under_way_.end()) it->second.ready.push_back({due.id, due.epoch});
    return true;
  });
}

std::vector<GrantAcknowledgement> GrantsIn::TakeReady(RegionId to) {
  return std::exchange(under_way_.at(to).ready, {});
}

void GrantsIn::Sent(RegionId to, std::span<const GrantAcknowledgement> acknowledgements, std::uint64_t frame_number) {
  UnderWay& under_way = under_way_.at(to);
  for (const GrantAcknowledgement& one : acknowledgements) under_way.unheard.emplace_back(one, frame_number);
}

void GrantsIn::Heard(RegionId from, std::uint64_t frame_number) {
  std::erase_if(under_way_.at(from).unheard, [&](const auto& sent) { return sent.second < frame_number; });
}

void GrantsIn::Repeat(RegionId to) {
  UnderWay& under_way = under_way_.at(to);
  std::vector<GrantAcknowledgement> again;
  again.reserve(under_way.unheard.size() + under_way.ready.size());
  for (const auto& [acknowledgement, number] : under_way.unheard) again.push_back(acknowledgement);
  again.insert(again.end(), under_way.ready.begin(), under_way.ready.end());
  under_way.ready = std::move(again);
  under_way.unheard.clear();
}

void GrantsIn::Validate() const {
  assert(Ascends(taken_in_));
  assert(std::ranges::all_of(under_way_, [](const auto& entry) {
    return std::ranges::is_sorted(entry.second.unheard, {}, [](const auto& sent) { return sent.second; });
  }));
}

}  // namespace tessera::region

#include "core/region/whole_islands.h"

#include <algorithm>
#include <cassert>

namespace tessera::region {

void MarkAround(std::size_t body, const Aabb& bounds, const Neighborhood& neighborhood, RelevanceTable& table) {
  constexpr double kAround_m = 1;  // more than bodies overhang their owners' cells, as a rule
  const Aabb box = bounds.Expanded(kAround_m);
  for (std::size_t n = 0; n < neighborhood.size(); ++n) {
    if (!table.To(body, n) && neighborhood.map().Reaches(neighborhood[n], box)) table.Mark(body, n);
  }
}

void WholeIslands::Mark(const Bodies& bodies, const Neighborhood& neighborhood, RelevanceTable& table) {
  whole_.assign(bodies.owned().size(), false);
  if (most_ < 2 || !table.Any()) return;
  states_.assign(bodies.places(), kUnknown);
  for (std::size_t first = 0; first < bodies.owned().size(); ++first) {
    if (states_[first] != kUnknown || !table.ToAny(first)) continue;
    Search(first, bodies, table);
    if (island_.too_many) {
      for (const std::size_t place : island_.places) states_[place] = kTooMany;
      continue;
    }
    // A large island is whole only because all of it is relevant anyway: it becomes relevant to nobody else.
    if (island_.owned.size() <= most_) {
      for (const std::size_t place : island_.places) {
        MarkAround(first, bodies.world().BoundsOf(bodies.IdAt(place)), neighborhood, table);
      }
      table.Unite(island_.owned);
    }
    for (const std::size_t body : island_.owned) whole_[body] = true;
  }
}

// Ends where it has found too many bodies, or comes to one whose island is known to have too many.
void WholeIslands::Search(std::size_t first, const Bodies& bodies, const RelevanceTable& table) {
  island_.places.assign(1, first);
  island_.owned.clear();
  island_.too_many = false;
  states_[first] = kFound;
  bool relevant_anyway = true;
  for (std::size_t next = 0; next < island_.places.size() && !island_.too_many; ++next) {
    const std::size_t place = island_.places[next];
    if (place < bodies.owned().size()) {
      island_.owned.push_back(place);
      relevant_anyway = relevant_anyway && table.Alike(first, place);
    }
    AddNext(place, bodies);
    island_.too_many = island_.too_many || (island_.owned.size() > most_ && !relevant_anyway);
  }
}

void WholeIslands::AddNext(std::size_t place, const Bodies& bodies) {
  if (bodies.DefAt(place).kinematic) return;  // it connects nothing, as a static body
  const BodyId id = bodies.IdAt(place);
  near_.clear();
  if (bodies.has_joints()) {
    for (const BodyId jointed : bodies.AssemblyOf(id)) {
      near_.push_back(static_cast<std::uint32_t>(bodies.PlaceOf(jointed)));  // -1: kNoTag
    }
  }
  bodies.AddNear(id, &near_);
  for (const std::uint32_t other : near_) {
    if (other >= states_.size() || states_[other] == kFound) continue;
    island_.too_many = island_.too_many || states_[other] == kTooMany;
    states_[other] = kFound;
    island_.places.push_back(other);
  }
}

void WholeIslands::Validate([[maybe_unused]] const Bodies& bodies) const {
  assert(whole_.size() == bodies.owned().size());
  assert(most_ >= 2 || std::ranges::find(whole_, true) == whole_.end());
  if (!bodies.has_joints()) return;
  for (std::size_t body = 0; body < whole_.size(); ++body) {
    assert(std::ranges::all_of(bodies.OwnedAssembly(body),
                               [&](std::size_t jointed) { return whole_[jointed] == whole_[body]; }));
  }
}

}  // namespace tessera::region

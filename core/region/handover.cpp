#include "core/region/handover.h"

#include <algorithm>

#include "core/region/cell_finder.h"

namespace tessera::region {

std::optional<RegionId> HandoverTarget(const PartitionMap& map, RegionId self, std::span<const RegionId> neighbors,
                                       Vec3d anchor, double hysteresis_m) {
  const RegionId owner = map.OwnerOf(anchor);
  if (owner == self) return std::nullopt;
  // Outside the world's bounds the nearest cell counts, so hysteresis is measured along the edge.
  const Rect& bounds = map.bounds();
  const Vec3d place{std::clamp(anchor.x, bounds.min_x, bounds.max_x), anchor.y,
                    std::clamp(anchor.z, bounds.min_z, bounds.max_z)};
  const double own_distance = map.DistanceTo(self, place);
  if (own_distance <= hysteresis_m) return std::nullopt;
  if (std::binary_search(neighbors.begin(), neighbors.end(), owner)) return owner;
  std::optional<RegionId> nearest;
  double best = own_distance;  // a step that leads no nearer would come back
  for (const RegionId neighbor : neighbors) {
    const double distance = map.DistanceTo(neighbor, place);
    if (distance < best) {
      best = distance;
      nearest = neighbor;
    }
  }
  return nearest;
}

namespace {

std::optional<RegionId> CalledTo(std::span<const std::size_t> assembly, const Bodies& bodies,
                                 const Neighborhood& neighborhood, std::span<const Summons> summoned) {
  for (const std::size_t index : assembly) {
    const BodyId id = bodies.owned()[index].def->id;
    const auto at = std::ranges::lower_bound(summoned, id, {}, &Summons::body);
    if (at == summoned.end() || at->body != id) continue;
    if (std::ranges::binary_search(neighborhood.grantable(), at->to)) return at->to;
  }
  return std::nullopt;
}

// Adds the players who move one of the assembly.
void AddRiders(const Bodies& bodies, std::span<const Driven> driven, std::vector<std::size_t>& assembly) {
  const std::size_t before = assembly.size();
  for (const Driven& one : driven) {
    const std::ptrdiff_t index = bodies.IndexOf(one.body);
    const auto end = assembly.begin() + static_cast<std::ptrdiff_t>(before);
    if (index < 0 || std::find(assembly.begin(), end, static_cast<std::size_t>(index)) == end) continue;
    assembly.push_back(static_cast<std::size_t>(bodies.IndexOf(one.own)));
  }
  std::ranges::sort(assembly);
}

}  // namespace

std::vector<PlannedHandover> PlanHandovers(const Bodies& bodies, const Neighborhood& neighborhood,
                                           const RegionSettings& settings, absl::FunctionRef<bool(RegionId)> may_grant,
                                           std::span<const Summons> summoned, std::span<const Driven> driven,
                                           bool inland) {
  std::vector<PlannedHandover> plan;
  if (neighborhood.size() == 0) return plan;
  std::size_t planned = 0;
  CellFinder cells(neighborhood.map());
  const std::size_t movable = inland && summoned.empty() ? 0 : bodies.owned().size();
  for (std::size_t i = 0; i < movable; ++i) {
    if (planned >= settings.max_grants_per_tick) break;
    const OwnedBody& body = bodies.owned()[i];
    // At home, and nobody calls: as HandoverTarget would find.
    if (summoned.empty() && cells.At(body.state.position).owner == neighborhood.self()) continue;
    const bool jointed = bodies.AssemblyOf(body.def->id).size() > 1;
    if (jointed && bodies.OwnedAssembly(i).front() != i) continue;  // the lowest body is the anchor
    if (std::ranges::binary_search(driven, body.def->id, {}, &Driven::own)) continue;
    std::optional<RegionId> to = HandoverTarget(neighborhood.map(), neighborhood.self(), neighborhood.grantable(),
                                                body.state.position, settings.hysteresis_m);
    if (!summoned.empty()) {
      if (const auto called = CalledTo(bodies.OwnedAssembly(i), bodies, neighborhood, summoned)) to = called;
    }
    if (!to.has_value() || !may_grant(*to)) continue;
    plan.push_back({*to, jointed ? bodies.OwnedAssembly(i) : std::vector{i}});
    if (!driven.empty()) AddRiders(bodies, driven, plan.back().assembly);
    planned += plan.back().assembly.size();
  }
  for (std::size_t i = 0; i < bodies.bodiless().size() && planned < settings.max_grants_per_tick; ++i) {
    const std::optional<RegionId> to = HandoverTarget(neighborhood.map(), neighborhood.self(), neighborhood.grantable(),
                                                      bodies.bodiless()[i].state.position, settings.hysteresis_m);
    if (!to.has_value() || !may_grant(*to)) continue;
    plan.push_back({*to, {bodies.owned().size() + i}});
    ++planned;
  }
  return plan;
}

std::size_t CountAway(const Bodies& bodies, const KeptGrants& kept, const Catalog& catalog,
                      const Neighborhood& neighborhood, const RegionSettings& settings, double tick_s) {
  constexpr double kCrossingTicks = 2;
  const PartitionMap& map = neighborhood.map();
  const double far = settings.hysteresis_m + settings.aura_m;
  const Rect& bounds = map.bounds();
  const auto away = [&](const BodyState& state) {
    Vec3d place = state.position;
    place = {std::clamp(place.x, bounds.min_x, bounds.max_x), place.y, std::clamp(place.z, bounds.min_z, bounds.max_z)};
    const double crossing = Length(state.linear_velocity) * tick_s * kCrossingTicks;
    return map.DistanceTo(neighborhood.self(), place) > far + crossing;
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.owned().size(); ++i) {
    const OwnedBody& body = bodies.owned()[i];
    const bool jointed = bodies.AssemblyOf(body.def->id).size() > 1;
    if (jointed && bodies.OwnedAssembly(i).front() != i) continue;  // the lowest body says where they belong
    count += away(body.state) ? 1 : 0;
  }
  for (const OwnedBody& entity : bodies.bodiless()) count += away(entity.state) ? 1 : 0;
  for (const auto& [key, grant] : kept) {
    if (catalog.AssemblyOf(key.first).front() != key.first) continue;
    count += away(grant.state) ? 1 : 0;
  }
  return count;
}

}  // namespace tessera::region

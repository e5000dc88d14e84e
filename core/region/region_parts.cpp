#include "core/region/region_parts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/physics/thread_team.h"

namespace tessera::region {
namespace {

Vec3d ToGrid(Vec3d v) {
  const auto to_grid = [](double x) { return std::round(x / kOriginGrid_m) * kOriginGrid_m; };
  return {to_grid(v.x), to_grid(v.y), to_grid(v.z)};
}

// The middle of the region's cells, or of the world.
Vec3d OriginFor(const Config& config) {
  const Aabb& bounds = config.scene->bounds;
  const Vec3d center = (bounds.min + bounds.max) * 0.5;
  if (config.settings.shared_origin) return ToGrid(center);
  std::optional<Rect> area;
  for (const Cell& cell : config.map.cells()) {
    if (cell.owner != config.self) continue;
    const Rect& more = cell.area;
    area = !area ? more
                 : Rect{std::min(area->min_x, more.min_x), std::min(area->min_z, more.min_z),
                        std::max(area->max_x, more.max_x), std::max(area->max_z, more.max_z)};
  }
  if (!area) return ToGrid(center);
  return ToGrid({(area->min_x + area->max_x) / 2, center.y, (area->min_z + area->max_z) / 2});
}

physics::WorldSettings WorldSettingsOf(const Config& config) {
  physics::WorldSettings settings;
  settings.origin = OriginFor(config);
  settings.gravity_m_s2 = config.scene->gravity_m_s2;
  static_assert(kMaxRegionThreads == physics::kMaxStepThreads);
  settings.threads = static_cast<int>(config.settings.threads);
  return settings;
}

// Nobody knows in advance what a game does in a tick.
RegionSettings SettingsOf(const Config& config) {
  RegionSettings settings = config.settings;
  if (config.game != nullptr) settings.promise_ticks = std::min(settings.promise_ticks, kMaxPromisedWithGame);
  return settings;
}

}  // namespace

RegionParts::RegionParts(const Config& config)
    : incarnation(config.incarnation),
      settings(SettingsOf(config)),
      tick_s(1.0 / config.scene->tick_rate_hz),
      catalog(config.scene, config.game != nullptr),
      neighborhood(config.self, config.map),
      bodies(catalog, WorldSettingsOf(config), config.initial == nullptr ? Tick() : config.initial->tick),
      reports(catalog),
      blasts(*config.scene),
      ownership(catalog, bodies, players, reports, records, output, shared, blasts),
      questions(catalog, neighborhood, bodies, records, shared),
      game(config.game, config.self, config.incarnation, catalog, bodies, records, ownership, tombstones, output,
           shared, blasts, messages, players, reports, questions),
      borders(config.self, neighborhood.neighbors(), config.map.version(), catalog),
      outgoing(neighborhood.neighbors()),
      grants_out(catalog),
      grants_in(neighborhood.neighbors()),
      exchange(catalog, tick_s),
      loads(settings),
      forces(catalog.scene(), tick_s),
      relevance(catalog, settings, tick_s),
      log(tick_s),
      messages(catalog, neighborhood, borders, bodies, records, ownership, tombstones, outgoing, questions) {}

RegionState StateOf(const RegionParts& parts) {
  RegionState state;
  state.region = parts.self();
  state.incarnation = parts.incarnation;
  state.tick = parts.tick;
  parts.ownership.Save(state);
  state.tombstones = parts.tombstones.All();
  if (parts.game.host() != nullptr) state.host = parts.game.host()->State();
  state.blasts.assign(parts.blasts.all().begin(), parts.blasts.all().end());
  state.spawned.assign(parts.players.spawned().begin(), parts.players.spawned().end());
  state.grants = parts.grants_out.kept();
  return state;
}

void Validate([[maybe_unused]] const RegionParts& parts) {
#ifndef NDEBUG
  const MapVersion in_force = parts.neighborhood.map().version();
  parts.neighborhood.Validate();
  parts.map_change.Validate(in_force, parts.tick);
  parts.failover.Validate(in_force);
  parts.bodies.Validate();
  parts.players.Validate();
  parts.reports.Validate();
  parts.records.Validate();
  parts.output.Validate();
  parts.shared.Validate(parts.bodies);
  parts.blasts.Validate(parts.bodies);
  parts.ownership.Validate();
  parts.borders.Validate();
  parts.outgoing.Validate(parts.neighborhood.neighbors());
  parts.grants_out.Validate(parts.bodies);
  parts.grants_in.Validate();
  parts.exchange.Validate();
  parts.loads.Validate();
  parts.forces.Validate();
  parts.relevance.Validate(parts.bodies);
  parts.log.Validate(parts.tick);
#endif
}

}  // namespace tessera::region

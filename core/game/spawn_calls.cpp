#include "core/game/spawn_calls.h"

#include <algorithm>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/option_reader.h"
#include "core/world/limits.h"
#include "core/world/prefab.h"
#include "core/world/query.h"
#include "game_sdk/api/api.h"

namespace tessera::game {
namespace {

absl::Status Outside(std::string_view function, Vec3d place) {
  return ArgumentFault(function,
                       absl::StrCat("(", place.x, ", ", place.y, ", ", place.z, ") is outside the scene's bounds"));
}

// Where and how fast, when it expires, 0: never, and whose client shows it already, 0: nobody's.
struct SpawnOrder {
  SpawnMotion motion;
  Tick expires;
  PlayerNumber predicted;
};

// The player whose client shows the body already. Only a command says so, and each for one body.
PlayerNumber PredictedBy(const tessera_game_call& call, OptionReader& options) {
  const tessera_game_value* const given = options.Any("predicted");
  if (given == nullptr) return {};
  if (given->type != TESSERA_GAME_PLAYER) {
    options.Fault("predicted", "must be a player");
    return {};
  }
  const bool known = given->as.id != 0 && given->as.id <= UINT32_MAX;
  const PlayerNumber player(known ? static_cast<std::uint32_t>(given->as.id) : 0);
  if (!known || call.callback != kOnCommand || call.self != PlayerBodyId(player)) {
    options.Fault("predicted", "must be the player whose command on_command has got");
  } else if (call.claimed) {
    options.Fault("predicted", "is for one body of a command, and there is one");
  }
  return player;
}

absl::StatusOr<SpawnOrder> SpawnOrderFrom(const tessera_game_call& call, const Function& function,
                                          CallArguments arguments) {
  SpawnOrder order;
  OptionReader options(function, arguments.subspan(2), "options.");
  order.motion.position = VectorGiven(arguments[1]);
  if (!call.transaction.world().scene().bounds.Contains(order.motion.position)) {
    return Outside("spawn", order.motion.position);
  }
  if (const auto rotation = options.Rotation("rotation")) order.motion.rotation = *rotation;
  if (const auto velocity = options.Vector("velocity")) {
    order.motion.velocity_m_s = *velocity;
    if (Length(*velocity) > kMaxGameSpeed_m_s) {
      options.Fault("velocity", absl::StrCat("is above ", kMaxGameSpeed_m_s, " m/s"));
    }
  }
  if (const auto spin = options.Vector("spin")) {
    order.motion.spin_rad_s = *spin;
    if (Length(*spin) > kMaxAngularSpeed_rad_s) {
      options.Fault("spin", absl::StrCat("is above ", kMaxAngularSpeed_rad_s, " rad/s"));
    }
  }
  if (const auto ticks = options.Whole("expire_after", 1, kMaxTimerTicks)) order.expires = call.tick + *ticks;
  order.predicted = PredictedBy(call, options);
  if (absl::Status status = options.status(); !status.ok()) return status;
  return order;
}

// A ray of this length, m, from a point begins in the bodies that the point is inside of.
constexpr double kInsideProbe_m = 1e-3;

// Whether one of the prefab's bodies would have its place inside a static body that it collides with. INVALID_ARGUMENT
// names both. A mesh and a height field have no inside.
absl::Status CheckFree(const GameWorld& world, const Prefab& prefab, const SpawnMotion& motion, std::uint64_t* work) {
  for (std::size_t member = 0; member < prefab.bodies.size(); ++member) {
    const BodyDef& body = prefab.bodies[member];
    if (body.trigger || body.kinematic || body.motion != Motion::kDynamic) continue;
    BodyQuery query;
    query.from = SpawnedState(body, motion).position;
    query.to = query.from + Vec3d{0, kInsideProbe_m, 0};
    query.filter.layers = body.layer.collides;
    query.filter.dynamic_bodies = false;
    const QueryResult found = world.FindBodies(query, nullptr);
    *work += found.work;
    if (found.hits.empty() || found.hits.front().fraction > 0) continue;
    const BodyId id = found.hits.front().body;
    const BodyDef* const wall = world.Find(id);
    return ArgumentFault(
        "spawn", absl::StrCat(prefab.bodies.size() == 1 ? "" : absl::StrCat("body ", member + 1, " of "), "\"",
                              prefab.name, "\" would be inside static body ", id.value(),
                              wall == nullptr || wall->name.empty() ? "" : absl::StrCat(" \"", wall->name, "\"")));
  }
  return absl::OkStatus();
}

std::string PrefabNames(const Scene& scene) {
  return scene.prefabs.empty() ? "none"
                               : absl::StrJoin(scene.prefabs, ", ", [](std::string* out, const Prefab& prefab) {
                                   out->append(prefab.name);
                                 });
}

}  // namespace

absl::StatusOr<tessera_game_value> CallSpawn(tessera_game_call& call, const Function& function,
                                             CallArguments arguments) {
  const Scene& scene = call.transaction.world().scene();
  const std::string_view name = TextGiven(arguments[0]);
  const auto prefab = std::ranges::find(scene.prefabs, name, &Prefab::name);
  if (prefab == scene.prefabs.end()) {
    return absl::NotFoundError(
        absl::StrCat("spawn: no prefab \"", ViewOf(name.substr(0, 63)), "\"; the scene has: ", PrefabNames(scene)));
  }
  const absl::StatusOr<SpawnOrder> order = SpawnOrderFrom(call, function, arguments);
  if (!order.ok()) return order.status();
  if (order->predicted != PlayerNumber() && prefab->bodies.size() > 1) {
    return ArgumentFault("spawn", absl::StrCat("`options.predicted` is for prefabs of one body, and \"", prefab->name,
                                               "\" has ", prefab->bodies.size()));
  }
  const auto place = static_cast<std::size_t>(prefab - scene.prefabs.begin());
  std::uint64_t work = 0;
  absl::Status status = CheckFree(call.transaction.world(), *prefab, order->motion, &work);
  absl::StatusOr<BodyId> first = BodyId();
  if (status.ok()) {
    first = call.transaction.Spawn(place, order->motion);
    if (!first.ok()) status = {first.status().code(), absl::StrCat("spawn: ", first.status().message())};
  }
  if (!status.ok()) {
    // A body that is made counts against the tick's spawns; a try that fails has to cost something.
    call.instructions += work;
    return status;
  }
  for (std::size_t member = 0; member < prefab->bodies.size(); ++member) {
    call.transaction.Own(WithMember(*first, member))->record.expires = order->expires;
  }
  if (order->predicted != PlayerNumber()) {
    call.claimed = true;
    // A client that shows nothing of its own, such as a bot's, asks for nothing either.
    if (call.claim != 0) call.transaction.Own(*first)->record.tuning.claim = SpawnClaim{order->predicted, call.claim};
  }
  return ToInterface(GameValue(*first));
}

}  // namespace tessera::game

#include "core/game/spawn_calls.h"

#include <algorithm>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/option_reader.h"
#include "core/world/limits.h"
#include "core/world/prefab.h"

namespace tessera::game {
namespace {

absl::Status Outside(std::string_view function, Vec3d place) {
  return ArgumentFault(function,
                       absl::StrCat("(", place.x, ", ", place.y, ", ", place.z, ") is outside the scene's bounds"));
}

// Where and how fast, and when it expires; 0: never.
struct SpawnOrder {
  SpawnMotion motion;
  Tick expires;
};

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
  if (absl::Status status = options.status(); !status.ok()) return status;
  return order;
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
  const auto place = static_cast<std::size_t>(prefab - scene.prefabs.begin());
  const absl::StatusOr<BodyId> first = call.transaction.Spawn(place, order->motion);
  if (!first.ok()) return absl::Status(first.status().code(), absl::StrCat("spawn: ", first.status().message()));
  for (std::size_t member = 0; member < prefab->bodies.size(); ++member) {
    call.transaction.Own(WithMember(*first, member))->record.expires = order->expires;
  }
  return ToInterface(GameValue(*first));
}

}  // namespace tessera::game

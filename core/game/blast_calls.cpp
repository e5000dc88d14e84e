#include "core/game/blast_calls.h"

#include <algorithm>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/blast.h"
#include "core/game/mail.h"
#include "core/game/option_reader.h"
#include "core/game/settings.h"
#include "core/world/query.h"

namespace tessera::game {
namespace {

constexpr std::uint64_t kInstructionsOfBlast = 200;  // each region that it reaches goes through its bodies

struct FalloffName {
  std::string_view name;
  BlastFalloff falloff;
};
constexpr FalloffName kFalloffs[] = {
    {"none", BlastFalloff::kNone}, {"linear", BlastFalloff::kLinear}, {"square", BlastFalloff::kSquare}};

// The layers that a name or a list of names stands for.
std::uint32_t LayersGiven(const Scene& scene, const tessera_game_value& given, OptionReader& options) {
  const bool list = given.type == TESSERA_GAME_LIST;
  std::uint32_t mask = 0;
  for (const tessera_game_value& one : std::span(list ? given.as.list : &given, list ? given.count : 1)) {
    const std::string_view name(one.as.text, one.type == TESSERA_GAME_TEXT ? one.count : 0);
    const auto layer = std::ranges::find(scene.layers, name);
    if (one.type != TESSERA_GAME_TEXT || layer == scene.layers.end()) {
      options.Fault("layers",
                    absl::StrCat("must be layers of the scene, which are: ", absl::StrJoin(scene.layers, ", ")));
      return 0;
    }
    mask |= 1U << static_cast<unsigned>(layer - scene.layers.begin());
  }
  return mask;
}

absl::StatusOr<Blast> BlastFrom(const tessera_game_call& call, const Function& function,
                                const tessera_game_value& table) {
  const Scene& scene = call.transaction.world().scene();
  OptionReader options(function, table);
  Blast blast;
  if (const auto at = options.Vector("at")) {
    blast.at = *at;
    if (!scene.bounds.Contains(*at)) options.Fault("at", "is outside the scene's bounds");
  } else {
    options.Fault("at", "is missing");
  }
  const auto radius = options.Number("radius", 1e-3, kMaxBlastRadius_m);
  const auto impulse = options.Number("impulse", -kMaxBlastImpulse_ns, kMaxBlastImpulse_ns);
  if (!radius) options.Fault("radius", "is missing");
  if (!impulse) options.Fault("impulse", "is missing");
  blast.radius_m = radius.value_or(1);
  blast.impulse_ns = impulse.value_or(0);
  blast.speed_m_s = options.Number("speed", 0, kMaxGameSpeed_m_s);
  blast.lift = options.Number("lift", 0, 1).value_or(0);
  if (const auto falloff = options.Text("falloff", 16)) {
    const auto* const named = std::ranges::find(kFalloffs, *falloff, &FalloffName::name);
    if (named == std::end(kFalloffs)) {
      options.Fault("falloff", "is none of none, linear, square");
    } else {
      blast.falloff = named->falloff;
    }
  }
  if (const auto* layers = options.Any("layers")) blast.layers = LayersGiven(scene, *layers, options);
  blast.name = std::string(options.Text("name", kMaxBlastNameBytes).value_or(""));
  if (absl::Status status = options.status(); !status.ok()) return status;
  return blast;
}

}  // namespace

absl::StatusOr<tessera_game_value> CallExplode(tessera_game_call& call, const Function& function,
                                               std::span<const tessera_game_value> arguments) {
  absl::StatusOr<Blast> blast = BlastFrom(call, function, arguments[0]);
  if (!blast.ok()) return blast.status();
  const auto id = call.transaction.NextJoint();
  if (!id) return absl::ResourceExhaustedError("explode: the region has given all its numbers");
  blast->id = id->value();
  blast->by = call.self == kInstanceBody ? BodyId() : call.self;
  BodyQuery reach;
  reach.shape = SphereShape{blast->radius_m};
  reach.from = reach.to = blast->at;
  blast->due = call.tick + DeliveryTicks(call.transaction.world().HopsFor(reach));
  blast->ends = blast->due + kBlastLife_s * call.transaction.world().scene().tick_rate_hz;
  call.instructions += kInstructionsOfBlast;
  if (absl::Status status = call.transaction.Explode(*std::move(blast)); !status.ok()) {
    return absl::Status(status.code(), absl::StrCat("explode: ", status.message()));
  }
  return tessera_game_value{};
}

}  // namespace tessera::game

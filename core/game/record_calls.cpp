#include "core/game/record_calls.h"

#include <algorithm>
#include <limits>
#include <string>
#include <variant>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {
namespace {

absl::string_view AsView(std::string_view text) { return {text.data(), text.size()}; }

std::string NamesOf(std::span<const PropertyDef> declared) {
  return declared.empty()
             ? "none"
             : absl::StrJoin(declared, ", ", [](std::string* out, const PropertyDef& def) { out->append(def.name); });
}

}  // namespace

absl::StatusOr<Tick> TicksAhead(std::string_view function, std::string_view name, Tick now, std::int64_t ticks) {
  if (ticks >= 1 && ticks <= kMaxTimerTicks) return now + static_cast<std::uint64_t>(ticks);
  return absl::InvalidArgumentError(
      absl::StrCat(AsView(function), ": `", AsView(name), "` must be 1 to ", kMaxTimerTicks, ", got ", ticks));
}

absl::StatusOr<tessera_game_value> GetProperty(tessera_game_call& call, std::span<const PropertyDef> declared,
                                               const PropertySet& of_scene, const PropertySet& changed,
                                               std::string_view name) {
  const std::optional<PropertyValue> value = ValueOf(declared, of_scene, changed, name);
  if (!value) {
    return absl::NotFoundError(
        absl::StrCat("get: no property \"", AsView(name), "\"; the scene declares: ", NamesOf(declared)));
  }
  if (const auto* flag = std::get_if<bool>(&*value)) return ToInterface(GameValue(*flag));
  if (const auto* whole = std::get_if<std::int64_t>(&*value)) return ToInterface(GameValue(*whole));
  if (const auto* real = std::get_if<double>(&*value)) return ToInterface(GameValue(*real));
  if (const auto* vector = std::get_if<Vec3d>(&*value)) return ToInterface(GameValue(*vector));
  if (const auto* body = std::get_if<BodyId>(&*value)) {
    return *body == BodyId() ? tessera_game_value{} : ToInterface(GameValue(*body));
  }
  if (const auto* blob = std::get_if<PropertyBytes>(&*value)) {
    call.text.assign(blob->bytes.begin(), blob->bytes.end());
  } else {
    call.text = std::get<std::string>(*value);
  }
  tessera_game_value result{};
  result.type = TESSERA_GAME_TEXT;
  result.count = static_cast<std::uint32_t>(call.text.size());
  result.as.text = call.text.data();
  return result;
}

absl::Status SetProperty(std::span<const PropertyDef> declared, std::string_view name, const tessera_game_value& value,
                         PropertySet& properties) {
  const auto def = std::ranges::find(declared, name, &PropertyDef::name);
  absl::Status status = absl::NotFoundError(absl::StrCat("no property \"", AsView(name), "\""));
  if (def != declared.end()) {
    std::optional<PropertyValue> given = PropertyFrom(value, *def);
    status = given ? properties.Set(declared, name, *std::move(given))
                   : absl::InvalidArgumentError("`value` is of a type that no property has");
  }
  return status.ok() ? status : absl::InvalidArgumentError(absl::StrCat("set: ", status.message()));
}

absl::Status CheckProperty(std::span<const PropertyDef> declared, std::string_view name,
                           const tessera_game_value& value) {
  PropertySet alone;
  return SetProperty(declared, name, value, alone);
}

absl::StatusOr<std::int64_t> SetTimer(Tick now, std::span<const tessera_game_value> arguments, GameRecord& record) {
  const std::string_view name(arguments[1].as.text, arguments[1].count);
  const absl::StatusOr<Tick> due = TicksAhead("after", "ticks", now, arguments[0].as.whole);
  if (!due.ok()) return due.status();
  if (name.empty() || name.size() > kMaxTimerNameBytes) {
    return absl::InvalidArgumentError("after: `name` must have 1 to 32 bytes");
  }
  if (record.timers.size() >= kMaxTimers) {
    return absl::ResourceExhaustedError(absl::StrCat("after: the body has ", kMaxTimers, " timers already"));
  }
  if (record.last_timer == std::numeric_limits<std::uint32_t>::max()) {
    return absl::ResourceExhaustedError("after: the body has used up the numbers of timers");
  }
  GameTimer timer;
  timer.due = *due;
  timer.number = record.last_timer + 1;
  timer.name = std::string(name);
  if (arguments.size() > 2 && arguments[2].type != TESSERA_GAME_NOTHING) {
    const auto fields = FieldsFrom(arguments[2]);
    if (!fields.ok()) return absl::InvalidArgumentError(absl::StrCat("after: ", fields.status().message()));
    auto bytes = EncodeFields(*fields);
    if (!bytes.ok()) return absl::InvalidArgumentError(absl::StrCat("after: ", bytes.status().message()));
    timer.values = *std::move(bytes);
  }
  ++record.last_timer;
  const auto at = std::ranges::upper_bound(record.timers, timer.due, {}, &GameTimer::due);
  record.timers.insert(at, std::move(timer));
  return record.last_timer;
}

absl::Status ShowTo(const Scene& scene, const BodyDef& def, std::string_view who, GameRecord& record) {
  if (def.motion != Motion::kDynamic) {
    return absl::InvalidArgumentError("show_to: the body does not move, and every client has the scene");
  }
  if (who == "everyone") {
    record.tuning.visible_to = Visibility::kEveryone;
  } else if (who == "team") {
    if (scene.team_property.empty()) return absl::FailedPreconditionError("show_to: the scene has no team_property");
    record.tuning.visible_to = Visibility::kTeam;
  } else if (who == "servers") {
    record.tuning.visible_to = Visibility::kServers;
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("show_to: `who` must be everyone, team or servers, got ", AsView(who.substr(0, 32))));
  }
  if (record.tuning.visible_to == def.visible_to) record.tuning.visible_to.reset();
  return absl::OkStatus();
}

bool CancelTimer(GameRecord& record, std::int64_t number) {
  return std::erase_if(record.timers, [&](const GameTimer& timer) { return timer.number == number; }) > 0;
}

}  // namespace tessera::game

#include "gateway/gateway_message.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace tessera::gateway {
namespace {

using Json = nlohmann::ordered_json;

std::string Text(const Json& message) { return message.dump(-1, ' ', false, Json::error_handler_t::replace); }
std::string IdText(BodyId body) { return std::to_string(body.value()); }
Json Triple(const Vec3d& v) { return Json::array({v.x, v.y, v.z}); }

std::string StateName(v1::InstanceState state) {
  return std::string(absl::StripPrefix(v1::InstanceState_Name(state), "INSTANCE_STATE_"));
}

Json ValueOf(const PropertyValue& value) {
  if (const bool* flag = std::get_if<bool>(&value)) return *flag;
  if (const std::int64_t* number = std::get_if<std::int64_t>(&value)) return *number;
  if (const double* number = std::get_if<double>(&value)) return *number;
  if (const std::string* text = std::get_if<std::string>(&value)) return *text;
  if (const Vec3d* vector = std::get_if<Vec3d>(&value)) return Triple(*vector);
  if (const BodyId* body = std::get_if<BodyId>(&value)) return IdText(*body);
  return PropertyText(value);
}

Json RegionFigures(const v1::RegionStatus& status, std::uint32_t standby, const HeardRegion* heard) {
  const v1::WorkerReport& report = status.report();
  Json figures{{"region", status.region()},
               {"host", status.host()},
               {"standby", standby},
               {"alive", heard != nullptr && !status.host().empty()},
               {"tick", report.tick()},
               {"tick_rate_hz", report.tick_rate_hz()},
               {"step_p50_ms", report.step().p50_seconds() * 1e3},
               {"step_p99_ms", report.step().p99_seconds() * 1e3},
               {"bodies", report.owned()},
               {"ghosts", report.ghosts()},
               {"asleep", report.asleep()},
               {"players", report.connected_players_size()},
               {"memory_bytes", report.resident_bytes()}};
  if (heard != nullptr && heard->work) {
    figures["broadcast_ms"] = heard->work->broadcast_ms;
    figures["prediction_ms"] = heard->work->prediction_ms;
  }
  return figures;
}

Json RegionsOf(const v1::Instance& instance, const HeardRegions& heard) {
  Json regions = Json::array();
  for (const v1::MapRegion& region : instance.map().regions()) {
    v1::RegionStatus status;
    status.set_region(region.id());
    for (const v1::RegionStatus& known : instance.region_status()) {
      if (known.region() == region.id()) status = known;
    }
    const auto known = heard.find(region.id());
    regions.push_back(RegionFigures(status, region.standby(), known == heard.end() ? nullptr : &known->second));
  }
  return regions;
}

bool IsConnected(const v1::Instance& instance, std::uint32_t player) {
  const auto& regions = instance.region_status();
  return std::any_of(regions.begin(), regions.end(), [player](const v1::RegionStatus& status) {
    const auto& connected = status.report().connected_players();
    return std::find(connected.begin(), connected.end(), player) != connected.end();
  });
}

}  // namespace

Problem ProblemOf(const absl::Status& status) {
  const std::string text(status.message());
  switch (status.code()) {
    case absl::StatusCode::kNotFound:
      return {.code = "no_world", .text = text};
    case absl::StatusCode::kFailedPrecondition:
      return {.code = absl::StrContains(text, "failed") ? "failed" : "ended", .text = text};
    case absl::StatusCode::kOk:
      return {.code = "ended", .text = "the world has ended"};
    case absl::StatusCode::kResourceExhausted:
      return {.code = "full", .text = text, .again_s = 5};
    case absl::StatusCode::kInvalidArgument:
      return {.code = "no_world", .text = text};
    // No time helps: the gateway needs another token.
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return {.code = "not_allowed",
              .text = absl::StrCat(text,
                                   "; start the gateway with --token-file and a viewer's token (tessera token create); "
                                   "who plays shows an operator's of his own, or has it from the gateway")};
    default:
      return {.code = "no_control_plane", .text = text, .again_s = 2};
  }
}

std::optional<Problem> ProblemOf(const v1::Instance& instance) {
  const std::string why = instance.reason().empty() ? "" : absl::StrCat(": ", instance.reason());
  switch (instance.state()) {
    case v1::INSTANCE_STATE_STOPPING:
    case v1::INSTANCE_STATE_ENDED:
      return Problem{.code = "ended", .text = absl::StrCat("instance ", instance.id(), " has ended", why)};
    case v1::INSTANCE_STATE_FAILED:
      return Problem{.code = "failed", .text = absl::StrCat("instance ", instance.id(), " has failed", why)};
    default:
      return std::nullopt;
  }
}

std::string ProblemMessage(const Problem& problem) {
  Json message{{"type", "problem"}, {"code", problem.code}, {"text", problem.text}};
  if (problem.again_s > 0) message["again_s"] = problem.again_s;
  return Text(message);
}

RegionWork WorkOf(const replication::RegionFigures& now, const replication::RegionFigures& before) {
  const auto mean_ms = [](std::uint64_t count, std::uint64_t total_ns) {
    return count == 0 ? 0.0 : static_cast<double>(total_ns) / static_cast<double>(count) / 1e6;
  };
  const auto count = [](const replication::RegionFigures& of) {
    return of.snapshot_full.count + of.snapshot_delta.count;
  };
  const auto total_ns = [](const replication::RegionFigures& of) {
    return of.snapshot_full.total_ns + of.snapshot_delta.total_ns;
  };
  return {.broadcast_ms = mean_ms(count(now) - count(before), total_ns(now) - total_ns(before)),
          .prediction_ms = mean_ms(now.prediction.count - before.prediction.count,
                                   now.prediction.total_ns - before.prediction.total_ns)};
}

std::string StatusMessage(const v1::Instance& instance, double age_s, const HeardRegions& heard) {
  Json changes = Json::array(), players = Json::array(), unprotected = Json::array();
  for (const v1::InstanceChange& change : instance.changes()) changes.push_back(change.text());
  for (const std::uint32_t region : instance.unprotected_regions()) unprotected.push_back(region);
  for (const v1::Player& player : instance.player_list()) {
    if (player.left()) continue;
    players.push_back(
        {{"player", player.number()}, {"name", player.name()}, {"connected", IsConnected(instance, player.number())}});
  }
  return Text({{"type", "status"},
               {"state", StateName(instance.state())},
               {"reason", instance.reason()},
               {"age_s", age_s},
               {"players", instance.players()},
               {"ticks_per_second", instance.ticks_per_second()},
               {"regions", RegionsOf(instance, heard)},
               {"changes", std::move(changes)},
               {"failovers", instance.failovers()},
               {"lost_bodies", instance.lost_bodies()},
               {"unprotected", std::move(unprotected)},
               {"player_list", std::move(players)}});
}

std::string EventsMessage(const std::vector<v1::InstanceEvent>& events) {
  Json list = Json::array();
  for (const v1::InstanceEvent& event : events) {
    list.push_back({{"time", google::protobuf::util::TimeUtil::ToString(event.time())}, {"text", event.text()}});
  }
  return Text({{"type", "events"}, {"events", std::move(list)}});
}

std::string MetMessage(const client::ClientEvent& event) {
  using Kind = client::ClientEvent::Kind;
  if (event.kind == Kind::kPredictionCorrected) {
    return Text({{"type", "corrected"}, {"body", IdText(event.body)}, {"text", event.detail}});
  }
  const char* kind = event.kind == Kind::kContactBegan     ? "contact_began"
                     : event.kind == Kind::kContactEnded   ? "contact_ended"
                     : event.kind == Kind::kTriggerEntered ? "trigger_entered"
                     : event.kind == Kind::kTriggerLeft    ? "trigger_left"
                                                           : nullptr;
  if (kind == nullptr) return "";
  Json message{{"type", "met"}, {"kind", kind}, {"body", IdText(event.body)}, {"other", IdText(event.other)}};
  if (event.contact) {
    message["point"] = Triple(event.contact->point);
    message["impulse"] = event.contact->impulse;
  }
  return Text(message);
}

std::string DetailMessage(const client::Client& client, BodyId body) {
  Json message{{"type", "detail"}, {"body", IdText(body)}};
  const BodyDef* def = client.DefOf(body);
  const auto seen = client.World().find(body);
  const bool is_static = def != nullptr && def->motion == Motion::kStatic;
  if (def == nullptr || (seen == client.World().end() && !is_static)) {
    message["gone"] = true;
    return Text(message);
  }
  const PlayerNumber player = PlayerOf(body);
  message["name"] = player == PlayerNumber() ? def->name : client.NameOf(player);
  message["mass_kg"] = def->mass_kg;
  if (seen != client.World().end()) {
    const client::SeenBody& state = seen->second;
    message["owner"] = state.region.value();
    message["epoch"] = state.epoch.value();
    message["tick"] = state.tick.value();
    message["position"] = Triple(state.state.position);
    message["linear_velocity"] = Triple(Vec3d(state.state.linear_velocity));
    message["angular_velocity"] = Triple(Vec3d(state.state.angular_velocity));
    message["asleep"] = state.state.asleep;
  } else {
    message["position"] = Triple(def->initial.position);
  }
  Json properties = Json::object();
  for (const PropertyDef& property : client.scene().properties) {
    if (const auto value = client.PropertyOf(body, property.name)) properties[property.name] = ValueOf(*value);
  }
  message["properties"] = std::move(properties);
  return Text(message);
}

PropertyValues ValuesOf(const client::Client& client, const std::string& property) {
  PropertyValues values;
  const std::vector<PropertyDef>& declared = client.scene().properties;
  const bool known =
      std::any_of(declared.begin(), declared.end(), [&](const auto& def) { return def.name == property; });
  if (!known) return values;
  for (const auto& [body, seen] : client.World()) {
    if (const auto value = client.PropertyOf(body, property)) values[body] = Text(ValueOf(*value));
  }
  return values;
}

std::string WorldMessage(const client::Client& client) {
  Json properties = Json::object();
  for (const PropertyDef& def : client.scene().instance_properties) {
    if (def.visible_to != Visibility::kEveryone) continue;
    if (const auto value = client.WorldPropertyOf(def.name)) properties[def.name] = ValueOf(*value);
  }
  return properties.empty() ? "" : Text({{"type", "world"}, {"properties", std::move(properties)}});
}

std::string ValuesMessage(const std::string& property, const PropertyValues& values) {
  std::string list;
  for (const auto& [body, value] : values) {
    absl::StrAppend(&list, list.empty() ? "" : ",", "\"", body.value(), "\":", value);
  }
  return absl::StrCat(R"({"type":"values","property":)", Text(property), R"(,"values":{)", list, "}}");
}

std::string AnswerMessage(std::uint64_t number, const absl::Status& status, const std::string& text,
                          const std::string& needs) {
  Json message{{"type", "answer"},
               {"number", number},
               {"ok", status.ok()},
               {"text", status.ok() ? text : std::string(status.message())}};
  if (!needs.empty()) message["needs"] = needs;
  return Text(message);
}

std::string RecordingMessage(const RecordingState& state) {
  return Text({{"type", "recording"},
               {"on", state.on},
               {"file", state.file},
               {"bytes", state.bytes},
               {"problem", state.problem}});
}

std::string PlayMessage(const PlayState& state) {
  return Text({{"type", "play"},
               {"file", state.file},
               {"begin_s", 0},
               {"end_s", state.length_s},
               {"at_s", state.at_s},
               {"paused", state.paused},
               {"speed", state.speed}});
}

std::string RecordingsPage(const std::vector<ListedRecording>& recordings) {
  Json list = Json::array();
  for (const ListedRecording& recording : recordings) {
    Json entry{{"file", recording.file}, {"instance", recording.instance}, {"bytes", recording.bytes}};
    entry["seconds"] = recording.seconds ? Json(*recording.seconds) : Json();
    list.push_back(std::move(entry));
  }
  return Text({{"recordings", std::move(list)}});
}

std::string WorldsPage(const std::vector<v1::Instance>& instances, const std::string& problem) {
  Json worlds = Json::array();
  for (const v1::Instance& instance : instances) {
    worlds.push_back({{"instance", instance.id()},
                      {"scene", instance.scene_name()},
                      {"state", StateName(instance.state())},
                      {"regions", instance.regions()},
                      {"players", instance.players()}});
  }
  Json page{{"worlds", std::move(worlds)}};
  if (!problem.empty()) page["problem"] = problem;
  return Text(page);
}

}  // namespace tessera::gateway

#include "cli/client_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace tessera::cli {
namespace {

using client::ClientState;
using client::ClientStats;
using client::DurationSummary;

nlohmann::ordered_json Json(const DurationSummary& d) {
  return {{"count", d.count}, {"mean_s", d.mean_s}, {"p50_s", d.p50_s}, {"p99_s", d.p99_s}, {"max_s", d.max_s}};
}

TableRow DurationRow(const std::string& name, const DurationSummary& d) {
  return {name,
          std::to_string(d.count),
          FormatMillis(d.mean_s),
          FormatMillis(d.p50_s),
          FormatMillis(d.p99_s),
          FormatMillis(d.max_s)};
}

// By its name in the scene, where it has one.
std::string BodyName(const client::Client& client, BodyId id) {
  if (IsPlayerBody(id)) return fmt::format("player {}", PlayerOf(id).value());
  const auto& bodies = client.scene().bodies;
  const auto found = std::lower_bound(bodies.begin(), bodies.end(), id,
                                      [](const BodyDef& def, BodyId wanted) { return def.id < wanted; });
  const bool named = found != bodies.end() && found->id == id && !found->name.empty();
  return named ? fmt::format("body {} ({})", id.value(), found->name) : fmt::format("body {}", id.value());
}

// ": health 80".
std::string PropertyChangeText(const client::Client& client, const client::ClientEvent& event) {
  const std::optional<PropertyValue> value = client.PropertyOf(event.body, event.property);
  if (!value) return "";
  const auto* words = std::get_if<std::string>(&*value);
  return fmt::format(": {} {}", event.property, words != nullptr ? *words : PropertyText(*value));
}

std::string ClockText(const client::WorldClock& clock) {
  return clock.paused ? std::string("the world is paused")
                      : fmt::format("the world makes {} ticks a second", clock.ticks_per_second);
}

}  // namespace

std::string StateName(ClientState state) {
  switch (state) {
    case ClientState::kJoining:
      return "JOINING";
    case ClientState::kWaiting:
      return "WAITING";
    case ClientState::kPlaying:
      return "PLAYING";
    case ClientState::kEnded:
      return "ENDED";
  }
  return "?";
}

std::string EventLine(const client::Client& client, const client::ClientEvent& event) {
  using Kind = client::ClientEvent::Kind;
  const auto what = [&]() -> std::string {
    const std::string body = BodyName(client, event.body);
    const std::string pair = body + " and " + BodyName(client, event.other);
    switch (event.kind) {
      case Kind::kAppeared:
        return body + " appeared";
      case Kind::kVanished:
        return body + " vanished";
      case Kind::kStarted:
        return "the world moves";
      case Kind::kInputRefused:
        return fmt::format("input {} refused: {}", event.input_number, event.detail);
      case Kind::kRegionLost:
        return "lost";
      case Kind::kRegionBack:
        return "back";
      case Kind::kMapChanged:
        return fmt::format("map {}", client.map().version().value());
      case Kind::kEnded:
        return "ended: " + event.detail;
      case Kind::kContactBegan:
        return pair + " touch";
      case Kind::kContactEnded:
        return pair + " part";
      case Kind::kTriggerEntered:
        return pair + " overlap: trigger entered";
      case Kind::kTriggerLeft:
        return pair + " do not overlap any more: trigger left";
      case Kind::kRecordingEnded:
        return "recording ended: " + event.detail;
      case Kind::kPropertyChanged:
        return body + PropertyChangeText(client, event);
      case Kind::kClockChanged:
        return ClockText(client.clock());
      case Kind::kCommandRefused:
        return fmt::format("command {} refused: {}", event.input_number, event.detail);
      case Kind::kGrantNeeded:
        return "no known address answers: a newer grant is needed";
      case Kind::kRestored:
        return "the world goes on from an earlier moment";
      case Kind::kWorldPropertyChanged: {
        const std::optional<PropertyValue> value = client.WorldPropertyOf(event.property);
        return fmt::format("world: {} = {}", event.property, value ? PropertyText(*value) : "?");
      }
      case Kind::kPredictionCorrected:
        return "prediction corrected by " + event.detail;
      case Kind::kMovementMissing:
        return "not predicted: " + event.detail;
      case Kind::kSpawnTaken:
        return body + " takes the place of what was predicted, " + event.detail;
      case Kind::kSpawnLost:
        return "what was predicted is gone: " + event.detail;
      case Kind::kTileCame:
        return fmt::format("tile {} of the level came", event.tile);
      case Kind::kTileGone:
        return fmt::format("tile {} of the level went", event.tile);
    }
    return "?";
  };
  const std::string region = event.region == RegionId() ? "" : fmt::format("region {}: ", event.region.value());
  return fmt::format("tick {}: {}{}\n", client.tick().value(), region, what());
}

std::string ClientLine(local::Bot& bot) {
  const ClientStats stats = bot.client().Stats();
  return fmt::format("{}{} tick {}, {} bodies, {}/s in, {} behind, {} extrapolated, {} pairs begun, {} ended\n",
                     StateName(bot.client().state()), bot.client().clock().paused ? ", world paused," : "",
                     bot.client().tick().value(), stats.bodies, FormatBytes(stats.bytes_in_per_s),
                     FormatMillis(stats.snapshot_delay_s), stats.extrapolations, bot.pairs_begun(), bot.pairs_ended());
}

std::string ClientTable(const std::vector<local::Bot*>& bots) {
  std::vector<TableRow> rows{
      {"CLIENT", "STATE", "BODIES", "IN/S", "OUT/S", "DELAY", "JITTER", "EXTRAPOLATED", "LOST", "ERRORS", "BORDERS"}};
  for (local::Bot* bot : bots) {
    const ClientStats stats = bot->client().Stats();
    rows.push_back({bot->name(), StateName(bot->client().state()), std::to_string(stats.bodies),
                    FormatBytes(stats.bytes_in_per_s), FormatBytes(stats.bytes_out_per_s),
                    FormatMillis(stats.snapshot_delay_s), FormatMillis(stats.jitter_s),
                    std::to_string(stats.extrapolations), std::to_string(stats.datagrams_lost),
                    std::to_string(stats.decode_errors), std::to_string(bot->region_changes())});
  }
  return FormatTable(rows);
}

std::string ClientReport(local::Bot& bot) {
  const ClientStats stats = bot.client().Stats();
  std::vector<TableRow> regions{{"REGION", "ROUND-TRIP", "DATAGRAMS", "LOST", "ERRORS", "RECONNECTS"}};
  for (const client::RegionStats& region : stats.regions) {
    regions.push_back({std::to_string(region.region.value()), FormatMillis(region.round_trip_s),
                       std::to_string(region.datagrams), std::to_string(region.datagrams_lost),
                       std::to_string(region.decode_errors), std::to_string(region.reconnects)});
  }
  return ClientTable({&bot}) + "\n" + FormatTable(regions) + "\n" +
         FormatTable({{"TIME", "COUNT", "MEAN", "P50", "P99", "MAX"},
                      DurationRow("frame", stats.frame_time),
                      DurationRow("network", stats.network_time),
                      DurationRow("update", stats.update_time)});
}

nlohmann::ordered_json ClientJson(local::Bot& bot) {
  const ClientStats stats = bot.client().Stats();
  return {{"name", bot.name()},
          {"player", bot.client().player().value()},
          {"state", StateName(bot.client().state())},
          {"tick", bot.client().tick().value()},
          {"bodies", stats.bodies},
          {"bytes_in", stats.bytes_in},
          {"bytes_out", stats.bytes_out},
          {"bytes_in_per_s", stats.bytes_in_per_s},
          {"snapshot_delay_s", stats.snapshot_delay_s},
          {"jitter_s", stats.jitter_s},
          {"extrapolations", stats.extrapolations},
          {"datagrams_lost", stats.datagrams_lost},
          {"decode_errors", stats.decode_errors},
          {"full_records", stats.full_records},
          {"delta_records", stats.delta_records},
          {"inputs_refused", stats.inputs_refused},
          {"region_changes", bot.region_changes()},
          {"pairs_begun", bot.pairs_begun()},
          {"pairs_ended", bot.pairs_ended()},
          {"last_applied_input", bot.client().last_applied_input()},
          {"frame_time", Json(stats.frame_time)},
          {"network_time", Json(stats.network_time)},
          {"update_time", Json(stats.update_time)}};
}

}  // namespace tessera::cli

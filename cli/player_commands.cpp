// tessera player list | kick | ban | unban | bans
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "absl/strings/numbers.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_view.h"
#include "cli/table.h"
#include "local_cluster/command_error.h"
#include "local_cluster/connection.h"

namespace tessera::cli {
namespace {

constexpr char kWholeCluster[] = "all";

struct PlayerOptions {
  std::string instance, player, reason;
};

// A number is one; an id that is a number is written "id:7".
template <class Request>
void SetPlayer(const std::string& text, Request& request) {
  std::uint32_t number = 0;
  if (text.rfind("id:", 0) == 0) {
    request.set_player_id(text.substr(3));
  } else if (absl::SimpleAtoi(text, &number)) {
    request.set_number(number);
  } else {
    request.set_player_id(text);
  }
}

std::string InstanceOf(const PlayerOptions& options) {
  return options.instance == kWholeCluster ? "" : options.instance;
}

std::vector<std::uint32_t> ConnectedIn(const v1::Instance& instance) {
  std::vector<std::uint32_t> connected;
  for (const v1::RegionStatus& region : instance.region_status()) {
    const auto& players = region.report().connected_players();
    connected.insert(connected.end(), players.begin(), players.end());
  }
  return connected;
}

void ListPlayers(const Globals& globals, const PlayerOptions& options) {
  local::Connection connection = Connect(globals);
  const v1::Instance instance = GetInstance(connection, "player list", options.instance);
  const std::vector<std::uint32_t> connected = ConnectedIn(instance);
  std::vector<TableRow> rows{{"NUMBER", "PLAYER", "NAME", "STATE"}};
  for (const v1::Player& player : instance.player_list()) {
    if (player.left()) continue;
    if (globals.format == Format::kName) std::cout << "player/" << player.number() << "\n";
    if (globals.format == Format::kJson) std::cout << ToJson(player);
    const bool here = std::find(connected.begin(), connected.end(), player.number()) != connected.end();
    rows.push_back({std::to_string(player.number()), player.player_id().empty() ? "guest" : player.player_id(),
                    player.name(),
                    here              ? "connected"
                    : player.parked() ? "parked"
                                      : "away"});
  }
  if (globals.format == Format::kName || globals.format == Format::kJson) return;
  if (rows.size() == 1) {
    std::cerr << fmt::format("nobody plays in {}\n", options.instance);
    return;
  }
  std::cout << FormatTable(rows);
}

void KickPlayer(const Globals& globals, const PlayerOptions& options) {
  local::Connection connection = Connect(globals);
  v1::KickPlayerRequest request;
  request.set_id(options.instance);
  SetPlayer(options.player, request);
  request.set_reason(options.reason);
  const auto response =
      connection.Call("player kick", connection.instances(), &v1::InstanceService::Stub::KickPlayer, request);
  PrintChange(globals, "player", std::to_string(response.number()), "kicked from " + options.instance, false, response);
}

void BanPlayer(const Globals& globals, const PlayerOptions& options) {
  local::Connection connection = Connect(globals);
  v1::BanPlayerRequest request;
  request.set_id(InstanceOf(options));
  SetPlayer(options.player, request);
  request.set_reason(options.reason);
  const auto response =
      connection.Call("player ban", connection.instances(), &v1::InstanceService::Stub::BanPlayer, request);
  PrintChange(globals, "player", response.ban().player_id(), "banned from " + options.instance, false, response);
}

void UnbanPlayer(const Globals& globals, const PlayerOptions& options) {
  local::Connection connection = Connect(globals);
  v1::UnbanPlayerRequest request;
  request.set_id(InstanceOf(options));
  request.set_player_id(options.player.rfind("id:", 0) == 0 ? options.player.substr(3) : options.player);
  const auto response =
      connection.Call("player unban", connection.instances(), &v1::InstanceService::Stub::UnbanPlayer, request);
  PrintChange(globals, "player", request.player_id(), "unbanned from " + options.instance, false, response);
}

void ListBans(const Globals& globals, const PlayerOptions& options) {
  local::Connection connection = Connect(globals);
  v1::ListBansRequest request;
  request.set_id(InstanceOf(options));
  const auto response =
      connection.Call("player bans", connection.instances(), &v1::InstanceService::Stub::ListBans, request);
  if (globals.format == Format::kJson) {
    std::cout << ToJson(response);
    return;
  }
  std::vector<TableRow> rows{{"PLAYER", "AGE", "REASON"}};
  for (const v1::Ban& ban : response.bans()) {
    if (globals.format == Format::kName) std::cout << "player/" << ban.player_id() << "\n";
    rows.push_back({ban.player_id(), FormatAge(AgeSeconds(ban.create_time())), ban.reason()});
  }
  if (globals.format == Format::kName) return;
  if (rows.size() == 1) {
    std::cerr << fmt::format("nobody is banned from {}\n", options.instance);
    return;
  }
  std::cout << FormatTable(rows);
}

}  // namespace

void AddPlayerCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<PlayerOptions>();
  CLI::App* player = app.add_subcommand("player", "Who plays, and who may")->require_subcommand(1);
  const auto add = [&](const char* name, const char* about, const char* instance) {
    CLI::App* command = player->add_subcommand(name, about);
    command->add_option("instance", options->instance, instance)->required();
    return command;
  };
  const auto add_player = [&](CLI::App* command, const char* about) {
    command->add_option("player", options->player, about)->required();
  };
  const auto add_reason = [&](CLI::App* command) {
    command->add_option("--reason", options->reason, "What the player is told, at most 200 bytes");
  };
  constexpr char kOne[] = "Id of the instance", kOneOrAll[] = "Id of the instance, or all for the whole cluster";
  constexpr char kNumberOrId[] = "The player's number, or the id of its tickets (id:7 if that is a number)";
  add("list", "List the players of an instance", kOne)->callback([&globals, options] {
    ListPlayers(globals, *options);
  });
  CLI::App* kick = add("kick", "End a player's session; it may join again", kOne);
  add_player(kick, kNumberOrId);
  add_reason(kick);
  kick->callback([&globals, options] { KickPlayer(globals, *options); });
  CLI::App* ban = add("ban", "End a player's sessions, and let it in no more", kOneOrAll);
  add_player(ban, kNumberOrId);
  add_reason(ban);
  ban->callback([&globals, options] { BanPlayer(globals, *options); });
  CLI::App* unban = add("unban", "Let a player in again", kOneOrAll);
  add_player(unban, "The id of the player's tickets");
  unban->callback([&globals, options] { UnbanPlayer(globals, *options); });
  add("bans", "List who is let in no more", kOneOrAll)->callback([&globals, options] { ListBans(globals, *options); });
}

}  // namespace tessera::cli

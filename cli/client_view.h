// How a bot's view of the world is shown: in the demo's table, by `tessera client`, as JSON.
#pragma once

#include <chrono>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/table.h"
#include "local_cluster/bot.h"

namespace tessera::cli {

// Between two frames of a bot: a game's 60 a second.
inline constexpr std::chrono::milliseconds kFrameTime{16};

std::string StateName(client::ClientState state);
// "PLAYING tick 812, 2002 bodies, 412.1kB/s in, 58.20ms behind, 0 extrapolated\n"
std::string ClientLine(local::Bot& bot);
// "tick 812: contact began: body 12 and player 1's, reported by region 2\n"; empty for what the table shows anyway.
std::string EventLine(const client::Client& client, const client::ClientEvent& event);
// A row a client: state, bytes, delay, extrapolations.
std::string ClientTable(const std::vector<local::Bot*>& bots);
// Everything it measured, for people and for programs.
std::string ClientReport(local::Bot& bot);
nlohmann::ordered_json ClientJson(local::Bot& bot);

}  // namespace tessera::cli

// tessera game logs
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <utility>

#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/instance_view.h"
#include "cli/signals.h"
#include "core/world/ids.h"
#include "local_cluster/connection.h"

namespace tessera::cli {
namespace {

constexpr std::chrono::milliseconds kBetweenQuestions{500};  // workers report as often

struct LogOptions {
  std::string id;
  bool follow = false;
};

// The body that a line is about, as the other commands name it: by the player whose it is.
std::string Subject(BodyId body) {
  if (body == BodyId()) return "";
  if (IsPlayerBody(body)) return fmt::format(" player {}", PlayerOf(body).value());
  return fmt::format(" body {}", body.value());
}

std::string TextOf(const v1::GameLogLine& line) {
  const std::string body = Subject(BodyId(line.line().body()));
  return fmt::format("{:%H:%M:%S} region {} tick {}{}: {}{}\n", fmt::localtime(line.time().seconds()), line.region(),
                     line.line().tick(), body, line.line().error() ? "error: " : "", line.line().text());
}

// A control plane that was started anew numbers lines again that were heard before it.
class SeenLines {
 public:
  bool IsNew(const v1::GameLogLine& line) {
    std::uint64_t& last = last_[{line.region(), line.incarnation()}];
    return line.line().number() > std::exchange(last, std::max(last, line.line().number()));
  }

 private:
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint64_t> last_;
};

bool HasEnded(local::Connection& connection, const std::string& id) {
  const v1::InstanceState state = GetInstance(connection, "game logs", id).state();
  return state == v1::INSTANCE_STATE_ENDED || state == v1::INSTANCE_STATE_FAILED;
}

void ShowLog(const Globals& globals, const LogOptions& options) {
  StopSignal stop;
  local::Connection connection = Connect(globals);
  v1::ListGameLinesRequest request;
  request.set_id(options.id);
  SeenLines seen;
  do {
    const auto response =
        connection.Call("game logs", connection.instances(), &v1::InstanceService::Stub::ListGameLines, request);
    for (const v1::GameLogLine& line : response.lines()) {
      if (!seen.IsNew(line)) continue;
      std::cout << (globals.format == Format::kJson ? ToJson(line) : TextOf(line));
      request.set_after(line.number());
    }
    std::cout << std::flush;
    if (options.follow && response.lines().empty() && HasEnded(connection, options.id)) return;
  } while (options.follow && !stop.Wait(kBetweenQuestions));
}

}  // namespace

void AddGameLogCommand(CLI::App& game, Globals& globals) {
  auto options = std::make_shared<LogOptions>();
  CLI::App* logs = game.add_subcommand("logs", "Show what the game of an instance wrote, and its errors");
  logs->add_option("id", options->id, "Id of the instance, as 'instance list' shows it")->required();
  logs->add_flag("--follow", options->follow, "Go on until the instance ends, or Ctrl-C");
  logs->callback([&globals, options] { ShowLog(globals, *options); });
}

}  // namespace tessera::cli

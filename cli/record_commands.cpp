// tessera record start | stop | list: recordings of whole worlds, which a gateway makes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/strip.h"
#include "cli/commands.h"
#include "cli/contexts.h"
#include "cli/signals.h"
#include "cli/table.h"
#include "host/files.h"
#include "host/socket_address.h"
#include "local_cluster/command_error.h"
#include "telemetry/http_get.h"
#include "trust/control_address.h"

namespace tessera::cli {
namespace {

using namespace std::chrono_literals;
using nlohmann::ordered_json;

// A world that nobody watches is joined first.
constexpr auto kBeginTimeout = 20s;
constexpr auto kAskAgain = 100ms;

constexpr std::size_t kMaxSecretBytes = 1024;

struct RecordOptions {
  std::string gateway = "127.0.0.1:7710";
  std::string instance, token_file;
};

// Proves the right to have a world recorded: the token of the file, else the key of the gateway of `tessera up`,
// which goes to no other machine. Empty: neither is there, and the gateway says what it needs.
std::string SecretFor(const Globals& globals, const RecordOptions& options) {
  std::string file = options.token_file;
  if (file.empty()) {
    const auto control = trust::ParseControlAddress(ControlOf(globals).address, host::PortRule::kFrom1);
    const auto gateway = host::ParseSocketAddress(options.gateway, host::PortRule::kFrom1);
    if (!control.ok() || !control->is_socket() || !gateway.ok() || !host::IsLoopback(gateway->host)) return "";
    file = trust::PageKeyFile(control->socket_path);
  }
  const auto text = host::ReadFile(file, kMaxSecretBytes);
  if (!text.ok() && !options.token_file.empty()) {
    throw local::CommandError(fmt::format("--token-file {}", std::string(text.status().message())));
  }
  const std::string secret(absl::StripAsciiWhitespace(text.ok() ? *text : ""));
  // It stands in a header of the request.
  const bool printable = std::all_of(secret.begin(), secret.end(), [](char c) { return c > ' ' && c < 127; });
  if (!printable) throw local::CommandError(fmt::format("{}: holds no token", file));
  return secret;
}

ordered_json Take(const char* command, const RecordOptions& options,
                  const absl::StatusOr<telemetry::HttpAnswer>& answer) {
  if (!answer.ok()) {
    throw local::CommandError(fmt::format("{}: no gateway at {}; see --gateway ({})", command, options.gateway,
                                          std::string(answer.status().message())));
  }
  if (answer->status != 200) {
    throw local::CommandError(
        fmt::format("{}: {}", command, std::string(absl::StripTrailingAsciiWhitespace(answer->body))));
  }
  ordered_json body = ordered_json::parse(answer->body, nullptr, false);
  if (!body.is_object()) throw local::CommandError(fmt::format("{}: {} is no gateway", command, options.gateway));
  return body;
}

ordered_json Order(const Globals& globals, const char* command, const RecordOptions& options, const char* order) {
  return Take(command, options,
              telemetry::HttpPost(options.gateway, fmt::format("/api/recordings/{}/{}", options.instance, order),
                                  SecretFor(globals, options)));
}

void Print(const Globals& globals, const ordered_json& state, const std::string& line) {
  if (globals.format == Format::kJson) {
    std::cout << state.dump(2) << "\n";
  } else if (globals.format == Format::kName) {
    std::cout << state.value("file", "") << "\n";
  } else {
    std::cout << line << "\n";
  }
}

void Start(const Globals& globals, const RecordOptions& options) {
  StopSignal stop;
  const auto end = std::chrono::steady_clock::now() + kBeginTimeout;
  ordered_json state;
  do {
    state = Order(globals, "record start", options, "start");
    if (const std::string problem = state.value("problem", ""); !problem.empty()) {
      throw local::CommandError("record start: " + problem);
    }
    if (state.value("on", false)) {
      return Print(globals, state, fmt::format("{} is recorded into {}", options.instance, state.value("file", "")));
    }
  } while (!stop.Wait(kAskAgain) && std::chrono::steady_clock::now() < end);
  (void)Order(globals, "record start", options, "stop");
  throw local::CommandError(
      fmt::format("record start: {} did not let the gateway in; nothing is recorded", options.instance));
}

void Stop(const Globals& globals, const RecordOptions& options) {
  const ordered_json state = Order(globals, "record stop", options, "stop");
  const std::string file = state.value("file", "");
  if (file.empty()) {
    return Print(globals, state, fmt::format("{} was not recorded", options.instance));
  }
  Print(globals, state,
        fmt::format("{} is no longer recorded; {} has {}", options.instance, file,
                    FormatBytes(static_cast<double>(state.value("bytes", std::uint64_t{0})))));
}

void List(const Globals& globals, const RecordOptions& options) {
  const ordered_json page = Take("record list", options, telemetry::HttpGet(options.gateway, "/api/recordings"));
  const ordered_json recordings = page.value("recordings", ordered_json::array());
  if (globals.format == Format::kJson) {
    std::cout << page.dump(2) << "\n";
    return;
  }
  std::vector<TableRow> rows{{"FILE", "INSTANCE", "LENGTH", "SIZE"}};
  for (const ordered_json& recording : recordings) {
    const std::string file = recording.value("file", "");
    if (globals.format == Format::kName) {
      std::cout << file << "\n";
      continue;
    }
    const bool ended = recording.contains("seconds") && recording["seconds"].is_number();
    rows.push_back({file, recording.value("instance", ""),
                    ended ? fmt::format("{:.1f}s", recording["seconds"].get<double>()) : "not ended",
                    FormatBytes(static_cast<double>(recording.value("bytes", std::uint64_t{0})))});
  }
  if (globals.format != Format::kName) std::cout << FormatTable(rows);
}

}  // namespace

void AddRecordCommands(CLI::App& app, Globals& globals) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* record = app.add_subcommand("record", "Have a gateway record whole worlds")->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, void (*run)(const Globals&, const RecordOptions&),
                       bool of_instance) {
    CLI::App* command = record->add_subcommand(name, what);
    if (of_instance) {
      command->add_option("id", options->instance, "Id of the instance, as 'instance list' shows it")->required();
      command->add_option("--token-file", options->token_file,
                          "File with an operator's token, sent to the gateway (default: the key of `tessera up`)");
    }
    command->add_option("--gateway", options->gateway, "HTTP address of the gateway")
        ->envname("TESSERA_GATEWAY")
        ->capture_default_str()
        ->check([](const std::string& text) {
          return std::string(host::ParseSocketAddress(text, host::PortRule::kFrom1).status().message());
        });
    command->callback([&globals, options, run] { run(globals, *options); });
  };
  add("start", "Record what viewers are told of a world, until 'record stop' or its end", Start, true);
  add("stop", "End the recording of a world", Stop, true);
  add("list", "List the recordings of a gateway, the newest first", List, false);
}

}  // namespace tessera::cli

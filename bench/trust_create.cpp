// The cost of doors with TLS and of signatures: making a world of four regions, and a player's join, by the command
// line, in turns with a door without, or with a cluster of another version.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_split.h"
#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "bench/trust_stage.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/program_folder.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

// The command line of another version with the address of a cluster of it that runs: "PATH/tessera --control ADDRESS".
constexpr char kOtherEnvironment[] = "TESSERA_BENCH_OTHER";
constexpr char kTokenEnvironment[] = "TESSERA_TOKEN";
constexpr std::chrono::seconds kCommandPatience{120};
constexpr std::size_t kMaxSaidBytes = std::size_t{1} << 20;

// One of the two that are compared.
struct CreateSide {
  std::vector<std::string> command;  // without what it is to do
  std::vector<std::string> create;   // further arguments of `instance create`
  std::vector<std::string> players;  // as `command`, where players have a door of their own
  bool has_token = false;
};

// Runs it to its end; its standard output. CommandError with what it said if it failed.
std::string RunSide(const CreateSide& side, const std::vector<std::string>& arguments) {
  const host::TemporaryFolder folder;
  const std::string out = folder.path() + "/out", err = folder.path() + "/err";
  host::ProcessSpec spec{.argv = side.command, .log_path = err, .output_path = out};
  spec.argv.insert(spec.argv.end(), arguments.begin(), arguments.end());
  if (!side.has_token) spec.without_environment = {kTokenEnvironment};
  host::ChildProcess process = local::OrThrow(host::ChildProcess::Start(std::move(spec)));
  const auto ended = process.Wait(kCommandPatience);
  if (!ended || !ended->Clean()) {
    throw local::CommandError(fmt::format("{} {}: {}", side.command[0], arguments[0] + " " + arguments[1],
                                          host::ReadFile(err, kMaxSaidBytes).value_or("it said nothing")));
  }
  return host::ReadFile(out, kMaxSaidBytes).value_or("");
}

struct CreateTimes {
  double create_s = 0;  // from the command's start until the world runs
  double join_s = 0;    // from the command's start until its player is in, has played a frame, and has left
};

double TimeSide(const CreateSide& side, const std::vector<std::string>& arguments, std::string* said = nullptr) {
  const auto begin = Clock::now();
  std::string out = RunSide(side, arguments);
  const double took_s = std::chrono::duration<double>(Clock::now() - begin).count();
  if (said != nullptr) *said = std::move(out);
  return took_s;
}

// The world is deleted again.
CreateTimes TimeCreate(const CreateSide& side) {
  std::vector<std::string> arguments{"instance", "create", "--scene", "plaza", "--regions", "4", "--wait"};
  arguments.insert(arguments.end(), side.create.begin(), side.create.end());
  CreateTimes times;
  std::string said;
  times.create_s = TimeSide(side, arguments, &said);
  static const std::regex kId("inst-[0-9]+");
  std::smatch id;
  if (!std::regex_search(said, id, kId)) throw local::CommandError("instance create named no instance: " + said);
  CreateSide player = side;
  if (!side.players.empty()) player = {.command = side.players, .create = {}, .players = {}};
  times.join_s = TimeSide(player, {"client", id.str(), "--seconds", "0.001"});
  RunSide(side, {"instance", "delete", id.str(), "--wait"});
  return times;
}

}  // namespace

absl::Status RunCreate(const TrustSize& size, Report& report) {
  TrustStage stage;
  setenv(kTokenEnvironment, stage.OperatorsToken().c_str(), 1);
  const std::string program = host::ProgramFolder() + "/tessera";
  const CreateSide by_tls{.command = {program, "--control", stage.target().operators},
                          .create = {"--guests", "on"},
                          .players = {program, "--control", stage.target().players},
                          .has_token = true};
  CreateSide other{
      .command = {program, "--control", stage.target().socket}, .create = {"--guests", "on"}, .players = {}};
  std::string config = "against=socket";
  if (const char* given = std::getenv(kOtherEnvironment); given != nullptr && *given != '\0') {
    other = {.command = absl::StrSplit(given, ' ', absl::SkipEmpty()), .create = {}, .players = {}};
    config = "against=other";
  }
  std::vector<double> tls_s, other_s, tls_join_s, other_join_s;
  for (std::uint32_t round = 0; round < 2 * size.creations; ++round) {
    // The first of a pair is once the one, once the other.
    const bool tls = (round % 2 == 0) == (round / 2 % 2 == 0);
    const CreateTimes times = TimeCreate(tls ? by_tls : other);
    (tls ? tls_s : other_s).push_back(times.create_s);
    (tls ? tls_join_s : other_join_s).push_back(times.join_s);
  }
  unsetenv(kTokenEnvironment);
  const double ratio = Median(tls_s) / Median(other_s);
  report.Add("create", kTrustEngine, config, "create_s", Median(tls_s), "s");
  report.Add("create", kTrustEngine, config, "create_other_s", Median(other_s), "s");
  report.Add("create", kTrustEngine, config, "create_ratio", ratio, "1");
  const double join_ratio = Median(tls_join_s) / Median(other_join_s);
  report.Add("create", kTrustEngine, config, "join_s", Median(tls_join_s), "s");
  report.Add("create", kTrustEngine, config, "join_other_s", Median(other_join_s), "s");
  report.Add("create", kTrustEngine, config, "join_ratio", join_ratio, "1");
  std::cerr << fmt::format("trust: create: {}: ratio {:.2f}, of a join {:.2f}, of {} in turns\n", config, ratio,
                           join_ratio, size.creations);
  return absl::OkStatus();
}

}  // namespace tessera::bench

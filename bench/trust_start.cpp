// How long a fresh cluster takes: `tessera up`, and a control plane's `tessera cluster init`.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "bench/statistics.h"
#include "bench/trust_scenes.h"
#include "host/child_process.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/program_folder.h"
#include "host/temporary_folder.h"
#include "local_cluster/command_error.h"

namespace tessera::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStartPatience{60};
constexpr std::size_t kMaxOutputBytes = std::size_t{1} << 20;

double SecondsSince(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

// From the command's start until it has said that all is up.
double TimeUp() {
  const host::TemporaryFolder folder;
  const std::string state = folder.path() + "/state", out = folder.path() + "/out", err = folder.path() + "/err";
  const auto begin = Clock::now();
  host::ChildProcess up = local::OrThrow(
      host::ChildProcess::Start({.argv = {host::ProgramFolder() + "/tessera", "up", "--state-dir", state, "--socket",
                                          folder.path() + "/control.sock", "--metrics-listen", "127.0.0.1:0",
                                          "--page-listen", "127.0.0.1:0", "--visuals", folder.path()},
                                 .log_path = err,
                                 .output_path = out}));
  while (host::ReadFile(out, kMaxOutputBytes).value_or("").find("Ctrl-C ends it all.") == std::string::npos) {
    if (up.Wait(std::chrono::milliseconds(1)) || SecondsSince(begin) > kStartPatience.count()) {
      throw local::CommandError("tessera up: " + host::LastLinesText(err, 5));
    }
  }
  const double took_s = SecondsSince(begin);
  up.End(kStartPatience);
  return took_s;
}

// From the command's start to its end, at a control plane that has just begun.
double TimeInit() {
  const host::TemporaryFolder folder;
  const std::string ready = folder.path() + "/ready.json", log = folder.path() + "/log";
  host::ChildProcess control = local::OrThrow(host::ChildProcess::Start(
      {.argv = {host::ProgramFolder() + "/tessera-control", "--listen", "127.0.0.1:0", "--metrics-listen",
                "127.0.0.1:0", "--state-dir", folder.path() + "/control", "--ready-file", ready},
       .log_path = log}));
  if (!control.WaitForFile(ready, kStartPatience)) {
    throw local::CommandError("tessera-control: " + host::LastLinesText(log, 5));
  }
  const auto addresses = nlohmann::json::parse(host::ReadFile(ready, kMaxOutputBytes).value());
  setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);  // its context is not this user's
  const std::string err = folder.path() + "/err";
  const auto begin = Clock::now();
  host::ChildProcess init = local::OrThrow(host::ChildProcess::Start(
      {.argv = {host::ProgramFolder() + "/tessera", "--control", addresses.at("socket").get<std::string>(), "cluster",
                "init", "--address", addresses.at("grpc").get<std::string>()},
       .log_path = err}));
  const auto ended = init.Wait(kStartPatience);
  const double took_s = SecondsSince(begin);
  unsetenv("XDG_CONFIG_HOME");
  if (!ended || !ended->Clean()) throw local::CommandError("cluster init: " + host::LastLinesText(err, 5));
  return took_s;
}

}  // namespace

absl::Status RunStart(const TrustSize& size, Report& report) {
  std::vector<double> up_s, init_s;
  for (std::uint32_t i = 0; i < size.starts; ++i) {
    up_s.push_back(TimeUp());
    init_s.push_back(TimeInit());
  }
  const auto add = [&](const std::string& metric, std::vector<double>& times) {
    report.Add("start", kTrustEngine, "fresh", metric, Median(times), "s");
    report.Add("start", kTrustEngine, "fresh", metric + "_highest", Quantile(times, 1), "s");
    std::cerr << fmt::format("trust: start: {} {:.2f}, at most {:.2f}\n", metric, Median(times), Quantile(times, 1));
  };
  add("up_s", up_s);
  add("init_s", init_s);
  return absl::OkStatus();
}

}  // namespace tessera::bench

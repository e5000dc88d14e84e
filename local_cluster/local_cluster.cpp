#include "local_cluster/local_cluster.h"

#include <fmt/format.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "core/world/limits.h"
#include "host/files.h"
#include "host/last_lines.h"
#include "host/program_folder.h"
#include "host/socket_address.h"
#include "local_cluster/connection.h"
#include "trust/control_address.h"

namespace tessera::local {
namespace {

namespace fs = std::filesystem;

// How long a program may take until it says that it is ready. Generous: a loaded machine starts slowly, and it is not
// waited out.
constexpr std::chrono::seconds kReadyTimeout{30};
// How long agents may take to end their workers before they are killed.
constexpr std::chrono::seconds kStopPatience{15};
// A ready file holds one line with a few addresses.
constexpr std::size_t kMaxReadyBytes = 4096;

nlohmann::json WaitReady(host::ChildProcess& child, const std::string& program, const std::string& ready_file,
                         const std::string& log) {
  if (!child.WaitForFile(ready_file, kReadyTimeout)) {
    const auto ended = child.Wait(std::chrono::milliseconds(0));
    throw CommandError(fmt::format("{} {}{}", program, ended ? ended->Describe() : "did not become ready",
                                   host::LastLinesText(log, 5)));
  }
  return nlohmann::json::parse(OrThrow(host::ReadFile(ready_file, kMaxReadyBytes)));
}

std::string MakeFolder(const std::string& path) {
  OrThrow(host::MakePrivateFolder(path));
  return path;
}

}  // namespace

LocalCluster::LocalCluster(const LocalClusterOptions& options)
    : options_(options),
      log_dir_(MakeFolder(options.state_dir + "/logs")),
      agent_programs_(options.hosts, options.agent_programs) {
  // A socket would reach where the network is cut.
  if (options_.network != nullptr) options_.listen = options_.network->switch_address() + ":0";
  StartControl();
  for (std::uint32_t index = 0; index < options_.hosts; ++index) agents_.push_back(StartAgent(index));
  if (!options_.page_listen.empty()) StartGateway();
}

LocalCluster::~LocalCluster() {
  if (gateway_) gateway_->End(kStopPatience);
  // One that was killed may have left workers, which the next one adopts and ends.
  try {
    if (control_->Wait(std::chrono::milliseconds(0))) RestartControl();
    for (std::size_t index = 0; index < agents_.size(); ++index) {
      if (agents_[index].Wait(std::chrono::milliseconds(0))) RestartAgent(index);
    }
  } catch (const std::exception&) {
    // Whoever cannot be brought back cannot be asked to end its workers; the others still are.
  }
  for (const host::ChildProcess& agent : agents_) agent.Signal(SIGTERM);
  for (host::ChildProcess& agent : agents_) agent.End(kStopPatience);
  if (control_) control_->End(kStopPatience);
}

void LocalCluster::KillControl() {
  control_->Signal(SIGKILL);
  control_->Wait(kStopPatience);
}

// At the same addresses, so that agents and clients find it again.
void LocalCluster::RestartControl() {
  options_.listen = operators_address_;
  options_.players_listen = players_address_;
  options_.players_https = players_https_address_;
  options_.metrics_listen = http_address_;
  StartControl();
}

void LocalCluster::RestartGateway() {
  options_.page_listen = page_address_;
  StartGateway();
}

void LocalCluster::KillAgent(std::size_t index) {
  agents_.at(index).Signal(SIGKILL);
  agents_.at(index).Wait(kStopPatience);
}

void LocalCluster::RestartAgent(std::size_t index) {
  agents_.at(index) = StartAgent(static_cast<std::uint32_t>(index));
}

void LocalCluster::StartControl() {
  const std::string log = log_dir_ + "/control.log";
  const std::string ready = options_.state_dir + "/control-ready.json";
  fs::remove(ready);
  const std::string state = MakeFolder(options_.state_dir + "/control");
  std::vector<std::string> argv = {ProgramIn(options_.control_programs, "tessera-control"),
                                   "--metrics-listen",
                                   options_.metrics_listen,
                                   "--state-dir",
                                   state,
                                   "--ready-file",
                                   ready};
  for (const auto& [option, value] :
       {std::pair("--socket", options_.socket), std::pair("--listen", options_.listen),
        std::pair("--players-listen", options_.players_listen), std::pair("--players-https", options_.players_https),
        std::pair("--metrics-token-file", options_.metrics_token_file)}) {
    if (!value.empty()) argv.insert(argv.end(), {option, value});
  }
  argv.insert(argv.end(), options_.control_arguments.begin(), options_.control_arguments.end());
  control_ = OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log}));
  const nlohmann::json addresses = WaitReady(*control_, "tessera-control", ready, log);
  control_address_ = addresses.at("socket").get<std::string>();
  operators_address_ = addresses.at("grpc").get<std::string>();
  players_address_ = addresses.at("players").get<std::string>();
  players_https_address_ = addresses.at("players_https").get<std::string>();
  http_address_ = addresses.at("http").get<std::string>();
}

void LocalCluster::AddMetricsToken(std::vector<std::string>& argv) const {
  if (options_.metrics_token_file.empty()) return;
  argv.insert(argv.end(), {"--metrics-token-file", options_.metrics_token_file});
}

void LocalCluster::StartGateway() {
  const std::string log = log_dir_ + "/gateway.log";
  const std::string ready = options_.state_dir + "/gateway-ready.json";
  fs::remove(ready);
  std::vector<std::string> argv = {ProgramPath("tessera-gateway"),
                                   "--control",
                                   control_address_,
                                   "--listen",
                                   options_.page_listen,
                                   "--metrics-listen",
                                   "127.0.0.1:0",
                                   "--ready-file",
                                   ready,
                                   "--recordings-dir",
                                   options_.state_dir + "/recordings",
                                   "--visual-cache",
                                   options_.state_dir + "/visual-cache"};
  const std::string key_file =
      trust::PageKeyFile(OrThrow(trust::ParseControlAddress(control_address_, host::PortRule::kFrom1)).socket_path);
  const bool with_key =
      host::IsLoopback(OrThrow(host::ParseSocketAddress(options_.page_listen, host::PortRule::kFrom0)).host);
  if (with_key) argv.insert(argv.end(), {"--key-file", key_file});
  if (!options_.visuals.empty()) argv.insert(argv.end(), {"--visuals", options_.visuals});
  if (options_.network == nullptr) argv.emplace_back("--local");
  AddMetricsToken(argv);
  gateway_ = OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log}));
  const nlohmann::json addresses = WaitReady(*gateway_, "tessera-gateway", ready, log);
  page_address_ = addresses.at("http").get<std::string>();
  gateway_metrics_address_ = addresses.at("metrics").get<std::string>();
  if (with_key) {
    const std::string key = OrThrow(host::ReadFile(key_file, kMaxReadyBytes));
    page_key_ = std::string(absl::StripAsciiWhitespace(key));
  }
}

std::string LocalCluster::page_url() const {
  return fmt::format("http://{}/{}", page_address_, page_key_.empty() ? "" : "#key=" + page_key_);
}

host::ChildProcess LocalCluster::StartAgent(std::uint32_t index) {
  const std::string name = fmt::format("local-{}", index + 1);
  const std::string state = MakeFolder(fmt::format("{}/{}", options_.state_dir, name));
  const std::string log = fmt::format("{}/{}.log", log_dir_, name);
  const std::string ready = options_.state_dir + "/" + name + "-ready.json";
  fs::remove(ready);
  const std::string address = options_.network != nullptr ? options_.network->address(index) : "127.0.0.1";
  std::vector<std::string> argv;
  if (options_.network != nullptr) argv = options_.network->Enter(index);
  argv.insert(argv.end(), {ProgramIn(agent_programs_.at(index), "tessera-agent"), "--control",
                           options_.network != nullptr ? operators_address_ : control_address_, "--state-dir", state,
                           "--ready-file", ready, "--advertise-address", address, "--metrics-listen", address + ":0",
                           "--stop-workers"});
  if (!options_.workers_outlive_agents) argv.emplace_back("--die-with-parent");
  AddMetricsToken(argv);
  if (!fs::exists(state + "/host.json")) {
    Connection connection(control_address_);
    v1::AddHostRequest request;
    request.set_name(name);
    request.set_max_regions(kMaxRegions);
    const auto response =
        connection.Call("host add " + name, connection.hosts(), &v1::HostService::Stub::AddHost, request);
    const std::string token = state + "/join-token";
    OrThrow(host::WriteFile(token, response.join_token() + "\n", host::Durability::kSurvivesProcess));
    argv.insert(argv.end(), {"--join-token-file", token});
  }
  if (!options_.region_binary.empty()) argv.insert(argv.end(), {"--region-binary", options_.region_binary});
  if (!options_.game_modules.empty()) argv.insert(argv.end(), {"--game-modules", options_.game_modules});
  if (!options_.release_programs.empty() && agent_programs_.at(index).empty()) {
    argv.insert(argv.end(), {"--release-programs", options_.release_programs});
  }
  if (options_.capacity > 0) argv.insert(argv.end(), {"--capacity", std::to_string(options_.capacity)});
  const int first = options_.first_port + static_cast<int>(index) * 1000;
  argv.insert(argv.end(), {"--port-range", fmt::format("{}-{}", first, first + 999)});
  host::ChildProcess agent = OrThrow(host::ChildProcess::Start({.argv = argv, .log_path = log}));
  WaitReady(agent, "tessera-agent", ready, log);
  return agent;
}

std::string LocalCluster::WaitForDeath(std::chrono::milliseconds timeout) {
  if (const auto status = control_->Wait(timeout)) return "tessera-control: " + status->Describe();
  for (host::ChildProcess& agent : agents_) {
    if (const auto status = agent.Wait(std::chrono::milliseconds(0))) return "tessera-agent: " + status->Describe();
  }
  if (gateway_) {
    if (const auto status = gateway_->Wait(std::chrono::milliseconds(0)))
      return "tessera-gateway: " + status->Describe();
  }
  return "";
}

std::vector<std::string> LocalCluster::Revive() {
  std::vector<std::string> ended;
  const auto has_ended = [&](host::ChildProcess& child, const char* name) {
    const auto status = child.Wait(std::chrono::milliseconds(0));
    if (status) ended.push_back(fmt::format("{}: {}", name, status->Describe()));
    return status.has_value();
  };
  if (has_ended(*control_, "tessera-control")) RestartControl();
  for (std::size_t index = 0; index < agents_.size(); ++index) {
    if (has_ended(agents_[index], "tessera-agent")) RestartAgent(index);
  }
  if (gateway_ && has_ended(*gateway_, "tessera-gateway")) RestartGateway();
  return ended;
}

std::string ProgramIn(const std::string& folder, const std::string& name) {
  if (folder.empty()) return ProgramPath(name);
  std::error_code error;
  if (!fs::exists(fs::path(folder) / name, error)) throw CommandError(fmt::format("no {} in {}", name, folder));
  return (fs::path(folder) / name).string();
}

std::string ProgramPath(const std::string& name) {
  std::vector<fs::path> places;
  if (const char* folder = std::getenv("TESSERA_BIN")) places.emplace_back(folder);
  std::error_code error;
  const fs::path here = host::ProgramFolder();
  places.push_back(here.parent_path() / "bin");  // for what is built or installed beside it
  places.push_back(here);
  for (const fs::path& place : places) {
    if (fs::exists(place / name, error)) return (place / name).string();
  }
  throw CommandError(
      fmt::format("{} is not beside this program in {}; build it, or set TESSERA_BIN", name, places.back().string()));
}

}  // namespace tessera::local

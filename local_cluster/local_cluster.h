// LocalCluster: a control plane, its agents and, if wanted, a gateway as children of this process, on loopback. What
// `tessera up`, the demo, the benchmarks and the end-to-end tests run on. All speak over the control plane's
// socket, but agents in a network of their own: they join by TLS.
//
//   LocalCluster cluster({.state_dir = dir});
//   Connection connection(cluster.control_address());
//
// Construction returns when every agent has been admitted; CommandError says which program failed, with its last log
// lines. Destruction ends agents (with their workers), then the control plane; nothing is left running. What a test
// killed comes back at the same addresses with the same state.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/child_process.h"
#include "local_cluster/host_network.h"

namespace tessera::local {

struct LocalClusterOptions {
  std::string state_dir;                                             // state and logs; must exist
  std::string socket = {};                                           // the control plane's; empty: in the state folder
  std::string listen = {}, players_listen = {}, players_https = {};  // its doors by TLS; empty: none
  std::string metrics_listen = "127.0.0.1:0";                        // its HTTP
  std::string metrics_token_file = {};                               // for every program; empty: none
  std::uint32_t hosts = 1;
  std::uint32_t capacity = 0;       // regions a host; 0: the agent's default
  std::string region_binary = {};   // the worker's program; empty: the one beside the agent
  std::uint16_t first_port = 7800;  // each agent takes a range of 1000 from here for its workers
  // A killed agent's workers run on, for the next one to adopt, as on real hosts. Else they die with it, so that
  // nothing is left even of a caller that is killed.
  bool workers_outlive_agents = false;
  // Each host in a network namespace of its own there; null: all on loopback. Outlives the cluster.
  const HostNetwork* network = nullptr;
  // HTTP address of a gateway; empty: none. At loopback who has the key in its page's address gives orders; elsewhere
  // nobody does.
  std::string page_listen = {};
  std::string visuals = {};                         // the gateway's folder of meshes to draw; empty: none
  std::string game_modules = {};                    // each agent's folder of native games; empty: none
  std::vector<std::string> control_arguments = {};  // further ones of the control plane's program
  // Folders with the programs of another release: of the control plane, and of agents with their workers. Empty: those
  // of this installation.
  std::string control_programs = {}, agent_programs = {};
  // Agents' folder of workers' programs by release, of those that are of this installation; empty: their default.
  std::string release_programs = {};
};

class LocalCluster {
 public:
  explicit LocalCluster(const LocalClusterOptions& options);
  ~LocalCluster();

  const std::string& control_address() const { return control_address_; }      // unix:PATH
  const std::string& operators_address() const { return operators_address_; }  // HOST:PORT; empty: none
  const std::string& players_address() const { return players_address_; }
  const std::string& players_https_address() const { return players_https_address_; }
  const std::string& http_address() const { return http_address_; }
  const std::string& state_dir() const { return options_.state_dir; }
  const std::string& page_address() const { return page_address_; }  // HOST:PORT; empty without a gateway
  const std::string& page_key() const { return page_key_; }          // empty: there is none
  std::string page_url() const;                                      // "http://127.0.0.1:7710/#key=...", for a browser
  const std::string& gateway_metrics_address() const { return gateway_metrics_address_; }
  const std::string& log_dir() const { return log_dir_; }
  host::ChildProcess& control() { return *control_; }
  host::ChildProcess& agent(std::size_t index) { return agents_.at(index); }
  // As a fault would: SIGKILL.
  void KillControl();
  void RestartControl();
  void RestartGateway();
  void KillAgent(std::size_t index);
  void RestartAgent(std::size_t index);
  // From the next start on these programs are used, as after an installation of packages; as in the options.
  void UseControlPrograms(const std::string& folder) { options_.control_programs = folder; }
  void UseAgentPrograms(std::size_t index, const std::string& folder) { agent_programs_.at(index) = folder; }
  // Waits until a child ends, at most `timeout`: its name and end, e.g. "tessera-agent: killed by SIGKILL (Killed)".
  // Empty: all run.
  std::string WaitForDeath(std::chrono::milliseconds timeout);
  // Starts each child that has ended again, at its addresses and with its state. Returns who that was, as WaitForDeath.
  std::vector<std::string> Revive();

 private:
  void StartControl();
  void StartGateway();
  void AddMetricsToken(std::vector<std::string>& argv) const;
  host::ChildProcess StartAgent(std::uint32_t index);

  LocalClusterOptions options_;
  std::string log_dir_, control_address_, operators_address_, players_address_, players_https_address_, http_address_,
      page_address_, page_key_, gateway_metrics_address_;
  std::optional<host::ChildProcess> control_;
  std::vector<std::string> agent_programs_;  // by host
  std::vector<host::ChildProcess> agents_;
  std::optional<host::ChildProcess> gateway_;
};

// The program `name` in `folder`; in an empty one: ProgramPath. CommandError: it is not there.
std::string ProgramIn(const std::string& folder, const std::string& name);
// The program `name` of this installation: in TESSERA_BIN, in the bin folder next to the running one's, or beside it.
std::string ProgramPath(const std::string& name);

}  // namespace tessera::local

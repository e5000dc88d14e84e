// FakeWorkers: an agent with its workers, for tests. Does at once what a desired set asks for and says so in the
// agent's messages. No processes, no time.
#pragma once

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

class FakeWorkers {
 public:
  struct Worker {
    v1::WorkerOrder order;
    v1::WorkerReport report;
  };
  using Key = std::pair<std::string, std::uint32_t>;  // instance, region

  // Settings of the play.
  std::set<std::uint32_t> exit_at_start;  // regions whose workers end at once
  bool connect_players = true;            // every player is connected as soon as a worker knows of it
  bool stop_in_order = true;              // false: workers do not heed `stop`, only their absence from the set

  // What the agent would send after acting on `desired`.
  std::vector<v1::AgentMessage> Apply(const v1::DesiredSet& desired) {
    std::vector<v1::AgentMessage> out;
    std::set<Key> wanted;
    for (const v1::WorkerOrder& order : desired.workers()) {
      wanted.emplace(order.instance_id(), order.region());
      Act(order, out);
    }
    for (auto it = workers.begin(); it != workers.end();) {
      if (wanted.contains(it->first)) {
        ++it;
      } else {
        out.push_back(Exited(it->second, true, 0, 15, "ended by the agent"));
        it = workers.erase(it);
      }
    }
    acted_revision = desired.revision();
    return out;
  }

  v1::AgentMessage Heartbeat() const {
    v1::AgentMessage message;
    message.mutable_heartbeat()->set_desired_revision(acted_revision);
    for (const auto& [key, worker] : workers) *message.mutable_heartbeat()->add_workers() = worker.report;
    return message;
  }

  // The worker dies; what the agent says about it.
  v1::AgentMessage Kill(const Key& key, int signal) {
    v1::AgentMessage message = Exited(workers.at(key), true, 0, signal, "");
    workers.erase(key);
    return message;
  }

  std::map<Key, Worker> workers;
  std::map<std::tuple<std::string, std::uint32_t, std::uint64_t>, int> starts;  // by incarnation: never above 1
  std::uint64_t acted_revision = 0;

 private:
  static v1::AgentMessage Exited(const Worker& worker, bool started, int code, int signal, const std::string& reason) {
    v1::AgentMessage message;
    v1::WorkerExited& exited = *message.mutable_exited();
    *exited.mutable_identity() = worker.report.identity();
    exited.set_started(started);
    exited.set_exit_code(code);
    exited.set_signal(signal);
    exited.set_reason(reason);
    return message;
  }

  void Act(const v1::WorkerOrder& order, std::vector<v1::AgentMessage>& out) {
    const Key key(order.instance_id(), order.region());
    auto found = workers.find(key);
    if (found == workers.end()) {
      if (order.stop()) return;
      found = workers.emplace(key, Start(order)).first;
      if (exit_at_start.contains(order.region())) {
        out.push_back(Exited(found->second, true, 3, 0, "exited with code 3"));
        for (const char* line : {"one", "two", "three", "no such mesh"})
          out.back().mutable_exited()->add_last_log_lines(line);
        workers.erase(found);
        return;
      }
    }
    Worker& worker = found->second;
    if (order.stop() && stop_in_order) {
      out.push_back(Exited(worker, true, 0, 0, "ended in order"));
      workers.erase(found);
      return;
    }
    if (order.revision() <= worker.order.revision()) return;
    worker.order = order;
    Follow(worker);
    v1::AgentMessage message;
    *message.mutable_report() = worker.report;
    out.push_back(message);
  }

  Worker Start(const v1::WorkerOrder& order) {
    ++starts[{order.instance_id(), order.region(), order.incarnation()}];
    Worker worker;
    v1::WorkerIdentity& identity = *worker.report.mutable_identity();
    identity.set_instance_id(order.instance_id());
    identity.set_region(order.region());
    identity.set_incarnation(order.incarnation());
    identity.set_pid(++last_pid_);
    const auto port = static_cast<std::uint32_t>(20000 + 3 * last_pid_);
    worker.report.mutable_address()->set_game_port(port);
    worker.report.mutable_address()->set_link_port(port + 1);
    worker.report.mutable_address()->set_metrics_port(port + 2);
    return worker;
  }

  void Follow(Worker& worker) const {
    v1::WorkerReport& report = worker.report;
    const bool linked = worker.order.peers_size() + 1 == worker.order.map().regions_size();
    report.set_phase(!linked              ? v1::WORKER_PHASE_BOUND
                     : worker.order.run() ? v1::WORKER_PHASE_RUNNING
                                          : v1::WORKER_PHASE_LINKED);
    report.set_order_revision(worker.order.revision());
    report.clear_connected_players();
    for (const v1::Player& player : worker.order.players()) {
      if (connect_players && !player.left()) report.add_connected_players(player.number());
    }
  }

  std::int64_t last_pid_ = 0;
};

}  // namespace tessera::control

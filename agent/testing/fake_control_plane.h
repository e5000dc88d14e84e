// A control plane for tests of the agent: real gRPC on 127.0.0.1, ordered by the test what to want, and keeping what it
// hears. Thread rule: every method from any thread.
#pragma once

#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::agent {

// All that the agent sent, and the state of admission.
struct ControlRecord {
  std::string token = "good-token";
  bool token_used = false;
  int lost_answers = 0;  // so many streams end after the hello, before its answer
  std::string secret = "host-secret-of-the-test";
  std::map<std::string, std::string> scenes;  // by hash, serialised
  std::map<std::string, std::string> games;   // by hash
  int scene_fetches = 0, game_fetches = 0;
  bool knows_no_streams = false;  // it gives scenes in one message, as an earlier release

  // Given with the admission, asked for with it, and sent with each desired set.
  std::string revocations_key;
  bool report_revocations = false;
  std::optional<v1::SignedRevocations> revocations;

  std::vector<v1::AgentHello> hellos;
  int streams = 0;  // that stand now
  int heartbeats = 0;
  std::uint64_t acted_on = 0;                         // desired revision of the last heartbeat
  std::map<std::uint32_t, v1::WorkerReport> reports;  // the last, by region
  std::vector<v1::WorkerExited> exits;
  std::vector<std::uint64_t> kept_revocations;  // numbers of the lists that it said to keep
  std::vector<v1::SignedRevocations> reported_revocations;
  std::vector<v1::GameModuleList> module_lists;  // that came after the hello
};

class FakeControlPlane {
 public:
  FakeControlPlane();
  ~FakeControlPlane();

  std::string address() const;  // the same after Stop and Start
  void Start();
  void Stop();

  // Sent to the agent that is attached and to each that attaches from now on. Revisions are counted by themselves.
  void SetDesired(const std::vector<v1::WorkerOrder>& orders);
  void Change(const std::function<void(ControlRecord&)>& change);
  ControlRecord record() const;
  // Whether `holds` came true before the test's patience ended; asked after each thing heard.
  bool WaitUntil(const std::function<bool(const ControlRecord&)>& holds) const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace tessera::agent

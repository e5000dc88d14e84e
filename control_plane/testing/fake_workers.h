// FakeWorkers: an agent with its workers, for tests. It does at once what a desired set asks for and says so in the
// agent's messages. There are no processes, and no time passes. All agents of a test share one FakeWorld, in which
// regions own bodies and standbys always hold whole copies.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "tessera/v1/agent_link.pb.h"

namespace tessera::control {

// Bodies by the incarnation that owns them. A dead one's entry is what its standby's copy holds.
struct FakeWorld {
  static constexpr std::uint64_t kBodiesEach = 3;
  std::map<std::uint64_t, std::map<std::uint64_t, std::uint32_t>> owned;  // incarnation -> body -> epoch
};

struct FakeWorker {
  v1::WorkerOrder order;
  v1::WorkerReport report;
  std::map<std::uint32_t, std::uint64_t> standby_copies;  // region -> incarnation
  v1::Inventory inventory;                                // sent for an unresolved failover; version 0: none
};

class FakeWorkers {
 public:
  using Key = std::pair<std::string, std::uint32_t>;  // instance, region

  // A test sets these to make the workers misbehave.
  std::set<std::uint32_t> exit_at_start;                  // regions whose workers end at once
  bool no_ports = false;                                  // a worker that is to start finds no free ports
  std::set<std::uint32_t> still;                          // regions that make no steps
  std::set<std::uint32_t> unlinked;                       // regions to and from which there are no links
  std::set<std::pair<std::uint32_t, std::uint32_t>> cut;  // pairs of regions without a link, the lower first
  bool connect_players = true;                            // every player is connected as soon as a worker knows of it
  std::uint32_t last_acknowledged_ms = 0;  // age of a standby's last acknowledgement to a dead primary, as inventoried
  std::set<std::uint64_t> refuse_plans;    // versions whose commitment one worker refuses
  bool mute = false;                       // sends no inventories
  bool stop_in_order = true;               // false: workers do not heed `stop`, only their absence from the set

  // The messages that the agent would send after acting on `desired`.
  std::vector<v1::AgentMessage> Apply(const v1::DesiredSet& desired);
  v1::AgentMessage Heartbeat();
  // The inventories that an agent repeats on each new stream.
  std::vector<v1::AgentMessage> Inventories() const;
  // The worker dies; returns the agent's message about it.
  v1::AgentMessage Kill(const Key& key, int signal);

  std::map<Key, FakeWorker> workers;
  std::map<std::tuple<std::string, std::uint32_t, std::uint64_t>, int> starts;  // by incarnation: never above 1
  std::shared_ptr<FakeWorld> world = std::make_shared<FakeWorld>();

 private:
  void Act(const v1::WorkerOrder& order, std::vector<v1::AgentMessage>& out);
  FakeWorker Start(const v1::WorkerOrder& order);
  void Follow(FakeWorker& worker) const;
  bool FollowMaps(FakeWorker& worker);
  void Move(FakeWorker& worker);
  static bool Stands(const FakeWorker& worker);
  void HoldCopies(FakeWorker& worker);
  void TakeStock(FakeWorker& worker);
  void Resume(FakeWorker& worker);

  std::uint64_t acted_revision_ = 0;
  std::int64_t last_pid_ = 0;
};

}  // namespace tessera::control

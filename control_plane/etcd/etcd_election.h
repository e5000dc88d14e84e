// EtcdElection: which of several control planes leads.
//
// One leads: whose transaction creates PREFIX/leader while there is no such key. The key has the lease of the one who
// made it and goes with it. The span of the lease is the one that etcd granted, and its end is counted from when we
// *sent* the renewal, on a clock that nobody sets; we step down a tenth earlier than that, so that etcd never gives the
// key to another while we think that we lead. That is about liveness: what makes a deposed leader harmless is the
// fence, the revision at which the key was created (etcd_fence.h). etcd has been seen to renew leases that it had
// revoked, so the key itself is read again with each renewal.
//
// A leader whose doors are open says so in PREFIX/serving, which holds its token and has its lease. From then on those
// that follow notice when its process ends (leader_probe.h), and end its term at once. They also ask etcd how much of
// the lease is left: a leader renews it eight times in its span, so one that has let three quarters of it pass is cut
// off or stands still, and they end its term instead of waiting for the last quarter, and for the next look of etcd's.
//
//   EtcdElection election(client, "tessera", {.operators = "10.0.0.1:7700", .players = ""});
//   auto fence = election.Campaign(followed, given_up);    // as long as another leads
//   election.SetServing(true);                             // the doors are open
//   ...
//   election.Resign();                                     // the next one may lead at once
//
// Thread rule: `Campaign`, `SetServing` and `Resign` from one thread; `Left` and `Abandon` from any; `Confirm` from any
// while we lead or have led, until `Resign`.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "control_plane/etcd/etcd_client.h"
#include "control_plane/etcd/etcd_fence.h"
#include "control_plane/etcd/leader_probe.h"
#include "control_plane/etcd/lease_watch.h"

namespace tessera::control {

// Where the doors of a leader are reached; empty: it has none.
struct LeaderAddress {
  std::string operators, players;
  bool operator==(const LeaderAddress&) const = default;
};

struct ElectionTimes {
  // The requested time. Shorter, and an election among etcd's members, 1 to 2 s, costs ours its leader; longer, and so
  // long nobody leads after a leader's death.
  std::chrono::seconds ttl{4};
  // How often a follower looks whether anybody leads.
  std::chrono::milliseconds poll{200};
  // How long etcd may be of no use until that is an error in the log: longer than its members take for an election.
  std::chrono::milliseconds trouble_after{5000};
};

class EtcdElection {
 public:
  using Clock = std::chrono::steady_clock;

  EtcdElection(const EtcdClient& client, const std::string& prefix, LeaderAddress self, ElectionTimes times = {});
  ~EtcdElection();  // resigns
  EtcdElection(const EtcdElection&) = delete;
  EtcdElection& operator=(const EtcdElection&) = delete;

  // Waits until this control plane leads. Meanwhile `followed` is called whenever another one leads than before: with
  // its address, or nothing while it is not known. CANCELLED once `given_up`, asked at each poll, says so.
  absl::StatusOr<EtcdFence> Campaign(const std::function<void(const std::optional<LeaderAddress>&)>& followed,
                                     const std::function<bool()>& given_up);
  // Says that we lead and our doors are open, or are not any more. Where etcd cannot be told, the end of our process is
  // noticed by the end of our lease alone.
  void SetServing(bool serving);
  // How much longer we lead for certain; not above 0: we do not. Once lost, it is not won again but by a Campaign.
  Clock::duration Left() const;
  // Reads the key: true if we led when this was called, or later, whatever has become of the lease; so no other can
  // have been elected before the call. False: that is not known after `patience`, or it is known that we are deposed,
  // and then nothing is left. Blocks.
  bool Confirm(std::chrono::milliseconds patience);
  // Waits until we no longer lead, or `given_up` says so; it is asked at each poll.
  void WaitUntilLost(const std::function<bool()>& given_up);
  // We cannot go on leading, though the lease may stand.
  void Abandon();
  // Ends the lease, so that another may lead. Where etcd cannot be told, the next Campaign tells it.
  void Resign();

 private:
  absl::StatusOr<std::optional<etcdserverpb::KeyValue>> Read(const std::string& key,
                                                             std::chrono::milliseconds patience) const;
  absl::StatusOr<std::optional<etcdserverpb::KeyValue>> ReadLeader(std::chrono::milliseconds patience) const {
    return Read(key_, patience);
  }
  bool Serves(std::int64_t term) const;
  bool IsGone(const etcdserverpb::KeyValue& leader, LeaderProbe& probe) const;
  bool IsSilent(const etcdserverpb::KeyValue& leader, LeaseWatch& watch) const;
  bool EndTerm(const etcdserverpb::KeyValue& leader, const char* why);
  absl::Status TryToWin();
  absl::Status BeginToLead();
  void EndOldLease();
  void Renew(std::int64_t lease, std::int64_t token);
  void Extend(Clock::time_point sent, std::chrono::seconds ttl);

  const EtcdClient& client_;
  const std::string key_, serving_key_;
  const LeaderAddress self_;
  const ElectionTimes times_;

  std::int64_t lease_ = 0;      // granted, and neither over nor revoked as far as we know
  std::int64_t old_lease_ = 0;  // from a time when we led; etcd does not know yet that it is over
  std::int64_t token_ = 0;
  Clock::time_point granted_sent_;
  std::chrono::seconds granted_ttl_{0};

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable wake_;
  Clock::time_point until_ = Clock::time_point::min();
  std::chrono::milliseconds renew_every_{0};
  bool lost_ = true, stopping_ = false;
  std::thread renewer_;
};

// As the key holds it: "10.0.0.1:7700 10.0.0.1:7703", "-" for none.
std::string ToText(const LeaderAddress& address);
std::optional<LeaderAddress> ReadLeaderAddress(const std::string& text);

}  // namespace tessera::control

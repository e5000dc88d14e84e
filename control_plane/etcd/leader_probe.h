// LeaderProbe: whether the process that leads is gone, before its lease is.
//
// A follower holds one connection to a door of the leader, on which nothing is said. When the leader's process ends,
// however it does, its kernel closes that; when its machine then refuses two more, a poll apart, nobody listens there.
// Silence proves nothing: that of a machine that is cut off, or of a process that stands still, is the lease's matter.
//
// It is about liveness alone, as the lease is: whoever was taken for gone and is not finds its key gone and stops
// (etcd_election.h). A network that refuses where the leader listens deposes it once: who follows the next one, too,
// has to have reached it before.
//
// Thread rule: one thread.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <optional>
#include <string>

namespace tessera::control {

class LeaderProbe {
 public:
  LeaderProbe() = default;
  ~LeaderProbe();
  LeaderProbe(const LeaderProbe&) = delete;
  LeaderProbe& operator=(const LeaderProbe&) = delete;

  // The leader of this term serves at that address, "10.0.0.1:7700". Again for the same term: nothing changes. A name
  // is looked up once a term; one that leads nowhere is not probed.
  void Begin(std::int64_t term, const std::string& address);
  bool watches(std::int64_t term) const { return term_ == term; }
  // Looks, for at most .1 s. True: it was reached in this term, and now its machine refuses for the second time in a
  // row.
  bool IsGone();

 private:
  struct Target {
    sockaddr_storage address{};
    socklen_t size = 0;
  };
  static std::optional<Target> LookUp(const std::string& address);
  bool IsHeld();
  void Close();

  std::int64_t term_ = 0;
  std::optional<Target> target_;
  int held_ = -1;
  bool reached_ = false;
  unsigned refusals_ = 0;  // in a row
};

}  // namespace tessera::control

// LeaseWatch: whether a leader renews its lease, by what etcd says is left of it.
//
// etcd tells whole seconds, rounded down, so of a lease that nobody renews the number falls by one each second. A
// leader that has let three quarters of its lease pass is silent: it is cut off or stands still. A member of etcd that
// is elected begins every lease anew, and adds the time of one election: then the three quarters count from there.
//
//   LeaseWatch watch;
//   each look:  if (watch.IsSilent(term, *client.TimeToLive(lease, patience), Clock::now())) ...
//
// A lease of less than four seconds is too short to say anything. Thread rule: none of its own. Time is passed in.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

#include "control_plane/etcd/etcd_client.h"

namespace tessera::control {

class LeaseWatch {
 public:
  using Clock = std::chrono::steady_clock;

  bool IsSilent(std::int64_t term, const EtcdClient::LeaseLeft& lease, Clock::time_point now) {
    // Between its election and its first look at leases a member says that they last for ever.
    if (lease.left > 2 * lease.granted) {
      term_ = 0;
      return false;
    }
    const bool renewed = std::exchange(term_, term) != term || lease.left > left_ ||
                         (lease.left == left_ && now - since_ > kLongestSecond);
    if (renewed) top_ = lease.left;
    if (renewed || lease.left != left_) since_ = now;
    left_ = lease.left;
    const std::chrono::seconds began = std::max(lease.granted, top_ + kRounding);
    return (began - (lease.left + kRounding)) * 4 >= lease.granted * 3;
  }

 private:
  // A number that stands for longer is of a lease that was renewed.
  static constexpr std::chrono::milliseconds kLongestSecond{1500};
  static constexpr std::chrono::seconds kRounding{1};

  std::int64_t term_ = 0;
  std::chrono::seconds left_{0}, top_{0};  // the last number, and the first since the lease was seen to be renewed
  Clock::time_point since_{};              // this number is told
};

}  // namespace tessera::control

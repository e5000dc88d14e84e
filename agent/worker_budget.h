// WorkerBudget: how much the processes of this host's workers may say to their agent.
//
//   if (!budget.Take(peer, now, message.ByteSizeLong())) end the connection;
//
// One loop serves all workers, so a worker that was taken over and talks without end would keep the others from theirs,
// leases included. A process has one budget for all its connections, and dialling again gives no new one. Thread rule:
// any thread; time comes in.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <iterator>
#include <map>
#include <mutex>

#include "agent/limits.h"
#include "net/token_bucket.h"

namespace tessera::agent {

class WorkerBudget {
 public:
  explicit WorkerBudget(const net::Rate& messages = kWorkerMessages, const net::Rate& bytes = kWorkerBytes)
      : messages_(messages), bytes_(bytes) {}

  bool Take(pid_t peer, TimePoint now, std::size_t message_bytes) {
    const std::lock_guard lock(mutex_);
    Budget& budget = budgets_[peer];
    budget.messages.Fill(now, messages_);
    budget.bytes.Fill(now, bytes_);
    const auto size = static_cast<double>(message_bytes);
    if (budget.messages.left() < 1 || budget.bytes.left() < size) return false;
    budget.messages.Spend(1);
    budget.bytes.Spend(size);
    return true;
  }
  // Forgets processes that have their whole budget again, as new ones would.
  void Prune(TimePoint now) {
    const std::lock_guard lock(mutex_);
    for (auto at = budgets_.begin(); at != budgets_.end();) {
      Budget& budget = at->second;
      budget.messages.Fill(now, messages_);
      budget.bytes.Fill(now, bytes_);
      const bool whole = budget.messages.left() >= messages_.burst && budget.bytes.left() >= bytes_.burst;
      at = whole ? budgets_.erase(at) : std::next(at);
    }
  }
  std::size_t processes() const {
    const std::lock_guard lock(mutex_);
    return budgets_.size();
  }

 private:
  struct Budget {
    net::TokenBucket messages, bytes;
  };
  const net::Rate messages_, bytes_;
  mutable std::mutex mutex_;
  std::map<pid_t, Budget> budgets_;
};

}  // namespace tessera::agent

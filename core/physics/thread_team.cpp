#include "core/physics/thread_team.h"

#include <cassert>

namespace tessera::physics {
namespace {

// Looks of a thread at what it waits for before it lets others have its processor: some 50 us, as most serial parts of
// a step take less. More would hold up who has work, fewer be late for the next loop.
constexpr int kLooks = 1500;

// Waits for a moment, after so many looks.
void Pause(int looks) {
  if (looks < kLooks) {
    __builtin_ia32_pause();
  } else {
    std::this_thread::yield();
  }
}

}  // namespace

ThreadTeam::ThreadTeam(int threads) : shares_(static_cast<std::size_t>(threads) - 1) {
  assert(threads >= 1 && threads <= kMaxStepThreads);
  for (int i = 1; i < threads; ++i) {
    threads_.emplace_back([this, i] { Follow(static_cast<std::size_t>(i)); });
  }
}

ThreadTeam::~ThreadTeam() {
  loop_ = nullptr;
  HandOut();
  for (std::thread& thread : threads_) thread.join();
}

ThreadTeam& ThreadTeam::Alone() {
  static ThreadTeam alone(1);
  return alone;
}

void ThreadTeam::HandOut() {
  round_ += 2;
  for (ShareOf& share : shares_) {
    share.state.store(round_, std::memory_order_release);
    share.state.notify_one();
  }
}

void ThreadTeam::Share(Loop loop) {
  loop_ = &loop;
  gathered_.store(true, std::memory_order_relaxed);
  at_work_.store(static_cast<std::uint32_t>(shares_.size()), std::memory_order_relaxed);
  HandOut();
  loop(0);
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    if (!shares_[i].Take(round_)) continue;
    loop(i + 1);
    at_work_.fetch_sub(1, std::memory_order_relaxed);
  }
  for (int looks = 0; at_work_.load(std::memory_order_acquire) != 0; ++looks) Pause(looks);
}

void ThreadTeam::Follow(std::size_t thread) {
  ShareOf& share = shares_[thread - 1];
  std::uint32_t seen = 0;
  while (true) {
    // To wake a thread takes as long as most loops do, so no thread sleeps while a step is under way.
    std::uint32_t now = seen;
    for (int looks = 0; (now = share.state.load(std::memory_order_acquire)) == seen; ++looks) {
      if (looks >= kLooks && !gathered_.load(std::memory_order_relaxed)) {
        share.state.wait(seen, std::memory_order_acquire);
      } else {
        Pause(looks);
      }
    }
    seen = now;
    // The leader does not return while a share is taken and not done, so its loop is there until then.
    if (now % 2 != 0 || !share.Take(now)) continue;
    if (loop_ == nullptr) return;
    (*loop_)(thread);
    at_work_.fetch_sub(1, std::memory_order_release);
    seen = now + 1;
  }
}

}  // namespace tessera::physics

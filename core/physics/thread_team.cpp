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

ThreadTeam::ThreadTeam(int threads) {
  assert(threads >= 1 && threads <= kMaxStepThreads);
  for (int i = 1; i < threads; ++i) {
    threads_.emplace_back([this, i] { Follow(static_cast<std::size_t>(i)); });
  }
}

ThreadTeam::~ThreadTeam() {
  loop_ = nullptr;
  Dismiss();
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

ThreadTeam& ThreadTeam::Alone() {
  static ThreadTeam alone(1);
  return alone;
}

void ThreadTeam::Share(Loop loop) {
  loop_ = &loop;
  gathered_.store(true, std::memory_order_relaxed);
  at_work_.store(static_cast<std::uint32_t>(threads_.size()), std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  loop(0);
  // The others have as much to do as this one. Where they have no processor, one is made free for them.
  for (int looks = 0; at_work_.load(std::memory_order_acquire) != 0; ++looks) Pause(looks);
}

void ThreadTeam::Follow(std::size_t thread) {
  std::uint32_t done = 0;
  while (true) {
    // To wake a thread takes as long as most loops do, so no thread sleeps while a step is under way.
    for (int looks = 0; round_.load(std::memory_order_acquire) == done; ++looks) {
      if (looks >= kLooks && !gathered_.load(std::memory_order_relaxed)) break;
      Pause(looks);
    }
    round_.wait(done, std::memory_order_acquire);
    ++done;
    if (loop_ == nullptr) return;
    (*loop_)(thread);
    at_work_.fetch_sub(1, std::memory_order_release);
  }
}

}  // namespace tessera::physics

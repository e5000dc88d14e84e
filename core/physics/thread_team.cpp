#include "core/physics/thread_team.h"

#include <cassert>

namespace tessera::physics {
namespace {

// Looks of a thread at what it waits for before it sleeps: some 50 us. The serial parts of a step are mostly shorter,
// and to wake a thread takes as long. More would keep a processor from other regions of the host.
constexpr int kLooks = 1500;

void Pause() { __builtin_ia32_pause(); }

}  // namespace

ThreadTeam::ThreadTeam(int threads) {
  assert(threads >= 1 && threads <= kMaxStepThreads);
  for (int i = 1; i < threads; ++i) {
    threads_.emplace_back([this, i] { Follow(static_cast<std::size_t>(i)); });
  }
}

ThreadTeam::~ThreadTeam() {
  loop_ = nullptr;
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
  at_work_.store(static_cast<std::uint32_t>(threads_.size()), std::memory_order_relaxed);
  round_.fetch_add(1, std::memory_order_release);
  round_.notify_all();
  loop(0);
  // The others have as much to do as this one. Where they have no processor, one is made free for them.
  for (int looks = 0; at_work_.load(std::memory_order_acquire) != 0; ++looks) {
    if (looks < kLooks) {
      Pause();
    } else {
      std::this_thread::yield();
    }
  }
}

void ThreadTeam::Follow(std::size_t thread) {
  std::uint32_t done = 0;
  while (true) {
    for (int looks = 0; round_.load(std::memory_order_acquire) == done && looks < kLooks; ++looks) Pause();
    round_.wait(done, std::memory_order_acquire);
    ++done;
    if (loop_ == nullptr) return;
    (*loop_)(thread);
    at_work_.fetch_sub(1, std::memory_order_release);
  }
}

}  // namespace tessera::physics

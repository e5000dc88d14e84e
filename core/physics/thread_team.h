// ThreadTeam: the threads that work on the loops of a step together.
//
// The thread that owns the team leads. It hands out one loop at a time, does its own share of it, then the shares that
// nobody has begun, and goes on when all are done. So a thread that has no processor holds nothing up, unless it loses
// it within its share. Indices are dealt in chunks, chunk number c to the share of thread c % size(): what is in a
// share depends on nothing but the numbers, so a loop mostly finds in its cache what it left there, and loops whose
// chunks do not touch each other's data give the same bits with any number of threads.
//
// The first loop wakes the others. From then on they look out for the next one, until the owner dismisses them; then
// they sleep. A loop of one chunk, and every loop of a team of one, is a plain call, and wakes nobody.
//
//   ThreadTeam team(2);
//   team.For(bodies.size(), 64, [&](std::size_t begin, std::size_t end) { ... });
//   ...
//   team.Dismiss();
//
// Thread rule: one thread owns a team and calls it; loops do not nest. `Alone` may be called from any thread.
#pragma once

#include <absl/functional/function_ref.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace tessera::physics {

inline constexpr int kMaxStepThreads = 32;
// Number of bodies that a thread takes at a time in loops that do little with each.
inline constexpr std::size_t kChunkBodies = 64;

class ThreadTeam {
 public:
  // 1 to kMaxStepThreads, the caller's own among them.
  explicit ThreadTeam(int threads);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  // A team of the caller alone.
  static ThreadTeam& Alone();

  std::size_t size() const { return threads_.size() + 1; }
  // Number of the thread that has the chunk of this index in its share. No two threads work on one share at a time.
  std::size_t ThreadOf(std::size_t index, std::size_t chunk) const {
    return threads_.empty() ? 0 : index / chunk % size();
  }

  // No loop follows for a while: the others may sleep.
  void Dismiss() { gathered_.store(false, std::memory_order_relaxed); }

  // Whether such a loop is a plain call.
  bool IsPlain(std::size_t count, std::size_t chunk) const { return threads_.empty() || count <= chunk; }

  // Calls `work(begin, end)` for ranges that cover 0 to `count`, each of one chunk or, by one thread, of all. Returns
  // when all are done, and what they wrote is there for the caller.
  template <class Work>
  void For(std::size_t count, std::size_t chunk, Work&& work) {
    if (count == 0) return;
    if (IsPlain(count, chunk)) {
      Every(work, 0, count, count, count);
    } else {
      Share([&](std::size_t thread) { Every(work, thread * chunk, count, chunk, chunk * size()); });
    }
  }

 private:
  // Works on each `stride`th chunk from `begin` on. The one place that calls `work`, so that this is compiled into the
  // loop; and on a copy, so that what a loop has captured by value stays in registers.
  template <class Work>
  [[gnu::noinline]] static void Every(Work work, std::size_t begin, std::size_t count, std::size_t chunk,
                                      std::size_t stride) {
    for (; begin < count; begin += stride) work(begin, begin + chunk < count ? begin + chunk : count);
  }

  using Loop = absl::FunctionRef<void(std::size_t thread)>;
  // The share that a thread has in a loop: the number of the round if it is there to be done, one more if somebody has
  // taken it. Each has a cache line, because leader and thread write it in turns.
  struct alignas(64) ShareOf {
    std::atomic<std::uint32_t> state{0};
    // False: somebody else has.
    bool Take(std::uint32_t round) {
      return state.compare_exchange_strong(round, round + 1, std::memory_order_acquire, std::memory_order_relaxed);
    }
  };

  void Share(Loop loop);
  void HandOut();
  void Follow(std::size_t thread);

  const Loop* loop_ = nullptr;                         // null: the threads end
  std::uint32_t round_ = 0;                            // grows by two for each loop
  std::atomic<bool> gathered_{false};                  // loops follow each other
  std::vector<ShareOf> shares_;                        // those of the other threads
  alignas(64) std::atomic<std::uint32_t> at_work_{0};  // shares of others that have yet to be done in this round
  std::vector<std::thread> threads_;
};

}  // namespace tessera::physics

#include "gateway/background.h"

#include <utility>

namespace tessera::gateway {
namespace {

// Jobs that wait: more than this many people who click at once are not served in time anyway.
constexpr std::size_t kMaxWaitingJobs = 256;

}  // namespace

Background::Background(std::size_t threads, std::function<void()> wake) : wake_(std::move(wake)) {
  threads_.reserve(threads);
  for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
}

Background::~Background() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    waiting_.clear();
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool Background::Run(Job job) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMaxWaitingJobs) return false;
    waiting_.push_back(std::move(job));
  }
  changed_.notify_one();
  return true;
}

void Background::Finish() {
  std::vector<Done> done;
  {
    const std::lock_guard lock(mutex_);
    done.swap(done_);
  }
  for (const Done& finish : done) {
    if (finish) finish();
  }
}

void Background::Work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
    if (ending_) return;
    const Job job = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    Done done = job();
    lock.lock();
    done_.push_back(std::move(done));
    wake_();
  }
}

}  // namespace tessera::gateway

#include "control_plane/lease_proof.h"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>
#include <vector>

#include "control_plane/control_settings.h"

namespace tessera::control {

LeaseProof::LeaseProof(std::function<bool()> proves_lead, std::function<void(const AskedLeases::Asked&)> give)
    : proves_lead_(std::move(proves_lead)), give_(std::move(give)) {
  thread_ = std::thread([this] { Run(); });
}

LeaseProof::~LeaseProof() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

void LeaseProof::Ask(StreamId stream, v1::LeaseRequest request) {
  const std::lock_guard lock(mutex_);
  asked_.Put(stream, std::move(request));
  wake_.notify_all();
}

void LeaseProof::Run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || asked_.Begin(); });
    if (ending_) return;
    lock.unlock();
    const auto begun = std::chrono::steady_clock::now();
    const bool leads = proves_lead_();
    Say(leads);
    lock.lock();
    const std::vector<AskedLeases::Asked> asked = asked_.End(leads);
    lock.unlock();
    for (const AskedLeases::Asked& one : asked) give_(one);
    lock.lock();
    wake_.wait_until(lock, begun + kLeaseProofInterval, [this] { return ending_; });
  }
}

// Once each time that it begins to fail.
void LeaseProof::Say(bool leads) {
  if (!leads && !failed_) spdlog::warn("leases not renewed reason=\"the store does not show that this one leads\"");
  failed_ = !leads;
}

}  // namespace tessera::control

// The agent's writes to its state folder. A file that the disk does not take is an error in the log, once, a metric
// until it is written, and tried again; nothing else waits for it.
#include <spdlog/spdlog.h>

#include <set>
#include <string>
#include <utility>

#include "agent/agent.h"
#include "agent/limits.h"

namespace tessera::agent {

void Agent::Save() {
  if (supervisor_.TakeDirty(Clock::now()) || finishing_) SaveWorkers();
}

void Agent::SaveWorkers() { NoteSaved(StateFile::kWorkers, state_->SaveWorkers(supervisor_.State(boot_id_))); }

void Agent::SaveIdentity() { NoteSaved(StateFile::kIdentity, state_->SaveIdentity(*identity_)); }

void Agent::SaveOrder(const WorkerKey& key, const v1::WorkerOrder& order) {
  const absl::Status saved = state_->SaveOrder(IdentityOf(key), order);
  if (saved.ok()) {
    unkept_orders_.erase(key);
    if (!unkept_orders_.empty()) return;  // those of others
  } else {
    unkept_orders_.insert_or_assign(key, order);
  }
  NoteSaved(StateFile::kOrders, saved);
}

void Agent::NoteSaved(StateFile file, const absl::Status& saved) {
  metrics_.SetStateFailing(file, !saved.ok());
  if (saved.ok()) {
    if (unsaved_.erase(file) == 0) return;
    spdlog::info("saved again file={}", NameOf(file));
    if (file == StateFile::kIdentity) next_renewal_ = Clock::now();  // if a certificate could not be kept
    return;
  }
  if (!unsaved_.insert(file).second) return;
  spdlog::error("cannot save: {}", std::string(saved.message()));
  if (!std::exchange(saves_again_, true)) loop_->RunAt(Clock::now() + kSaveRetry, [this] { SaveAgain(); });
}

void Agent::SaveAgain() {
  for (const StateFile file : std::set(unsaved_)) {
    switch (file) {
      case StateFile::kIdentity:
        SaveIdentity();
        break;
      case StateFile::kWorkers:
        SaveWorkers();
        break;
      case StateFile::kOrders:
        SaveOrdersAgain();
        break;
      case StateFile::kRevocations:  // KeepRevocations does that
        break;
    }
  }
  saves_again_ = !unsaved_.empty();
  if (saves_again_) loop_->RunAt(Clock::now() + kSaveRetry, [this] { SaveAgain(); });
}

// Their workers may have ended meanwhile. The first that fails is enough for now.
void Agent::SaveOrdersAgain() {
  while (!unkept_orders_.empty()) {
    const auto [key, order] = *unkept_orders_.begin();
    SaveOrder(key, order);
    if (unkept_orders_.contains(key)) return;
  }
  NoteSaved(StateFile::kOrders, absl::OkStatus());
}

void Agent::TellWorkersAside() {
  workers_aside_ = state_->WorkersAreAside();
  metrics_.SetWorkersAside(workers_aside_);
}

}  // namespace tessera::agent

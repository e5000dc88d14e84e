// Reports of a supervisor about its workers: to the control plane, and to the agent after this one.
#include "agent/supervisor.h"

namespace tessera::agent {

std::vector<v1::WorkerReport> Supervisor::Reports() const {
  std::vector<v1::WorkerReport> reports;
  for (const auto& [key, worker] : workers_) reports.push_back(worker.report);
  return reports;
}

v1::HeldOrders Supervisor::HeldOrders() const {
  v1::HeldOrders held;
  for (const auto& [key, worker] : workers_) {
    const std::optional<v1::WorkerOrder>& order = worker.order ? worker.order : worker.old_order;
    if (order && !order->stop() && worker.stopping == Stopping::kNo) *held.add_orders() = *order;
  }
  return held;
}

std::vector<v1::WorkerExited> Supervisor::Exits() const {
  std::vector<v1::WorkerExited> exits;
  for (const auto& [key, exited] : exits_) exits.push_back(exited);
  return exits;
}

WorkersFile Supervisor::State(const std::string& boot_id) const {
  WorkersFile file;
  file.set_boot_id(boot_id);
  for (const auto& [key, worker] : workers_) {
    if (worker.record.identity().pid() == 0) continue;
    WorkerRecord& record = *file.add_workers();
    record = worker.record;
    *record.mutable_report() = worker.report;
  }
  for (const auto& [key, exited] : exits_) *file.add_exits() = exited;
  return file;
}

bool Supervisor::TakeDirty(TimePoint now) {
  if (!dirty_ && !(ticks_moved_ && now - saved_at_ >= kKeepTicksInterval)) return false;
  dirty_ = ticks_moved_ = false;
  saved_at_ = now;
  return true;
}

}  // namespace tessera::agent

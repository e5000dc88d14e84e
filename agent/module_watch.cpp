#include "agent/module_watch.h"

#include <utility>

#include "agent/limits.h"

namespace tessera::agent {

ModuleWatch::ModuleWatch(GameModulesOptions options, std::function<void(v1::GameModuleList)> on_change)
    : modules_(std::move(options)), on_change_(std::move(on_change)) {
  modules_.Scan();
  first_ = modules_.list();
  thread_ = std::thread([this] { Run(); });
}

ModuleWatch::~ModuleWatch() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  stop_.notify_all();
  thread_.join();
}

void ModuleWatch::Run() {
  std::unique_lock lock(mutex_);
  while (!stop_.wait_for(lock, kModuleScanInterval, [this] { return stopping_; })) {
    lock.unlock();
    if (modules_.Scan()) on_change_(modules_.list());
    lock.lock();
  }
}

}  // namespace tessera::agent

// ModuleWatch: looks through the host's native games every few seconds, in a thread of its own.
//
//   ModuleWatch watch(options, [loop](v1::GameModuleList list) { loop->Post(...); });
//   watch.first();                       // what was there at the beginning
//
// Promise: the first look is done when the constructor returns, and `on_change` is not called after the destructor
// has. Thread rule: one owner. `on_change` runs on the watch's thread.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "agent/game_modules.h"

namespace tessera::agent {

class ModuleWatch {
 public:
  ModuleWatch(GameModulesOptions options, std::function<void(v1::GameModuleList)> on_change);
  ~ModuleWatch();
  ModuleWatch(const ModuleWatch&) = delete;
  ModuleWatch& operator=(const ModuleWatch&) = delete;

  const v1::GameModuleList& first() const { return first_; }

 private:
  void Run();

  GameModules modules_;  // only the thread uses them once it runs
  std::function<void(v1::GameModuleList)> on_change_;
  v1::GameModuleList first_;
  std::mutex mutex_;  // guards the flag below
  std::condition_variable stop_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace tessera::agent

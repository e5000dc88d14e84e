// InstanceWatch: the newest known state of an instance, kept up to date in the background.
//
// Thread rule: any thread; `Latest` copies.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tessera/v1/instance.pb.h"

namespace tessera::local {

class Connection;

class InstanceWatch {
 public:
  // `on_change` is called for each state that arrives, in order, on the watching thread.
  InstanceWatch(Connection& connection, const std::string& id, std::function<void(const v1::Instance&)> on_change = {});
  ~InstanceWatch();
  InstanceWatch(const InstanceWatch&) = delete;
  InstanceWatch& operator=(const InstanceWatch&) = delete;

  // Waits for the first state.
  v1::Instance Latest();
  // True once a state satisfies `holds`; false when the watch ended (instance over, control plane gone) or time is up.
  bool WaitUntil(const std::function<bool(const v1::Instance&)>& holds, std::chrono::milliseconds timeout);
  // Until a state arrives that came after the last call, at most `timeout`.
  void WaitForChange(std::chrono::milliseconds timeout);

 private:
  void Run();

  struct Stream;
  std::unique_ptr<Stream> stream_;
  std::function<void(const v1::Instance&)> on_change_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<v1::Instance> latest_;
  bool changed_since_ = false;  // the last WaitForChange
  bool over_ = false;
  std::thread thread_;
};

}  // namespace tessera::local

// InstanceFeed: the newest state of an instance, and of the list of instances, as the control plane streams it.
//
// Both ask again by themselves when the control plane was away. `wake` is called from their threads when there is
// something new. Thread rule: any thread; `Latest` copies. Destruction cancels the call under way.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "tessera/v1/instance.pb.h"
#include "trust/credentials.h"

namespace grpc {
class Channel;
class ClientContext;
}  // namespace grpc

namespace tessera::gateway {

// Errors: those of trust::Dial.
absl::StatusOr<std::shared_ptr<grpc::Channel>> DialControl(const trust::ControlPoint& control);

class InstanceFeed {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  struct State {
    std::uint64_t number = 0;  // counts the states, from 1; 0: none has come
    v1::Instance instance;
    TimePoint since{};       // when it came
    absl::Status problem{};  // from the last call; OK while it goes on
  };

  InstanceFeed(std::shared_ptr<grpc::Channel> channel, std::string id, std::function<void()> wake);
  ~InstanceFeed();
  InstanceFeed(const InstanceFeed&) = delete;
  InstanceFeed& operator=(const InstanceFeed&) = delete;

  // Nothing if it is number `known` still.
  std::optional<State> Latest(std::uint64_t known) const;

 private:
  void Run();
  bool WatchOnce();  // false: there is nothing more to watch

  std::shared_ptr<grpc::Channel> channel_;
  std::string id_;
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  bool ending_ = false;
  grpc::ClientContext* call_ = nullptr;
  State state_;
  std::thread thread_;
};

// The list of instances, once a second.
class WorldList {
 public:
  WorldList(std::shared_ptr<grpc::Channel> channel, std::string address);
  ~WorldList();
  WorldList(const WorldList&) = delete;
  WorldList& operator=(const WorldList&) = delete;

  struct List {
    std::vector<v1::Instance> instances;
    std::string problem;  // why it is old or empty
  };
  List Latest() const;

 private:
  void Run();

  std::shared_ptr<grpc::Channel> channel_;
  std::string address_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  bool ending_ = false;
  List list_;
  std::thread thread_;
};

}  // namespace tessera::gateway

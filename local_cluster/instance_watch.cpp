#include "local_cluster/instance_watch.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "local_cluster/connection.h"

namespace tessera::local {

struct InstanceWatch::Stream {
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientReader<v1::WatchInstanceResponse>> reader;
};

InstanceWatch::InstanceWatch(Connection& connection, const std::string& id,
                             std::function<void(const v1::Instance&)> on_change)
    : stream_(std::make_unique<Stream>()), on_change_(std::move(on_change)) {
  v1::WatchInstanceRequest request;
  request.set_id(id);
  stream_->reader = connection.instances().WatchInstance(&stream_->context, request);
  thread_ = std::thread([this] { Run(); });
}

InstanceWatch::~InstanceWatch() {
  stream_->context.TryCancel();
  thread_.join();
}

void InstanceWatch::Run() {
  v1::WatchInstanceResponse response;
  while (stream_->reader->Read(&response)) {
    if (on_change_) on_change_(response.instance());
    {
      const std::lock_guard lock(mutex_);
      latest_ = response.instance();
      changed_since_ = true;
    }
    changed_.notify_all();
  }
  stream_->reader->Finish();
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
}

v1::Instance InstanceWatch::Latest() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return latest_.has_value() || over_; });
  return latest_.value_or(v1::Instance());
}

bool InstanceWatch::WaitUntil(const std::function<bool(const v1::Instance&)>& holds,
                              std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [&] { return over_ || (latest_ && holds(*latest_)); });
  return latest_ && holds(*latest_);
}

void InstanceWatch::WaitForChange(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, timeout, [this] { return changed_since_; });
  changed_since_ = false;
}

}  // namespace tessera::local

#include "region_worker/fake_agent.h"

#include <grpcpp/grpcpp.h>

#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "region_worker/worker_process.h"
#include "tessera/v1/worker_link.grpc.pb.h"

namespace tessera::worker {

struct FakeAgent::Impl final : v1::WorkerLinkService::Service {
  using Stream = grpc::ServerReaderWriter<v1::AgentOrder, v1::WorkerMessage>;

  explicit Impl(bool knows) : known(knows) {}

  const bool known;
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::map<std::uint32_t, v1::WorkerOrder> orders;
  std::map<std::uint32_t, std::vector<v1::WorkerReport>> reports;
  std::unique_ptr<grpc::Server> server;

  grpc::Status Attach(grpc::ServerContext* context, Stream* stream) override {
    v1::WorkerMessage message;
    if (!stream->Read(&message)) return grpc::Status::OK;
    if (!known) return {grpc::StatusCode::NOT_FOUND, "no such worker"};
    const std::uint32_t region = message.report().identity().region();
    bool ended = false;  // guarded by mutex
    std::thread writer([&] { WriteOrders(region, stream, ended); });
    do {
      const std::lock_guard lock(mutex);
      reports[region].push_back(message.report());
      changed.notify_all();
    } while (stream->Read(&message));
    {
      const std::lock_guard lock(mutex);
      ended = true;
      changed.notify_all();
    }
    writer.join();
    return context->IsCancelled() ? grpc::Status::CANCELLED : grpc::Status::OK;
  }

  void WriteOrders(std::uint32_t region, Stream* stream, const bool& ended) {
    std::unique_lock lock(mutex);
    std::uint64_t told = 0;
    while (true) {
      changed.wait(lock, [&] { return ended || (orders.contains(region) && orders[region].revision() > told); });
      if (ended) return;
      v1::AgentOrder message;
      *message.mutable_order() = orders[region];
      told = orders[region].revision();
      lock.unlock();
      stream->Write(message);
      lock.lock();
    }
  }
};

FakeAgent::FakeAgent(const std::string& socket_path, bool known) : impl_(std::make_unique<Impl>(known)) {
  grpc::ServerBuilder builder;
  builder.AddListeningPort("unix:" + socket_path, grpc::InsecureServerCredentials());
  builder.RegisterService(impl_.get());
  impl_->server = builder.BuildAndStart();
}

FakeAgent::~FakeAgent() { impl_->server->Shutdown(std::chrono::system_clock::now()); }

void FakeAgent::Give(const v1::WorkerOrder& order) {
  const std::lock_guard lock(impl_->mutex);
  impl_->orders[order.region()] = order;
  impl_->changed.notify_all();
}

std::optional<v1::WorkerReport> FakeAgent::WaitFor(std::uint32_t region,
                                                   const std::function<bool(const v1::WorkerReport&)>& wanted) {
  std::unique_lock lock(impl_->mutex);
  std::size_t looked_at = 0;
  std::optional<v1::WorkerReport> found;
  impl_->changed.wait_for(lock, kPatience, [&] {
    const auto& reports = impl_->reports[region];
    for (; looked_at < reports.size() && !found; ++looked_at) {
      if (wanted(reports[looked_at])) found = reports[looked_at];
    }
    return found.has_value();
  });
  return found;
}

std::vector<v1::WorkerReport> FakeAgent::ReportsOf(std::uint32_t region) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->reports[region];
}

}  // namespace tessera::worker

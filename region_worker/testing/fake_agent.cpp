#include "region_worker/testing/fake_agent.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "region_worker/testing/certify.h"
#include "region_worker/testing/worker_process.h"
#include "tessera/v1/worker_link.grpc.pb.h"

namespace tessera::worker {

struct FakeAgent::Impl final : v1::WorkerLinkService::Service {
  using Stream = grpc::ServerReaderWriter<v1::AgentOrder, v1::WorkerMessage>;

  Impl(const net::SigningKey& key, bool knows) : instance_key(key), known(knows) {}

  const net::SigningKey instance_key;
  const bool known;
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::map<std::uint32_t, v1::WorkerOrder> orders;
  std::map<std::uint32_t, std::vector<v1::WorkerReport>> reports;
  std::map<std::uint32_t, std::vector<v1::Inventory>> inventories;
  std::map<std::uint32_t, v1::LeaseRenewal> leases;  // to be given
  bool gives_leases = true;
  std::unique_ptr<grpc::Server> server;

  grpc::Status Attach(grpc::ServerContext* context, Stream* stream) override {
    v1::WorkerMessage message;
    if (!stream->Read(&message)) return grpc::Status::OK;
    if (!known) return {grpc::StatusCode::NOT_FOUND, "no such worker"};
    const std::uint32_t region = message.report().identity().region();
    const auto key = net::VerificationKeyFrom(message.report().public_key(), "public_key");
    if (!key.ok()) return {grpc::StatusCode::INVALID_ARGUMENT, std::string(key.status().message())};
    bool ended = false;  // guarded by mutex
    std::thread writer([&] { WriteOrders(region, *key, stream, ended); });
    do {
      const std::lock_guard lock(mutex);
      Keep(region, message);
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

  // Requires the lock.
  void Keep(std::uint32_t region, const v1::WorkerMessage& message) {
    if (message.has_report()) reports[region].push_back(message.report());
    if (message.has_inventory()) inventories[region].push_back(message.inventory().inventory());
    if (message.has_lease() && gives_leases) {
      v1::LeaseRenewal& lease = leases[region];
      *lease.mutable_identity() = message.lease().identity();
      lease.set_number(message.lease().number());
      lease.set_ttl_ms(1000);
    }
  }

  void WriteOrders(std::uint32_t region, const net::VerificationKey& key, Stream* stream, const bool& ended) {
    std::unique_lock lock(mutex);
    std::uint64_t told = 0;
    const auto has_order = [&] { return orders.contains(region) && orders[region].revision() > told; };
    while (true) {
      changed.wait(lock, [&] { return ended || has_order() || leases.contains(region); });
      if (ended) return;
      v1::AgentOrder message;
      if (has_order()) {
        *message.mutable_order() = orders[region];
        Certify(*message.mutable_order(), instance_key, key);
        told = orders[region].revision();
      } else {
        *message.mutable_lease() = leases[region];
        leases.erase(region);
      }
      lock.unlock();
      stream->Write(message);
      lock.lock();
    }
  }
};

FakeAgent::FakeAgent(const std::string& socket_path, const net::SigningKey& instance_key, bool known)
    : impl_(std::make_unique<Impl>(instance_key, known)) {
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

std::optional<v1::Inventory> FakeAgent::WaitForInventory(std::uint32_t region, std::uint64_t version) {
  std::unique_lock lock(impl_->mutex);
  const auto of_version = [&] {
    const auto& all = impl_->inventories[region];
    return std::find_if(all.begin(), all.end(), [&](const auto& inventory) { return inventory.version() == version; });
  };
  if (!impl_->changed.wait_for(lock, kPatience, [&] { return of_version() != impl_->inventories[region].end(); })) {
    return std::nullopt;
  }
  return *of_version();
}

void FakeAgent::GiveLeases(bool give) {
  const std::lock_guard lock(impl_->mutex);
  impl_->gives_leases = give;
}

std::vector<v1::WorkerReport> FakeAgent::ReportsOf(std::uint32_t region) const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->reports[region];
}

}  // namespace tessera::worker

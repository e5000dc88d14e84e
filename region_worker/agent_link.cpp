#include "region_worker/agent_link.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/world/player_changes.h"
#include "region_worker/wake_event.h"
#include "spdlog/spdlog.h"
#include "telemetry/logging.h"
#include "tessera/v1/worker_link.grpc.pb.h"
#include "trust/message_size.h"

namespace tessera::worker {
namespace {

using Stream = grpc::ClientReaderWriter<v1::WorkerMessage, v1::AgentOrder>;

// A channel of its own for each attempt, so that only the link's own backoff counts: one that is kept waits out gRPC's
// too, which took seconds longer to find an agent that was back.
std::unique_ptr<v1::WorkerLinkService::Stub> MakeStub(const std::string& socket_path) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an environment's proxy is not for this
  // An order names ten thousand players, with their names and properties where this region makes them all.
  arguments.SetMaxReceiveMessageSize(trust::kMaxMessageBytes);
  return v1::WorkerLinkService::NewStub(
      grpc::CreateCustomChannel(absl::StrCat("unix:", socket_path), grpc::InsecureChannelCredentials(), arguments));
}

}  // namespace

struct AgentLink::Impl {
  explicit Impl(const std::string& path) : socket_path(path) {}

  const std::string socket_path;
  WakeEvent wake;
  std::thread thread;

  // The loop takes it several times a tick, and goes before the link's threads: what is done under it is short, and
  // never waits.
  mutable std::mutex mutex;
  std::condition_variable changed;
  std::optional<v1::WorkerOrder> order;          // for the loop
  v1::WorkerReport newest;                       // said again at each attachment
  std::optional<v1::InventoryReport> inventory;  // said again too
  std::optional<v1::LeaseRequest> lease_request;
  std::optional<v1::LeaseRenewal> lease;  // for the loop
  bool has_report = false, unsent = false, inventory_unsent = false;
  bool closing = false, refused = false, attached = false;
  bool stream_broken = false;              // its reader has seen the end
  grpc::ClientContext* context = nullptr;  // the stream's that stands, for Close to cancel

  void Run();
  grpc::Status Attach();
  void ReadOrders(Stream& stream);
  bool Take(v1::AgentOrder& message);
  void WriteReports(Stream& stream);
  bool Unsaid() const { return unsent || inventory_unsent || lease_request; }
  v1::WorkerMessage TakeMessage();
};

// Dials until closed or refused.
void AgentLink::Impl::Run() {
  auto backoff = kMinBackoff;
  while (true) {
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return has_report || closing; });
      if (closing && !unsent) return;
    }
    const grpc::Status status = Attach();
    std::unique_lock lock(mutex);
    if (std::exchange(attached, false)) {
      backoff = kMinBackoff;
      if (!closing) {
        lock.unlock();  // the loop waits for no log
        spdlog::warn("agent gone socket={} reason={}", telemetry::LogValue(socket_path),
                     telemetry::LogValue(status.error_message()));
        lock.lock();
      }
    }
    if (status.error_code() == grpc::StatusCode::NOT_FOUND) {
      refused = true;
      wake.Set();
      return;
    }
    if (closing) return;
    changed.wait_for(lock, backoff, [&] { return closing; });
    if (closing) return;
    backoff = std::min(backoff * 2, kMaxBackoff);
  }
}

// One attachment, from dialling to its end.
grpc::Status AgentLink::Impl::Attach() {
  const std::unique_ptr<v1::WorkerLinkService::Stub> stub = MakeStub(socket_path);
  grpc::ClientContext here;
  {
    const std::lock_guard lock(mutex);
    stream_broken = false;
    unsent = true;  // a new stream begins with who we are
    inventory_unsent = inventory.has_value();
    lease_request.reset();
    context = &here;
  }
  const std::unique_ptr<Stream> stream = stub->Attach(&here);
  std::thread reader([&] { ReadOrders(*stream); });
  WriteReports(*stream);
  stream->WritesDone();
  reader.join();
  grpc::Status status = stream->Finish();
  const std::lock_guard lock(mutex);
  context = nullptr;
  changed.notify_all();
  return status;
}

void AgentLink::Impl::ReadOrders(Stream& stream) {
  v1::AgentOrder message;
  while (stream.Read(&message)) {
    if (Take(message)) spdlog::info("attached to agent socket={}", telemetry::LogValue(socket_path));
  }
  const std::lock_guard lock(mutex);
  stream_broken = true;
  changed.notify_all();
}

// True: it is the first of its stream.
bool AgentLink::Impl::Take(v1::AgentOrder& message) {
  const std::lock_guard lock(mutex);
  if (message.has_order()) {
    if (order && Continues(*order, message.order())) CompletePlayers(*std::move(order), *message.mutable_order());
    order = std::move(*message.mutable_order());
  }
  if (message.has_lease()) lease = std::move(*message.mutable_lease());
  wake.Set();
  return !std::exchange(attached, true);
}

// Requires the lock. What is to be said next; the report first.
v1::WorkerMessage AgentLink::Impl::TakeMessage() {
  v1::WorkerMessage message;
  if (std::exchange(unsent, false)) {
    *message.mutable_report() = newest;
  } else if (std::exchange(inventory_unsent, false)) {
    *message.mutable_inventory() = *inventory;
  } else {
    *message.mutable_lease() = *std::exchange(lease_request, std::nullopt);
  }
  return message;
}

void AgentLink::Impl::WriteReports(Stream& stream) {
  std::unique_lock lock(mutex);
  while (true) {
    changed.wait(lock, [&] { return Unsaid() || closing || stream_broken; });
    if (stream_broken || !Unsaid()) return;
    const v1::WorkerMessage message = TakeMessage();
    lock.unlock();
    const bool written = stream.Write(message);
    lock.lock();
    if (!written) return;
  }
}

AgentLink::AgentLink(const std::string& socket_path) : impl_(std::make_unique<Impl>(socket_path)) {
  impl_->thread = std::thread([impl = impl_.get()] { impl->Run(); });
}

AgentLink::~AgentLink() { Close(std::chrono::milliseconds(0)); }

int AgentLink::wake_fd() const { return impl_->wake.fd(); }

std::optional<v1::WorkerOrder> AgentLink::TakeOrder() {
  impl_->wake.Clear();
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->order, std::nullopt);
}

void AgentLink::Report(const v1::WorkerReport& report) {
  const std::lock_guard lock(impl_->mutex);
  impl_->newest = report;
  impl_->has_report = impl_->unsent = true;
  impl_->changed.notify_all();
}

void AgentLink::Reattach() {
  const std::lock_guard lock(impl_->mutex);
  impl_->order.reset();
  if (impl_->context != nullptr) impl_->context->TryCancel();
}

std::optional<v1::LeaseRenewal> AgentLink::TakeLease() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->lease, std::nullopt);
}

void AgentLink::SetInventory(const std::optional<v1::InventoryReport>& inventory) {
  const std::lock_guard lock(impl_->mutex);
  impl_->inventory = inventory;
  impl_->inventory_unsent = inventory.has_value();
  impl_->changed.notify_all();
}

void AgentLink::AskLease(const v1::LeaseRequest& request) {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->attached) return;
  impl_->lease_request = request;
  impl_->changed.notify_all();
}

bool AgentLink::refused() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->refused;
}

bool AgentLink::attached() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->attached;
}

void AgentLink::Close(std::chrono::milliseconds patience) {
  if (!impl_->thread.joinable()) return;
  {
    std::unique_lock lock(impl_->mutex);
    // The writer sends what waits and then half-closes; the agent answers by ending the stream.
    impl_->closing = true;
    impl_->changed.notify_all();
    impl_->changed.wait_for(lock, patience, [&] { return impl_->context == nullptr || impl_->stream_broken; });
    if (impl_->context != nullptr) impl_->context->TryCancel();
  }
  impl_->thread.join();
}

}  // namespace tessera::worker

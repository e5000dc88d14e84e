#include "agent/worker_socket.h"

#include <grpcpp/grpcpp.h>
#include <grpcpp/server_posix.h>

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "agent/grpc_status.h"
#include "agent/limits.h"
#include "agent/peer_listener.h"
#include "agent/worker_budget.h"
#include "core/world/player_changes.h"
#include "tessera/v1/worker_link.grpc.pb.h"

namespace tessera::agent {
namespace {

class Server;

// One attached worker. gRPC's rule: nothing may be started after Finish, so Finish waits for the write under way.
class WorkerConnection final : public grpc::ServerBidiReactor<v1::WorkerMessage, v1::AgentOrder> {
 public:
  WorkerConnection(Server& server, ConnectionId id, pid_t peer) : server_(server), id_(id), peer_(peer) {}

  void Begin() { StartRead(&incoming_); }

  void Send(const v1::WorkerOrder& order) {
    Put(waiting_, order, [](v1::WorkerOrder& overtaken, v1::WorkerOrder& next) {
      if (Continues(overtaken, next)) CompletePlayers(std::move(overtaken), next);
    });
  }
  void Send(const v1::LeaseRenewal& renewal) {
    Put(waiting_lease_, renewal, [](v1::LeaseRenewal&, v1::LeaseRenewal&) {});
  }

  void End(const absl::Status& status) {
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      ending_ = ToGrpc(status);
      if (writing_) return;
    }
    Finish(*ending_);
  }

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override;

 private:
  // `keep` has the message say what is left out in it, and stands in the one that it overtakes.
  template <class Message, class Keep>
  void Put(std::optional<Message>& place, Message message, const Keep& keep) {
    {
      const std::lock_guard lock(mutex_);
      if (ending_) return;
      if (place) keep(*place, message);
      place = std::move(message);
      if (writing_) return;
      writing_ = true;
    }
    WriteNext();
  }

  void WriteNext() {
    {
      const std::lock_guard lock(mutex_);
      outgoing_.Clear();
      if (waiting_lease_) {
        *outgoing_.mutable_lease() = *std::exchange(waiting_lease_, std::nullopt);
      } else {
        *outgoing_.mutable_order() = *std::exchange(waiting_, std::nullopt);
      }
    }
    StartWrite(&outgoing_);
  }

  Server& server_;
  const ConnectionId id_;
  const pid_t peer_;
  v1::WorkerMessage incoming_;
  v1::AgentOrder outgoing_;  // while writing_

  std::mutex mutex_;  // guards what follows
  std::optional<v1::WorkerOrder> waiting_;
  std::optional<v1::LeaseRenewal> waiting_lease_;  // goes first: it is small and does not wait well
  bool writing_ = false;
  std::optional<grpc::Status> ending_;  // set once
};

class Server final : public WorkerSocket, public v1::WorkerLinkService::CallbackService {
 public:
  explicit Server(Callbacks callbacks) : callbacks_(std::move(callbacks)) {}
  ~Server() override {
    std::unique_ptr<PeerListener> ended;  // hands nothing to the server any more
    {
      const std::lock_guard lock(mutex_);
      ended = std::move(listener_);
    }
    ended.reset();
    if (server_) {
      server_->Shutdown(std::chrono::system_clock::now());
      server_->Wait();
    }
  }

  absl::Status Listen(const std::string& path) {
    grpc::ServerBuilder builder;
    builder.RegisterService(this);
    builder.SetMaxReceiveMessageSize(kMaxWorkerMessageBytes);
    builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kStreamsOfAConnection);
    server_ = builder.BuildAndStart();
    if (!server_) return absl::UnavailableError(absl::StrCat("cannot serve workers on ", path));
    // A worker that attaches at once waits until its peer can be asked for.
    const std::lock_guard lock(mutex_);
    auto listener = PeerListener::Listen(path, [this](int fd) { grpc::AddInsecureChannelFromFd(server_.get(), fd); });
    if (!listener.ok()) return listener.status();
    listener_ = *std::move(listener);
    return absl::OkStatus();
  }

  grpc::ServerBidiReactor<v1::WorkerMessage, v1::AgentOrder>* Attach(grpc::CallbackServerContext* context) override {
    std::shared_ptr<WorkerConnection> connection;
    {
      const std::lock_guard lock(mutex_);
      connection = std::make_shared<WorkerConnection>(*this, next_id_, PeerOf(context->peer()));
      connections_.emplace(next_id_++, connection);
    }
    connection->Begin();
    return connection.get();
  }

  void Send(ConnectionId id, const v1::WorkerOrder& order) override {
    if (const auto connection = Find(id)) connection->Send(order);
  }
  void SendLease(ConnectionId id, const v1::LeaseRenewal& renewal) override {
    if (const auto connection = Find(id)) connection->Send(renewal);
  }
  void Close(ConnectionId id, const absl::Status& status) override {
    if (const auto connection = Find(id)) connection->End(status);
  }

  const Callbacks& callbacks() const { return callbacks_; }
  WorkerBudget& budget() { return budget_; }
  void Forget(ConnectionId id) {
    std::shared_ptr<WorkerConnection> last;  // destroyed after the lock is given back
    {
      const std::lock_guard lock(mutex_);
      const auto found = connections_.find(id);
      last = std::move(found->second);
      connections_.erase(found);
    }
    callbacks_.on_closed(id);
    budget_.Prune(Clock::now());
  }

 private:
  // gRPC names a connection that it was handed by its descriptor: "fd:17". 0, which is no worker's, if there is none.
  pid_t PeerOf(const std::string& name) const {
    int fd = 0;
    if (!listener_ || !absl::SimpleAtoi(absl::StripPrefix(name, "fd:"), &fd)) return 0;
    return listener_->PeerOf(fd);
  }
  std::shared_ptr<WorkerConnection> Find(ConnectionId id) {
    const std::lock_guard lock(mutex_);
    const auto found = connections_.find(id);
    return found == connections_.end() ? nullptr : found->second;
  }

  Callbacks callbacks_;
  WorkerBudget budget_;
  std::unique_ptr<grpc::Server> server_;
  std::mutex mutex_;  // guards what follows
  ConnectionId next_id_ = 1;
  std::map<ConnectionId, std::shared_ptr<WorkerConnection>> connections_;
  std::unique_ptr<PeerListener> listener_;
};

void WorkerConnection::OnReadDone(bool ok) {
  if (!ok) return End(absl::OkStatus());
  if (!server_.budget().Take(peer_, Clock::now(), incoming_.ByteSizeLong())) {
    server_.callbacks().on_flood(peer_);
    return End(absl::ResourceExhaustedError("a worker says no more than that to its agent"));
  }
  server_.callbacks().on_message(id_, peer_, std::move(incoming_));
  incoming_.Clear();
  {
    const std::lock_guard lock(mutex_);
    if (ending_) return;
  }
  StartRead(&incoming_);
}

void WorkerConnection::OnWriteDone(bool ok) {
  bool next = false, finish = false;
  {
    const std::lock_guard lock(mutex_);
    next = ok && (waiting_ || waiting_lease_) && !ending_;
    writing_ = next;
    finish = !next && ending_;
  }
  if (next) WriteNext();
  if (finish) Finish(*ending_);
}

void WorkerConnection::OnDone() { server_.Forget(id_); }

}  // namespace

absl::StatusOr<std::unique_ptr<WorkerSocket>> WorkerSocket::Serve(const std::string& path, Callbacks callbacks) {
  auto server = std::make_unique<Server>(std::move(callbacks));
  if (absl::Status status = server->Listen(path); !status.ok()) return status;
  return server;
}

}  // namespace tessera::agent

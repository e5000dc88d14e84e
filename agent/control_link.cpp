#include "agent/control_link.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <mutex>
#include <utility>

#include "agent/grpc_status.h"
#include "agent/limits.h"
#include "tessera/v1/agent_link.grpc.pb.h"

namespace tessera::agent {
namespace {

grpc::ChannelArguments Arguments(bool leaves_silent) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // else a failed attempt's waiting time is inherited
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, leaves_silent ? kLeaderKeepaliveTime_ms : kKeepaliveTime_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, leaves_silent ? kLeaderKeepaliveTimeout_ms : kKeepaliveTimeout_ms);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return arguments;
}

template <class Message>
bool SameWorker(const Message& a, const Message& b) {
  return a.identity().instance_id() == b.identity().instance_id() && a.identity().region() == b.identity().region() &&
         a.identity().incarnation() == b.identity().incarnation();
}

// Whether `newer` says all that `older` does.
bool Replaces(const v1::AgentMessage& newer, const v1::AgentMessage& older) {
  if (newer.has_heartbeat()) return older.has_heartbeat();
  if (newer.has_lease()) return older.has_lease() && SameWorker(newer.lease(), older.lease());
  if (newer.has_inventory()) return older.has_inventory() && SameWorker(newer.inventory(), older.inventory());
  return newer.has_report() && older.has_report() && SameWorker(newer.report(), older.report());
}

// A file that comes in pieces. Ends itself.
template <class Request, class Piece>
class PieceFetch final : public grpc::ClientReadReactor<Piece> {
 public:
  using Done = std::function<void(absl::StatusOr<std::string>)>;
  // The bytes of a piece.
  using BytesOf = const std::string& (*)(const Piece& piece);

  // `start(context, request, reactor)` begins the call. `most`: bytes of the whole.
  template <class Start>
  static void Begin(const Start& start, const Request& request, BytesOf bytes_of, std::size_t most, Done done) {
    auto* fetch = new PieceFetch(request, bytes_of, most, std::move(done));
    start(&fetch->context_, &fetch->request_, fetch);
    fetch->StartRead(&fetch->piece_);
    fetch->StartCall();
  }
  void OnReadDone(bool ok) override {
    if (!ok) return;
    bytes_ += bytes_of_(piece_);
    if (bytes_.size() > most_) return context_.TryCancel();
    this->StartRead(&piece_);
  }
  void OnDone(const grpc::Status& status) override {
    if (status.ok()) {
      done_(std::move(bytes_));
    } else {
      done_(FromGrpc(status));
    }
    delete this;
  }

 private:
  PieceFetch(const Request& request, BytesOf bytes_of, std::size_t most, Done done)
      : request_(request), bytes_of_(bytes_of), most_(most), done_(std::move(done)) {
    context_.set_deadline(std::chrono::system_clock::now() + kFetchTimeout);
  }
  grpc::ClientContext context_;
  const Request request_;
  const BytesOf bytes_of_;
  const std::size_t most_;
  Piece piece_;
  std::string bytes_;
  Done done_;
};

using FetchDone = std::function<void(absl::StatusOr<std::string>)>;

// A file that comes in one message.
void FetchWhole(v1::AgentLinkService::Stub& stub, const v1::FetchSceneRequest& request, FetchDone done) {
  struct Call {
    grpc::ClientContext context;
    v1::FetchSceneRequest request;
    v1::FetchSceneResponse response;
  };
  const auto call = std::make_shared<Call>();
  call->context.set_deadline(std::chrono::system_clock::now() + kFetchTimeout);
  call->request = request;
  stub.async()->FetchScene(&call->context, &call->request, &call->response,
                           [call, done = std::move(done)](const grpc::Status& status) {
                             if (!status.ok()) return done(FromGrpc(status));
                             done(std::move(*call->response.mutable_scene()));
                           });
}

void FetchWhole(v1::AgentLinkService::Stub& stub, const v1::FetchGameRequest& request, FetchDone done) {
  struct Call {
    grpc::ClientContext context;
    v1::FetchGameRequest request;
    v1::FetchGameResponse response;
  };
  const auto call = std::make_shared<Call>();
  call->context.set_deadline(std::chrono::system_clock::now() + kFetchTimeout);
  call->request = request;
  stub.async()->FetchGame(&call->context, &call->request, &call->response,
                          [call, done = std::move(done)](const grpc::Status& status) {
                            if (!status.ok()) return done(FromGrpc(status));
                            done(std::move(*call->response.mutable_game()));
                          });
}

// Ends itself.
class StateUpload final : public grpc::ClientWriteReactor<v1::UploadCheckpointRequest> {
 public:
  using Done = std::function<void(absl::Status)>;

  static void Begin(v1::AgentLinkService::Stub& stub, const v1::UploadCheckpointRequest& request, std::string bytes,
                    Done done) {
    auto* upload = new StateUpload(request, std::move(bytes), std::move(done));
    stub.async()->UploadCheckpoint(&upload->context_, &upload->response_, upload);
    upload->WriteNext();
    upload->StartCall();
  }
  void OnWriteDone(bool ok) override {
    if (!ok) return;
    piece_.Clear();
    WriteNext();
  }
  void OnDone(const grpc::Status& status) override {
    done_(FromGrpc(status));
    delete this;
  }

 private:
  StateUpload(const v1::UploadCheckpointRequest& request, std::string bytes, Done done)
      : piece_(request), bytes_(std::move(bytes)), done_(std::move(done)) {
    context_.set_deadline(std::chrono::system_clock::now() + kFetchTimeout);
  }
  void WriteNext() {
    if (at_ >= bytes_.size()) return StartWritesDone();
    piece_.set_data(bytes_.substr(at_, kPieceBytes));
    at_ += kPieceBytes;
    StartWrite(&piece_);
  }
  grpc::ClientContext context_;
  v1::UploadCheckpointRequest piece_;
  v1::UploadCheckpointResponse response_;
  const std::string bytes_;
  std::size_t at_ = 0;
  Done done_;
};

// gRPC's rule that decides the shape below: once a read has failed no write may be started, and a hold keeps the call
// open until we say that none will be. So the hold is given back when reading is over and no write is under way.
class Stream final : public ControlLink, public grpc::ClientBidiReactor<v1::AgentMessage, v1::ControlMessage> {
 public:
  Stream(const std::shared_ptr<grpc::Channel>& channel, Callbacks callbacks)
      : stub_(v1::AgentLinkService::NewStub(channel)), callbacks_(std::move(callbacks)) {}

  void Begin(std::shared_ptr<Stream> self, const v1::AgentHello& hello) {
    self_ = std::move(self);
    stub_->async()->Attach(&context_, this);
    AddHold();
    StartRead(&incoming_);
    v1::AgentMessage first;
    *first.mutable_hello() = hello;
    Send(std::move(first));
    StartCall();
  }

  void Send(v1::AgentMessage message) override {
    {
      const std::lock_guard lock(mutex_);
      if (reading_over_ || closing_) return;
      const auto old =
          std::find_if(waiting_.begin(), waiting_.end(), [&](const auto& m) { return Replaces(message, m); });
      if (old != waiting_.end()) {
        *old = std::move(message);
      } else {
        waiting_.push_back(std::move(message));
      }
      if (writing_) return;
      writing_ = true;
    }
    WriteNext();
  }

  void Close() override {
    {
      const std::lock_guard lock(mutex_);
      if (reading_over_ || closing_) return;
      closing_ = true;
      if (writing_) return;
      writing_ = true;
    }
    WriteNext();
  }

  void Cancel() override { context_.TryCancel(); }

  void FetchState(const v1::FetchStateRequest& request,
                  std::function<void(absl::StatusOr<std::string>)> done) override {
    PieceFetch<v1::FetchStateRequest, v1::FetchStateResponse>::Begin(
        [this](auto* context, auto* asked, auto* reactor) { stub_->async()->FetchState(context, asked, reactor); },
        request, [](const v1::FetchStateResponse& piece) -> const std::string& { return piece.data(); }, kMaxStateBytes,
        std::move(done));
  }
  void UploadCheckpoint(const v1::UploadCheckpointRequest& request, std::string bytes,
                        std::function<void(absl::Status)> done) override {
    StateUpload::Begin(*stub_, request, std::move(bytes), std::move(done));
  }

  void FetchContent(const Content& content, const HostIdentity& identity,
                    std::function<void(absl::StatusOr<std::string>)> done) override {
    const auto sign = [&](auto& request) {
      request.set_host_id(identity.host_id());
      request.set_host_secret(identity.host_secret());
    };
    if (content.kind == ContentKind::kGame) {
      v1::FetchGameRequest game;
      game.set_game_hash(content.hash);
      sign(game);
      return FetchWhole(*stub_, game, std::move(done));
    }
    v1::FetchSceneRequest request;
    request.set_scene_hash(content.hash);
    sign(request);
    PieceFetch<v1::FetchSceneRequest, v1::FetchSceneResponse>::Begin(
        [this](auto* context, auto* asked, auto* reactor) { stub_->async()->StreamScene(context, asked, reactor); },
        request, [](const v1::FetchSceneResponse& piece) -> const std::string& { return piece.scene(); },
        std::size_t{kMaxMessageBytes},
        [stub = stub_, request, done](absl::StatusOr<std::string> got) {
          // A control plane of an earlier release gives it in one message.
          if (absl::IsUnimplemented(got.status())) return FetchWhole(*stub, request, done);
          done(std::move(got));
        });
  }

  void OnReadDone(bool ok) override {
    if (ok) {
      callbacks_.on_message(std::move(incoming_));
      incoming_.Clear();
      StartRead(&incoming_);
      return;
    }
    bool release = false;
    {
      const std::lock_guard lock(mutex_);
      reading_over_ = true;
      release = !writing_;
    }
    if (release) RemoveHold();
  }

  void OnWriteDone(bool ok) override { Written(ok); }
  void OnWritesDoneDone(bool) override { Written(false); }

  void OnDone(const grpc::Status& status) override {
    const auto on_closed = callbacks_.on_closed;
    const absl::Status result = FromGrpc(status);
    std::shared_ptr<Stream> self = std::move(self_);
    self.reset();  // before the callback, so that whoever still holds the link ends it on its own thread
    on_closed(result);
  }

 private:
  // With `writing_` set, so this thread alone starts a write.
  void WriteNext() {
    {
      const std::lock_guard lock(mutex_);
      last_ = waiting_.empty();
      if (!last_) {
        outgoing_ = std::move(waiting_.front());
        waiting_.pop_front();
      }
    }
    if (last_) {
      StartWritesDone();
    } else {
      StartWrite(&outgoing_);
    }
  }

  // A write, or the half-close that follows the last one, is over.
  void Written(bool more_possible) {
    bool next = false, release = false;
    {
      const std::lock_guard lock(mutex_);
      if (!more_possible) closing_ = true;  // nothing more goes out; a failing read ends the stream
      next = more_possible && !reading_over_ && (closing_ || !waiting_.empty());
      writing_ = next;
      release = !next && reading_over_;
    }
    if (next) WriteNext();
    if (release) RemoveHold();
  }

  const std::shared_ptr<v1::AgentLinkService::Stub> stub_;  // outlives what is fetched
  Callbacks callbacks_;
  grpc::ClientContext context_;
  v1::ControlMessage incoming_;
  v1::AgentMessage outgoing_;  // while writing_
  bool last_ = false;
  std::shared_ptr<Stream> self_;

  std::mutex mutex_;  // guards what follows
  std::deque<v1::AgentMessage> waiting_;
  bool writing_ = false, closing_ = false, reading_over_ = false;
};

}  // namespace

absl::StatusOr<std::shared_ptr<ControlLink>> ControlLink::Dial(const std::string& address,
                                                               const trust::Credentials& credentials,
                                                               const v1::AgentHello& hello, Callbacks callbacks,
                                                               bool leaves_silent) {
  const auto channel = trust::Dial(address, credentials, Arguments(leaves_silent));
  if (!channel.ok()) return channel.status();
  auto stream = std::make_shared<Stream>(*channel, std::move(callbacks));
  stream->Begin(stream, hello);
  return stream;
}

}  // namespace tessera::agent

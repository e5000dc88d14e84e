#include "agent/testing/fake_control_plane.h"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <set>
#include <utility>

#include "host/temporary_folder.h"
#include "tessera/v1/agent_link.grpc.pb.h"

namespace tessera::agent {
namespace {

constexpr std::chrono::seconds kPatience{30};  // a loaded machine is slow; a test that passes never waits this long
constexpr std::uint32_t kHeartbeat_ms = 50;
constexpr std::size_t kScenePieceBytes = 100;

using Stream = grpc::ServerReaderWriter<v1::ControlMessage, v1::AgentMessage>;

}  // namespace

class FakeControlPlane::Service final : public v1::AgentLinkService::Service {
 public:
  grpc::Status Attach(grpc::ServerContext*, Stream* stream) override {
    v1::AgentMessage message;
    if (!stream->Read(&message) || !message.has_hello()) return {grpc::StatusCode::INVALID_ARGUMENT, "no hello"};
    {
      const std::lock_guard lock(mutex);
      if (grpc::Status status = Admit(message.hello(), stream); !status.ok()) return status;
      streams.insert(stream);
      record.streams = static_cast<int>(streams.size());
      Send(stream);
    }
    changed.notify_all();
    while (stream->Read(&message)) {
      Hear(message);
      changed.notify_all();
    }
    {
      const std::lock_guard lock(mutex);
      streams.erase(stream);
      record.streams = static_cast<int>(streams.size());
    }
    changed.notify_all();
    return grpc::Status::OK;
  }

  grpc::Status FetchScene(grpc::ServerContext*, const v1::FetchSceneRequest* request,
                          v1::FetchSceneResponse* response) override {
    const std::lock_guard lock(mutex);
    ++record.scene_fetches;
    if (request->host_secret() != record.secret) return {grpc::StatusCode::UNAUTHENTICATED, "wrong secret"};
    const auto scene = record.scenes.find(request->scene_hash());
    if (scene == record.scenes.end()) return {grpc::StatusCode::NOT_FOUND, "no instance uses it"};
    response->set_scene(scene->second);
    return grpc::Status::OK;
  }

  grpc::Status StreamScene(grpc::ServerContext* context, const v1::FetchSceneRequest* request,
                           grpc::ServerWriter<v1::FetchSceneResponse>* writer) override {
    {
      const std::lock_guard lock(mutex);
      if (record.knows_no_streams) return {grpc::StatusCode::UNIMPLEMENTED, ""};
    }
    v1::FetchSceneResponse whole;
    if (grpc::Status status = FetchScene(context, request, &whole); !status.ok()) return status;
    v1::FetchSceneResponse piece;
    for (std::size_t at = 0; at < whole.scene().size(); at += kScenePieceBytes) {
      piece.set_scene(whole.scene().substr(at, kScenePieceBytes));
      writer->Write(piece);
    }
    return grpc::Status::OK;
  }

  grpc::Status FetchGame(grpc::ServerContext*, const v1::FetchGameRequest* request,
                         v1::FetchGameResponse* response) override {
    const std::lock_guard lock(mutex);
    ++record.game_fetches;
    if (request->host_secret() != record.secret) return {grpc::StatusCode::UNAUTHENTICATED, "wrong secret"};
    const auto game = record.games.find(request->game_hash());
    if (game == record.games.end()) return {grpc::StatusCode::NOT_FOUND, "no instance runs it"};
    response->set_game(game->second);
    return grpc::Status::OK;
  }

  // Requires the lock.
  void Send(Stream* stream) {
    v1::ControlMessage message = desired;
    if (record.revocations) *message.mutable_desired()->mutable_revocations() = *record.revocations;
    stream->Write(message);
  }

  mutable std::mutex mutex;  // guards all below
  mutable std::condition_variable changed;
  ControlRecord record;
  v1::ControlMessage desired;
  std::set<Stream*> streams;
  host::TemporaryFolder folder;  // holds the socket
  std::unique_ptr<grpc::Server> server;

 private:
  grpc::Status Admit(const v1::AgentHello& hello, Stream* stream) {
    record.hellos.push_back(hello);
    if (record.lost_answers > 0) {
      --record.lost_answers;
      return {grpc::StatusCode::UNAVAILABLE, "cut off"};
    }
    v1::ControlMessage answer;
    v1::Admitted& admitted = *answer.mutable_admitted();
    admitted.set_host_id("host-1");
    admitted.set_host_name("alpha");
    admitted.set_heartbeat_interval_ms(kHeartbeat_ms);
    admitted.set_revocations_key(record.revocations_key);
    admitted.set_report_revocations(record.report_revocations);
    if (!hello.join_token().empty()) {
      if (hello.join_token() != record.token) return {grpc::StatusCode::UNAUTHENTICATED, "join token is unknown"};
      if (record.token_used) return {grpc::StatusCode::UNAUTHENTICATED, "join token has been used"};
      record.token_used = true;
      admitted.set_host_secret(record.secret);
    } else if (hello.host_id() != "host-1" || hello.host_secret() != record.secret) {
      return {grpc::StatusCode::UNAUTHENTICATED, "host id or secret is wrong"};
    }
    stream->Write(answer);
    return grpc::Status::OK;
  }

  void Hear(const v1::AgentMessage& message) {
    const std::lock_guard lock(mutex);
    if (message.has_heartbeat()) {
      ++record.heartbeats;
      record.acted_on = message.heartbeat().desired_revision();
      record.reports.clear();
      for (const auto& report : message.heartbeat().workers()) record.reports[report.identity().region()] = report;
    } else if (message.has_report()) {
      record.reports[message.report().identity().region()] = message.report();
    } else if (message.kind_case() == v1::AgentMessage::kKeptRevocations) {
      record.kept_revocations.push_back(message.kept_revocations());
    } else if (message.has_revocations()) {
      record.reported_revocations.push_back(message.revocations());
    } else if (message.has_game_modules()) {
      record.module_lists.push_back(message.game_modules());
    } else if (message.has_exited()) {
      record.exits.push_back(message.exited());
    }
  }
};

FakeControlPlane::FakeControlPlane() : service_(std::make_unique<Service>()) {
  service_->desired.mutable_desired();
  Start();
}
FakeControlPlane::~FakeControlPlane() { Stop(); }

std::string FakeControlPlane::address() const { return "unix:" + service_->folder.path() + "/control.sock"; }

void FakeControlPlane::Start() {
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address(), grpc::InsecureServerCredentials());
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 1000);
  builder.RegisterService(service_.get());
  service_->server = builder.BuildAndStart();
}

void FakeControlPlane::Stop() {
  if (!service_->server) return;
  service_->server->Shutdown(std::chrono::system_clock::now());
  service_->server->Wait();
  service_->server.reset();
}

void FakeControlPlane::SetDesired(const std::vector<v1::WorkerOrder>& orders) {
  const std::lock_guard lock(service_->mutex);
  v1::DesiredSet& set = *service_->desired.mutable_desired();
  set.set_revision(set.revision() + 1);
  set.clear_workers();
  for (const v1::WorkerOrder& order : orders) *set.add_workers() = order;
  for (Stream* stream : service_->streams) service_->Send(stream);
}

void FakeControlPlane::Change(const std::function<void(ControlRecord&)>& change) {
  const std::lock_guard lock(service_->mutex);
  change(service_->record);
}

ControlRecord FakeControlPlane::record() const {
  const std::lock_guard lock(service_->mutex);
  return service_->record;
}

bool FakeControlPlane::WaitUntil(const std::function<bool(const ControlRecord&)>& holds) const {
  std::unique_lock lock(service_->mutex);
  return service_->changed.wait_for(lock, kPatience, [&] { return holds(service_->record); });
}

}  // namespace tessera::agent

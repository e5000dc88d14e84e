#include "tests/support/attacks.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <mutex>
#include <string_view>
#include <thread>

#include "local_cluster/command_error.h"
#include "tessera/v1/access.grpc.pb.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tessera/v1/session.grpc.pb.h"
#include "tessera/v1/visuals.grpc.pb.h"
#include "trust/certificate.h"
#include "trust/dial.h"

namespace tessera::support {
namespace {

using grpc::StatusCode;
using std::chrono::seconds;

#if defined(__SANITIZE_THREAD__)
constexpr seconds kAttackPatience{120};  // the attacker is as slow as all else
#else
constexpr seconds kAttackPatience{20};
#endif
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;
constexpr int kInventedPlayers = 16'000'000, kBoastedPlayers = 1'000'000, kHollowReports = 16'000'000;
constexpr char kHealthCheck[] = "/grpc.health.v1.Health/Check";

std::chrono::system_clock::time_point Soon() { return std::chrono::system_clock::now() + kAttackPatience; }

// A connection of its own for each call, so that none waits for another's.
std::shared_ptr<grpc::Channel> DialAlone(const std::string& address, const trust::Credentials& credentials = {}) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return local::OrThrow(trust::Dial(address, credentials, arguments));
}

// The outcome of a call by its name, with a request of so many bytes.
grpc::Status CallByName(const std::shared_ptr<grpc::Channel>& channel, const std::string& name, std::size_t bytes = 0) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const auto call = stub.PrepareCall(&context, name, &queue);
  const auto await = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  await();
  const grpc::Slice request(std::string(bytes, 'x'));
  call->WriteLast(grpc::ByteBuffer(&request, 1), {}, nullptr);
  await();
  grpc::ByteBuffer answer;  // without reading it, one that is given would not end
  call->Read(&answer, nullptr);
  await();
  grpc::Status status;
  call->Finish(&status, nullptr);
  await();
  return status;
}

std::vector<std::string> AllMethodNames() {
  std::vector<std::string> names{"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                 "/grpc.health.v1.Health/Watch", kHealthCheck, "/tessera.v1.NoService/NoMethod"};
  for (const google::protobuf::FileDescriptor* file :
       {v1::CreateTokenRequest::descriptor()->file(), v1::AgentHello::descriptor()->file(),
        v1::Host::descriptor()->file(), v1::Instance::descriptor()->file(),
        v1::JoinInstanceRequest::descriptor()->file(), v1::PutVisualRequest::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        names.push_back("/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name());
      }
    }
  }
  return names;
}

bool IsRefusal(const grpc::Status& status) {
  return status.error_code() == StatusCode::UNAUTHENTICATED || status.error_code() == StatusCode::PERMISSION_DENIED;
}

bool IsForPlayers(const std::string& method) {
  return method.find("SessionService") != std::string::npos || method.ends_with("/ListInstances") ||
         method.ends_with("/GetInstance") || method.find("grpc.health") != std::string::npos;
}

// A host that was admitted by TLS, and its stream.
class AttackingHost {
 public:
  AttackingHost(const Target& target, const std::string& name, std::uint32_t capacity) {
    v1::AddHostRequest request;
    request.set_name(name);
    v1::AddHostResponse added;
    grpc::ClientContext context;
    const grpc::Status status = v1::HostService::NewStub(DialAlone(target.socket))->AddHost(&context, request, &added);
    if (!status.ok()) throw local::CommandError("host add: " + status.error_message());
    trust::Credentials credentials;
    credentials.key = local::OrThrow(trust::MakeKey());
    v1::AgentMessage hello;
    hello.mutable_hello()->set_join_token(added.join_token().substr(0, added.join_token().find('.')));
    hello.mutable_hello()->set_certificate_request(local::OrThrow(trust::MakeRequest(credentials.key)));
    hello.mutable_hello()->set_advertise_address("127.0.0.1");
    hello.mutable_hello()->set_version(TESSERA_VERSION);
    hello.mutable_hello()->mutable_resources()->set_region_capacity(capacity);
    v1::ControlMessage answer;
    {
      grpc::ClientContext first;
      const trust::Credentials shown{
          .authority = {}, .certificate = {}, .key = {}, .bearer_token = hello.hello().join_token()};
      const auto joining = v1::AgentLinkService::NewStub(DialAlone(target.operators, shown))->Attach(&first);
      if (!joining->Write(hello) || !joining->Read(&answer)) throw local::CommandError("the host was not admitted");
      admitted_ = answer.admitted();
      first.TryCancel();
      while (joining->Read(&answer)) {
      }
      (void)joining->Finish();
    }
    credentials.certificate = admitted_.certificate();
    credentials.authority = admitted_.authority();
    stub_ = v1::AgentLinkService::NewStub(DialAlone(target.operators, credentials));
    stream_ = stub_->Attach(&context_);
    v1::AgentMessage again = hello;
    again.mutable_hello()->clear_join_token();
    again.mutable_hello()->clear_certificate_request();
    again.mutable_hello()->set_host_id(admitted_.host_id());
    again.mutable_hello()->set_host_secret(admitted_.host_secret());
    if (!stream_->Write(again) || !stream_->Read(&answer)) throw local::CommandError("the host was not let in again");
  }
  ~AttackingHost() {
    context_.TryCancel();
    if (stream_) (void)End();
  }
  AttackingHost(const AttackingHost&) = delete;
  AttackingHost& operator=(const AttackingHost&) = delete;

  // False: the control plane has ended the stream.
  bool Send(const v1::AgentMessage& message) { return stream_->Write(message); }
  // Once the control plane has ended the stream: why. Nothing can be sent after.
  grpc::Status End() {
    v1::ControlMessage answer;
    while (stream_->Read(&answer)) {
    }
    return std::exchange(stream_, nullptr)->Finish();
  }
  template <class Request>
  Request As(Request request) const {
    request.set_host_id(admitted_.host_id());
    request.set_host_secret(admitted_.host_secret());
    return request;
  }
  v1::AgentLinkService::Stub& stub() { return *stub_; }

 private:
  v1::Admitted admitted_;
  std::unique_ptr<v1::AgentLinkService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>> stream_;
};

v1::Instance GetInstance(const Target& target, const std::string& id) {
  v1::GetInstanceRequest request;
  request.set_id(id);
  v1::GetInstanceResponse response;
  grpc::ClientContext context;
  (void)v1::InstanceService::NewStub(DialAlone(target.socket))->GetInstance(&context, request, &response);
  return response.instance();
}

// Runs `act(i)` for i below `count`, each on a thread of its own.
template <class Act>
void InParallel(int count, const Act& act) {
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) threads.emplace_back([&act, i] { act(i); });
  for (std::thread& thread : threads) thread.join();
}

// About a worker of the instance: that so many players are connected to it.
v1::AgentMessage ReportOf(const v1::Instance& instance, int players) {
  v1::AgentMessage message;
  v1::WorkerReport& report = *message.mutable_report();
  if (instance.region_status_size() > 0) *report.mutable_identity() = instance.region_status(0).report().identity();
  report.mutable_connected_players()->Reserve(players);
  for (int player = 1; player <= players; ++player) {
    report.add_connected_players(static_cast<std::uint32_t>(player % 128));  // a byte each
  }
  return message;
}

void TryFetches(AttackingHost& host, const v1::Instance& instance, Outcome& outcome) {
  v1::FetchSceneRequest scene;
  scene.set_scene_hash(instance.scene_hash());
  v1::FetchSceneResponse got_scene;
  grpc::ClientContext scene_context;
  outcome.Try("the scene of a world elsewhere",
              !host.stub().FetchScene(&scene_context, host.As(scene), &got_scene).ok());
  grpc::ClientContext pieces_context;
  const auto pieces = host.stub().StreamScene(&pieces_context, host.As(scene));
  const bool got_one = pieces->Read(&got_scene);
  outcome.Try("the scene of a world elsewhere, in pieces", !got_one && !pieces->Finish().ok());
  v1::FetchStateRequest state;
  state.set_instance_id(instance.id());
  state.set_region(1);
  grpc::ClientContext state_context;
  const auto reader = host.stub().FetchState(&state_context, host.As(state));
  v1::FetchStateResponse piece;
  const bool got = reader->Read(&piece);
  outcome.Try("the state of a region elsewhere", !got && !reader->Finish().ok());
}

}  // namespace

Outcome CallEveryMethod(const Target& target) {
  Outcome outcome;
  const auto operators = DialAlone(target.operators), players = DialAlone(target.players);
  for (const std::string& method : AllMethodNames()) {
    const grpc::Status at_operators = CallByName(operators, method);
    outcome.Try(fmt::format("operators' door: {} {}", method, at_operators.error_message()), IsRefusal(at_operators));
    if (IsForPlayers(method)) continue;
    const grpc::Status at_players = CallByName(players, method);
    outcome.Try(fmt::format("players' door: {} {}", method, at_players.error_message()), IsRefusal(at_players));
  }
  return outcome;
}

Outcome ShowLongTokens(const Target& target, int streams, std::size_t bytes) {
  v1::AgentMessage hello;
  hello.mutable_hello()->set_join_token(std::string(bytes, 'x'));
  hello.mutable_hello()->set_version(TESSERA_VERSION);
  hello.mutable_hello()->set_advertise_address("127.0.0.1");
  hello.mutable_hello()->mutable_resources()->set_region_capacity(1);
  Outcome outcome;
  std::mutex mutex;
  InParallel(streams, [&](int) {
    grpc::ClientContext context;
    context.set_deadline(Soon());
    const auto stream = v1::AgentLinkService::NewStub(DialAlone(target.operators))->Attach(&context);
    stream->Write(hello);
    v1::ControlMessage answer;
    const bool let_in = stream->Read(&answer);
    const grpc::Status status = stream->Finish();
    const std::lock_guard lock(mutex);
    outcome.Try("a long token: " + status.error_message(), !let_in && IsRefusal(status));
  });
  return outcome;
}

Outcome AskAtLength(const Target& target, int calls, std::size_t bytes) {
  struct Asked {
    std::string door, method;
  };
  const std::vector<Asked> all = {{target.operators, kHealthCheck},
                                  {target.operators, "/tessera.v1.InstanceService/CreateInstance"},
                                  {target.players, kHealthCheck},
                                  {target.players, "/tessera.v1.SessionService/JoinInstance"}};
  Outcome outcome;
  std::mutex mutex;
  InParallel(calls, [&](int i) {
    const Asked& asked = all[static_cast<std::size_t>(i) % all.size()];
    const grpc::Status status = CallByName(DialAlone(asked.door), asked.method, bytes);
    const std::lock_guard lock(mutex);
    outcome.Try("a long request: " + asked.method + " " + status.error_message(),
                IsRefusal(status) || status.error_code() == StatusCode::RESOURCE_EXHAUSTED ||
                    status.error_code() == StatusCode::UNAVAILABLE);
  });
  return outcome;
}

Outcome SayNothing(const Target& target, int streams) {
  Outcome outcome;
  const auto stub = v1::AgentLinkService::NewStub(DialAlone(target.operators));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>>> open;
  for (int i = 0; i < streams; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    contexts.back()->set_deadline(Soon());
    open.push_back(stub->Attach(contexts.back().get()));
  }
  // Meanwhile others are served; and the control plane ends each by itself, before our own patience does.
  outcome.Try("an operator waits", OperatorsCallSeconds(target) >= 0);
  for (auto& stream : open) {
    v1::ControlMessage answer;
    while (stream->Read(&answer)) {
    }
    const grpc::Status status = stream->Finish();
    outcome.Try("a stream stays: " + status.error_message(), status.error_code() != StatusCode::DEADLINE_EXCEEDED);
  }
  return outcome;
}

Outcome ImportAsStranger(const Target& target, int imports, std::size_t bytes) {
  Outcome outcome;
  std::mutex mutex;
  InParallel(imports, [&](int) {
    grpc::ClientContext context;
    context.set_deadline(Soon());
    v1::ImportCheckpointResponse response;
    const auto writer =
        v1::InstanceService::NewStub(DialAlone(target.operators))->ImportCheckpoint(&context, &response);
    v1::ImportCheckpointRequest piece;
    piece.set_data(std::string(kPieceBytes, 'x'));
    std::size_t sent = 0;
    while (sent < bytes && writer->Write(piece)) sent += kPieceBytes;
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    const std::lock_guard lock(mutex);
    outcome.Try("an import: " + status.error_message(), IsRefusal(status));
    outcome.Try(fmt::format("{} MiB of an import were read", sent >> 20), sent < bytes);
  });
  return outcome;
}

Outcome SpeakPlainText(const Target& target) {
  Outcome outcome;
  for (const std::string& door : {target.operators, target.players}) {
    const auto channel = grpc::CreateChannel(door.substr(0, door.find('#')), grpc::InsecureChannelCredentials());
    const grpc::Status status = CallByName(channel, "/tessera.v1.InstanceService/ListInstances");
    outcome.Try("plain text: " + door, status.error_code() == StatusCode::UNAVAILABLE);
  }
  return outcome;
}

Outcome JoinAndLeave(const Target& target, const std::string& instance, int threads, int times_each) {
  Outcome outcome;
  std::atomic<int> joined = 0, left = 0;
  InParallel(threads, [&](int) {
    const auto stub = v1::SessionService::NewStub(DialAlone(target.players));
    for (int i = 0; i < times_each; ++i) {
      v1::JoinInstanceRequest join;
      join.set_instance_id(instance);
      v1::JoinInstanceResponse grant;
      grpc::ClientContext context;
      context.set_deadline(Soon());
      if (!stub->JoinInstance(&context, join, &grant).ok()) continue;
      ++joined;
      v1::LeaveInstanceRequest leave;
      leave.set_instance_id(instance);
      leave.set_credential(grant.credential());
      leave.set_credential_key(grant.credential_key());
      v1::LeaveInstanceResponse gone;
      grpc::ClientContext other;
      other.set_deadline(Soon());
      left += stub->LeaveInstance(&other, leave, &gone).ok() ? 1 : 0;
    }
  });
  outcome.Try(kNobodyJoined, joined > 0);
  outcome.Try(fmt::format("{} of {} who joined could not leave", joined - left, joined.load()), joined == left);
  const v1::Instance now = GetInstance(target, instance);
  outcome.Try(fmt::format("{} players are left in the world", now.players()), now.players() == 0);
  outcome.Try("the world ended", now.state() == v1::INSTANCE_STATE_RUNNING);
  return outcome;
}

Outcome LieAsHost(const Target& target, const std::string& instance) {
  Outcome outcome;
  const v1::Instance before = GetInstance(target, instance);
  {
    AttackingHost host(target, "liar", 4'000'000'000U);
    TryFetches(host, before, outcome);
    // Each region of the world is said to have ended, by a host that runs none of them.
    for (const v1::RegionStatus& region : before.region_status()) {
      v1::AgentMessage ended;
      *ended.mutable_exited()->mutable_identity() = region.report().identity();
      ended.mutable_exited()->set_signal(9);
      ended.mutable_exited()->set_started(true);
      host.Send(ended);
    }
  }
  {
    AttackingHost host(target, "counter", 1);
    host.Send(ReportOf(before, kInventedPlayers));
    outcome.Try("16 million players are taken", host.End().error_code() == StatusCode::RESOURCE_EXHAUSTED);
  }
  {
    AttackingHost host(target, "braggart", 1);
    host.Send(ReportOf(before, kBoastedPlayers));
    // The control plane takes messages in turn, so it has judged the report once it answers for its successor.
    v1::AgentMessage heartbeat;
    heartbeat.mutable_heartbeat();
    outcome.Try("a host that lies keeps others waiting", host.Send(heartbeat) && OperatorsCallSeconds(target) >= 0);
    const v1::Instance believed = GetInstance(target, instance);
    for (const v1::RegionStatus& region : believed.region_status()) {
      outcome.Try("a million players are believed", region.report().connected_players_size() < 10'000);
    }
  }
  {
    // 32 MB on the wire, gigabytes once they are parsed.
    AttackingHost host(target, "hollow", 1);
    std::string reports;
    reports.reserve(2 * kHollowReports);
    constexpr char kEmptyReport[] = {v1::AgentHeartbeat::kWorkersFieldNumber << 3 | 2, 0};
    for (int i = 0; i < kHollowReports; ++i) reports.append(kEmptyReport, sizeof kEmptyReport);
    v1::AgentMessage hollow;
    hollow.GetReflection()->MutableUnknownFields(&hollow)->AddLengthDelimited(v1::AgentMessage::kHeartbeatFieldNumber,
                                                                              reports);
    host.Send(hollow);
    outcome.Try("16 million reports of nothing are taken", host.End().error_code() == StatusCode::RESOURCE_EXHAUSTED);
  }
  const v1::Instance after = GetInstance(target, instance);
  outcome.Try("a region of another host was declared dead",
              after.state() == before.state() && after.failovers() == before.failovers());
  return outcome;
}

Outcome NeverRead(const Target& target, int requests) {
  Outcome outcome;
  AttackingHost host(target, "deaf", 1);
  v1::AgentMessage lease;
  lease.mutable_lease()->mutable_identity()->set_instance_id("inst-1");
  lease.mutable_lease()->mutable_identity()->set_region(1);
  lease.mutable_lease()->mutable_identity()->set_incarnation(1);
  for (int i = 0; i < requests; ++i) {
    lease.mutable_lease()->set_number(static_cast<std::uint64_t>(i));
    if (!host.Send(lease)) break;
  }
  outcome.Try("an operator waits", OperatorsCallSeconds(target) >= 0);
  return outcome;
}

double OperatorsCallSeconds(const Target& target) {
  v1::ListHostsResponse response;
  grpc::ClientContext context;
  context.set_deadline(Soon());
  const auto stub = v1::HostService::NewStub(DialAlone(target.socket));
  const auto begin = std::chrono::steady_clock::now();
  if (!stub->ListHosts(&context, {}, &response).ok()) return -1;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

double ResidentMegabytes(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/statm", pid));
  std::uint64_t whole = 0, resident = 0;
  file >> whole >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

bool ForgetHighest(pid_t pid) {
  std::ofstream file(fmt::format("/proc/{}/clear_refs", pid));
  file << "5" << std::flush;
  return file.good();
}

double HighestMegabytes(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(file, line);) {
    constexpr std::string_view kName = "VmHWM:";
    if (line.starts_with(kName)) return std::stod(line.substr(kName.size())) * 1024 / 1e6;
  }
  return 0;
}

}  // namespace tessera::support

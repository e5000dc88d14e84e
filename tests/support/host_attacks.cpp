// Attacks of a host with a valid certificate.
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "local_cluster/command_error.h"
#include "tessera/v1/agent_link.grpc.pb.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tessera/v1/instance.grpc.pb.h"
#include "tests/support/attack_calls.h"
#include "tests/support/attacks.h"
#include "trust/certificate.h"
#include "trust/ticket.h"

namespace tessera::support {
namespace {

using grpc::StatusCode;

constexpr int kInventedPlayers = 16'000'000, kBoastedPlayers = 1'000'000, kHollowReports = 16'000'000;
constexpr std::uint32_t kBoastedPlaces = 4'000'000'000;
// A host is believed to have 64 places unless it was added with more; the cluster's own has a few beside.
constexpr std::uint32_t kRegionsWithin = 60, kRegionsBeyond = 100;
constexpr std::uint32_t kDeafPlaces = 8;
constexpr int kLeasesBetweenHeartbeats = 1000;

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
    context_.set_deadline(Soon() + 2 * kAttackPatience);
    stream_ = stub_->Attach(&context_);
    again_ = hello;
    again_.mutable_hello()->clear_join_token();
    again_.mutable_hello()->clear_certificate_request();
    again_.mutable_hello()->set_host_id(admitted_.host_id());
    again_.mutable_hello()->set_host_secret(admitted_.host_secret());
    if (!stream_->Write(again_) || !stream_->Read(&answer)) throw local::CommandError("the host was not let in again");
  }
  ~AttackingHost() {
    context_.TryCancel();
    if (stream_) (void)End();
  }
  AttackingHost(const AttackingHost&) = delete;
  AttackingHost& operator=(const AttackingHost&) = delete;

  // False: the control plane has ended the stream.
  bool Send(const v1::AgentMessage& message) { return stream_->Write(message); }
  // The next message of the control plane for which it holds; none: the stream has ended.
  template <class Holds>
  std::optional<v1::ControlMessage> Await(const Holds& holds) {
    v1::ControlMessage answer;
    while (stream_->Read(&answer)) {
      if (holds(answer)) return answer;
    }
    return std::nullopt;
  }
  // Once the control plane has ended the stream: why. Nothing can be sent after.
  grpc::Status End() {
    v1::ControlMessage answer;
    while (stream_->Read(&answer)) {
    }
    return std::exchange(stream_, nullptr)->Finish();
  }
  // Messages are taken in turn, and a second hello ends a stream: whether all that was sent before it was judged.
  bool WasHeardOut() { return Send(again_) && End().error_code() == StatusCode::INVALID_ARGUMENT; }
  template <class Request>
  Request As(Request request) const {
    request.set_host_id(admitted_.host_id());
    request.set_host_secret(admitted_.host_secret());
    return request;
  }
  const std::string& id() const { return admitted_.host_id(); }
  v1::AgentLinkService::Stub& stub() { return *stub_; }

 private:
  v1::Admitted admitted_;
  v1::AgentMessage again_;
  std::unique_ptr<v1::AgentLinkService::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::AgentMessage, v1::ControlMessage>> stream_;
};

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
  v1::FetchGameRequest game;
  game.set_game_hash(instance.game_hash());
  v1::FetchGameResponse got_game;
  grpc::ClientContext game_context;
  outcome.Try("the game of a world elsewhere", !host.stub().FetchGame(&game_context, host.As(game), &got_game).ok());
  v1::UploadCheckpointRequest upload;
  upload.mutable_identity()->set_instance_id(instance.id());
  upload.mutable_identity()->set_region(1);
  upload.set_size(1);
  upload.set_data("x");
  v1::UploadCheckpointResponse taken;
  grpc::ClientContext upload_context;
  const auto writer = host.stub().UploadCheckpoint(&upload_context, &taken);
  writer->WriteLast(host.As(upload), {});
  outcome.Try("a checkpoint of a region elsewhere", !writer->Finish().ok());
}

// The control plane's answer to the wish for a world of the same scene with so many regions.
grpc::Status Create(const Target& target, const v1::Instance& like, std::uint32_t regions, bool validate_only,
                    v1::CreateInstanceResponse& response) {
  v1::CreateInstanceRequest request;
  request.mutable_spec()->set_scene_file(like.scene_hash());
  request.mutable_spec()->set_regions(regions);
  request.set_validate_only(validate_only);
  grpc::ClientContext context;
  context.set_deadline(Soon());
  return v1::InstanceService::NewStub(DialAlone(target.socket))->CreateInstance(&context, request, &response);
}

// Some are believed, so a wish for some is granted, and one for more is not.
void TryCapacity(const Target& target, const v1::Instance& like, Outcome& outcome) {
  v1::CreateInstanceResponse ignored;
  const grpc::Status within = Create(target, like, kRegionsWithin, true, ignored);
  outcome.Try("no place is believed: " + within.error_message(), within.ok());
  const grpc::Status beyond = Create(target, like, kRegionsBeyond, true, ignored);
  outcome.Try("four billion places are believed: " + beyond.error_message(),
              beyond.error_code() == StatusCode::RESOURCE_EXHAUSTED);
}

// Each region of the world is said to have ended, and its first to be a process of another key.
void LieAboutWorkers(AttackingHost& host, const v1::Instance& instance) {
  v1::AgentMessage taken_over;
  if (instance.region_status_size() > 0) *taken_over.mutable_report() = instance.region_status(0).report();
  const trust::TicketPublicKey key = trust::PublicKeyOf({1});
  taken_over.mutable_report()->set_public_key(key.data(), key.size());
  host.Send(taken_over);
  for (const v1::RegionStatus& region : instance.region_status()) {
    v1::AgentMessage ended;
    *ended.mutable_exited()->mutable_identity() = region.report().identity();
    ended.mutable_exited()->set_signal(9);
    ended.mutable_exited()->set_started(true);
    host.Send(ended);
  }
}

std::string KeyOfFirst(const v1::Instance& instance) {
  return instance.region_status_size() > 0 ? instance.region_status(0).report().public_key() : "";
}

}  // namespace

Outcome LieAsHost(const Target& target, const std::string& instance) {
  Outcome outcome;
  const v1::Instance before = GetInstance(target, instance);
  {
    AttackingHost host(target, "liar", kBoastedPlaces);
    TryFetches(host, before, outcome);
    TryCapacity(target, before, outcome);
    LieAboutWorkers(host, before);
    outcome.Try("a host that lies is not heard out", host.WasHeardOut());
    const std::string key = KeyOfFirst(before);
    outcome.Try("a region of another host has another key",
                !key.empty() && KeyOfFirst(GetInstance(target, instance)) == key);
  }
  {
    AttackingHost host(target, "counter", 1);
    host.Send(ReportOf(before, kInventedPlayers));
    outcome.Try("16 million players are taken", host.End().error_code() == StatusCode::RESOURCE_EXHAUSTED);
  }
  {
    AttackingHost host(target, "braggart", 1);
    host.Send(ReportOf(before, kBoastedPlayers));
    outcome.Try("a host that boasts is not heard out", host.WasHeardOut());
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

Outcome NeverRead(const Target& target, const std::string& instance, int requests) {
  Outcome outcome;
  AttackingHost host(target, "deaf", kDeafPlaces);
  // Two hosts with room share a world, and one with room has all of it: some region is placed here either way.
  v1::CreateInstanceResponse made;
  const grpc::Status created = Create(target, GetInstance(target, instance), 2, false, made);
  outcome.Try("no world was made: " + created.error_message(), created.ok());
  const auto desired =
      host.Await([](const v1::ControlMessage& message) { return message.desired().workers_size() > 0; });
  outcome.Try("no region was placed on the deaf host", desired.has_value());
  if (!desired) return outcome;
  v1::AgentMessage lease, heartbeat;
  heartbeat.mutable_heartbeat();
  v1::WorkerIdentity& worker = *lease.mutable_lease()->mutable_identity();
  worker.set_instance_id(desired->desired().workers(0).instance_id());
  worker.set_region(desired->desired().workers(0).region());
  worker.set_incarnation(desired->desired().workers(0).incarnation());
  bool heard = true;
  for (int i = 1; i <= requests && heard; ++i) {
    lease.mutable_lease()->set_number(static_cast<std::uint64_t>(i));
    heard = host.Send(lease) && (i % kLeasesBetweenHeartbeats != 0 || host.Send(heartbeat));
  }
  outcome.Try("an operator waits", OperatorsCallSeconds(target) >= 0);
  // They were answered, so answers piled up; the newest of them is there in place of all that had no room.
  const auto newest = host.Await([&](const v1::ControlMessage& message) {
    return message.lease().number() == static_cast<std::uint64_t>(requests);
  });
  outcome.Try("its leases were not answered", heard && newest.has_value());
  v1::DeleteInstanceRequest remove;
  remove.set_id(made.instance().id());
  v1::DeleteInstanceResponse removed;
  grpc::ClientContext context;
  (void)v1::InstanceService::NewStub(DialAlone(target.socket))->DeleteInstance(&context, remove, &removed);
  return outcome;
}

}  // namespace tessera::support

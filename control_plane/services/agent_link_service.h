// AgentLinkServiceImpl: AgentLinkService at one door: agents' streams, and what agents fetch and upload.
// Thread rule: as Answerer; a stream takes two threads for as long as it stands.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "absl/strings/str_cat.h"
#include "control_plane/agent_pace.h"
#include "control_plane/cluster/host_rights.h"
#include "control_plane/cluster/hosts.h"
#include "control_plane/services/answerer.h"
#include "control_plane/stored_records.h"
#include "control_plane/stream_deadlines.h"
#include "telemetry/log_throttle.h"
#include "telemetry/log_value.h"
#include "tessera/v1/agent_link.grpc.pb.h"

namespace tessera::control {

// An agent says who it is at once; whoever says nothing holds a thread. Those count that have shown a join token and no
// certificate yet.
inline constexpr std::chrono::seconds kHelloPatience{10};
inline constexpr std::size_t kMaxSilentStreams = 64;
// Most that an agent's message may take once it is parsed: the reports of all workers of a host, and in a failover or
// after a restore the bodies of a region, or the orders of 64 regions with ten thousand players each.
inline std::size_t AgentMessageMemory(int field) {
  constexpr std::size_t kReports = std::size_t{32} << 20, kBodiesOrOrders = std::size_t{128} << 20;
  return field == v1::AgentMessage::kInventoryFieldNumber || field == v1::AgentMessage::kHeldOrdersFieldNumber
             ? kBodiesOrOrders
             : kReports;
}

class AgentLinkServiceImpl final : public v1::AgentLinkService::Service, Answerer {
 public:
  using Answerer::Answerer;
  // An agent's messages come as bytes, which are measured before they are parsed.
  using Stream = grpc::ServerReaderWriter<v1::ControlMessage, grpc::ByteBuffer>;
  using Reader = BoundedReader<v1::AgentMessage>;

  StreamHandlers Streams() {
    StreamHandlers streams;
    streams["Attach"] = std::make_unique<
        grpc::internal::BidiStreamingHandler<AgentLinkServiceImpl, grpc::ByteBuffer, v1::ControlMessage>>(
        [](AgentLinkServiceImpl* service, grpc::ServerContext* context, Stream* stream) {
          return ToGrpc(service->Receive(context, stream));
        },
        this);
    streams["UploadCheckpoint"] = ClientStream(this, &AgentLinkServiceImpl::ReceiveUpload);
    return streams;
  }

  grpc::Status FetchScene(grpc::ServerContext* context, const v1::FetchSceneRequest* request,
                          v1::FetchSceneResponse* response) override {
    return Answer(
        context, "AgentLinkService/FetchScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
          const absl::Status may = CheckMayFetch(*context, *request, SceneKey(request->scene_hash()), "scene_hash");
          return may.ok() ? Take(plane_.SceneBytes(request->scene_hash()), response->mutable_scene()) : may;
        });
  }
  grpc::Status StreamScene(grpc::ServerContext* context, const v1::FetchSceneRequest* request,
                           grpc::ServerWriter<v1::FetchSceneResponse>* writer) override {
    return Answer(
        context, "AgentLinkService/StreamScene", CallKind::kRead, request->scene_hash(), [&]() -> absl::Status {
          const absl::Status may = CheckMayFetch(*context, *request, SceneKey(request->scene_hash()), "scene_hash");
          if (!may.ok()) return may;
          const auto bytes = plane_.SceneBytes(request->scene_hash());
          return bytes.ok() ? SendScene(*bytes, *writer) : bytes.status();
        });
  }
  grpc::Status FetchGame(grpc::ServerContext* context, const v1::FetchGameRequest* request,
                         v1::FetchGameResponse* response) override {
    return Answer(context, "AgentLinkService/FetchGame", CallKind::kRead, request->game_hash(), [&]() -> absl::Status {
      const absl::Status may = CheckMayFetch(*context, *request, GameKey(request->game_hash()), "game_hash");
      return may.ok() ? Take(plane_.GameBytes(request->game_hash()), response->mutable_game()) : may;
    });
  }
  grpc::Status FetchState(grpc::ServerContext* context, const v1::FetchStateRequest* request,
                          grpc::ServerWriter<v1::FetchStateResponse>* writer) override {
    const std::string subject = absl::StrCat(request->instance_id(), "/", request->region(), " tick ", request->tick());
    return Answer(context, "AgentLinkService/FetchState", CallKind::kRead, subject, [&]() -> absl::Status {
      if (absl::Status status = CheckHostOf(*context, request->host_id()); !status.ok()) return status;
      const auto bytes = plane_.StateFile(*request);
      if (!bytes.ok()) return bytes.status();
      return SendPieces(*bytes, *writer);
    });
  }
  grpc::Status ReceiveUpload(grpc::ServerContext* context, grpc::ServerReader<grpc::ByteBuffer>* stream,
                             v1::UploadCheckpointResponse*) {
    static constexpr char kMethod[] = "AgentLinkService/UploadCheckpoint";
    return Answer(context, kMethod, CallKind::kRead, "", [&]() -> absl::Status {
      auto reader = PiecesOf<v1::UploadCheckpointRequest>(*context, *stream, kMethod);
      v1::UploadCheckpointRequest first;
      const auto wanted = [&](const v1::UploadCheckpointRequest& request) -> absl::StatusOr<std::uint64_t> {
        if (absl::Status status = CheckHostOf(*context, request.host_id()); !status.ok()) return status;
        const absl::Status status =
            plane_.Call([&](Cluster& cluster, Now now) { return cluster.CheckUpload(now, request); });
        if (!status.ok()) return status;
        return std::min<std::uint64_t>(request.size(), kMaxStateBytes);
      };
      const auto draft = ReadPieces(reader, plane_, first, wanted);
      if (!draft.ok()) return draft.status();
      return plane_.TakeUpload(first, *draft);
    });
  }

 private:
  // The certificate that a call shows must be of the host in whose name it is made; at the socket its secret suffices.
  absl::Status CheckHostOf(const grpc::ServerContext& context, const std::string& host_id) const {
    if (door_ == Door::kSocket || (!host_id.empty() && CallerOf(context).host_id == host_id)) return absl::OkStatus();
    return absl::UnauthenticatedError(absl::StrCat("host_id: the call shows no certificate of ",
                                                   host_id.empty() ? "a host" : OneLine(host_id, kMaxNameBytes)));
  }
  template <class Request>
  absl::Status CheckMayFetch(const grpc::ServerContext& context, const Request& request, const std::string& key,
                             const char* field) {
    if (absl::Status status = CheckHostOf(context, request.host_id()); !status.ok()) return status;
    return plane_.Call([&](Cluster& cluster, Now) {
      const ClusterState& state = cluster.state();
      const absl::Status known = CheckHostSecret(state, request.host_id(), request.host_secret());
      return known.ok() ? CheckMayFetchContent(state, request.host_id(), key, field) : known;
    });
  }

  // A stream from its hello to its end.
  absl::Status Receive(grpc::ServerContext* context, Stream* stream) {
    Reader reader(*stream, StreamMessageLimit("AgentLinkService/Attach"), AgentMessageMemory);
    v1::AgentMessage first;
    if (absl::Status status = ReadHello(context, reader, first); !status.ok()) return status;
    bool is_attached = false;
    absl::Status status = Serve(context, stream, reader, first, is_attached);
    if (is_attached) {
      spdlog::info("agent gone from={} result={}{}", context->peer(), absl::StatusCodeToString(status.code()),
                   status.ok() ? "" : " error=" + telemetry::LogValue(std::string(status.message())));
    } else if (const auto left_out = strangers_.Take(telemetry::LogThrottle::Clock::now())) {
      spdlog::warn("agent refused from={} result={} error={} more={}", context->peer(),
                   absl::StatusCodeToString(status.code()), telemetry::LogValue(std::string(status.message())),
                   *left_out);
    }
    return status;
  }

  // Those who have not joined yet are few at a time, and do not keep out who has.
  absl::Status ReadHello(grpc::ServerContext* context, Reader& reader, v1::AgentMessage& first) {
    std::unique_ptr<StreamDeadlines::Waiting> waiting;
    if (door_ != Door::kSocket && CallerOf(*context).host_id.empty()) {
      waiting = hellos_.Begin([context] { context->TryCancel(); });
      if (!waiting) return absl::ResourceExhaustedError("too many streams have not said who they are; try again");
    }
    const bool came = reader.Read(&first);
    if (waiting && !waiting->End()) return absl::DeadlineExceededError("no hello came in time");
    if (!reader.status().ok()) return reader.status();
    return came ? absl::OkStatus() : absl::CancelledError("no hello came");
  }

  // A host that joins by TLS asks for its certificate with the token; one that has joined shows it, and may ask for the
  // next one.
  absl::Status CheckProof(const grpc::ServerContext& context, const v1::AgentHello& hello) const {
    if (door_ == Door::kSocket) {
      return hello.certificate_request().empty()
                 ? absl::OkStatus()
                 : absl::InvalidArgumentError("hello.certificate_request: over a socket there are no certificates");
    }
    if (hello.join_token().empty()) {
      const absl::Status shown = CheckHostOf(context, hello.host_id());
      return !shown.ok() || hello.certificate_request().empty() ? shown
                                                                : trust::CheckRequest(hello.certificate_request());
    }
    if (hello.certificate_request().empty()) {
      return absl::InvalidArgumentError("hello.certificate_request: a host that joins by TLS needs a certificate");
    }
    return trust::CheckRequest(hello.certificate_request());
  }

  absl::Status AddCertificate(const v1::AgentHello& hello, const ControlPlane::AgentStream& agent,
                              v1::Admitted& admitted) const {
    if (agent.certificate_serial.empty()) return absl::OkStatus();
    auto certificate = trust::IssueClient(authority_->signer, hello.certificate_request(), admitted.host_id(),
                                          agent.certificate_serial);
    if (!certificate.ok()) return certificate.status();
    admitted.set_certificate(*std::move(certificate));
    admitted.set_authority(authority_->signer.certificate);
    return absl::OkStatus();
  }

  absl::Status Serve(grpc::ServerContext* context, Stream* stream, Reader& reader, const v1::AgentMessage& first,
                     bool& is_attached) {
    if (!first.has_hello()) return absl::InvalidArgumentError("hello: must be the first message of a stream");
    if (absl::Status status = CheckHello(first.hello()); !status.ok()) return status;
    if (absl::Status status = CheckProof(*context, first.hello()); !status.ok()) return status;
    const std::string serial = door_ == Door::kOperators ? ShownSerial(*context) : "";
    const auto attached = plane_.Attach(
        first.hello(), [context] { context->TryCancel(); }, serial);
    if (!attached.ok()) return attached.status();
    is_attached = true;
    ControlPlane::AgentStream& agent = **attached;
    spdlog::info("agent attached host={} id={} from={} address={} workers={}", agent.admitted.host_name(),
                 agent.admitted.host_id(), context->peer(), telemetry::LogValue(first.hello().advertise_address()),
                 first.hello().workers_size());
    v1::ControlMessage admitted;
    *admitted.mutable_admitted() = agent.admitted;
    absl::Status status = AddCertificate(first.hello(), agent, *admitted.mutable_admitted());
    if (status.ok() && stream->Write(admitted)) {
      std::thread writer([&] { WriteDesired(stream, agent); });
      status = ReadMessages(reader, agent);
      plane_.Detach(agent);
      writer.join();
    } else {
      plane_.Detach(agent);
    }
    return status;
  }
  void WriteDesired(Stream* stream, ControlPlane::AgentStream& agent) {
    while (const std::optional<v1::ControlMessage> message = plane_.NextMessage(agent)) {
      if (message->has_desired()) {
        spdlog::debug("desired set host={} revision={} workers={}", agent.admitted.host_name(),
                      message->desired().revision(), message->desired().workers_size());
      }
      if (!stream->Write(*message)) return;
    }
  }
  absl::Status ReadMessages(Reader& reader, ControlPlane::AgentStream& agent) {
    AgentPace pace(std::chrono::steady_clock::now());
    v1::AgentMessage message;
    while (reader.Read(&message)) {
      if (absl::Status status = plane_.HandleAgentMessage(agent, message); !status.ok()) return status;
      const auto now = std::chrono::steady_clock::now();
      const auto pause = pace.Pause(now, reader.bytes());
      if (pause.count() == 0) continue;
      if (const auto left_out = slowed_.Take(now)) {
        spdlog::warn("agent says more than is read host={} more={}", agent.admitted.host_name(), *left_out);
      }
      std::this_thread::sleep_for(pause);
    }
    return reader.status();
  }

  telemetry::LogThrottle slowed_;
  StreamDeadlines hellos_{kHelloPatience, kMaxSilentStreams};
};

}  // namespace tessera::control

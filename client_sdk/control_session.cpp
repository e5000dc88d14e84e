#include "client_sdk/control_session.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "absl/strings/str_cat.h"
#include "core/world/partition_io.h"
#include "core/world/scene_load.h"
#include "core/world/viewer_number.h"
#include "tessera/v1/session.grpc.pb.h"
#include "trust/dial.h"

namespace tessera::client {
namespace {

using Stub = v1::SessionService::Stub;
using Deadline = std::chrono::system_clock::time_point;

constexpr std::uint32_t kMaxRateHz = 1000;

struct SceneCache {
  std::mutex mutex;
  std::map<std::string, std::shared_ptr<const Scene>> scenes;  // by hash
};

SceneCache& Scenes() {
  static SceneCache cache;
  return cache;
}

absl::StatusOr<std::unique_ptr<Stub>> DialSessions(const std::string& address, const trust::Credentials& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(static_cast<int>(kMaxSceneBytes));
  const auto channel = trust::Dial(address, credentials, arguments);
  if (!channel.ok())
    return absl::Status(channel.status().code(), absl::StrCat("control plane at ", channel.status().message()));
  return v1::SessionService::NewStub(*channel);
}

// gRPC's codes are Abseil's.
absl::Status ToStatus(const grpc::Status& status, const std::string& address, const std::string& instance_id) {
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  switch (code) {
    case absl::StatusCode::kNotFound:
      return absl::NotFoundError(absl::StrCat("instance ", instance_id, ": no such instance"));
    case absl::StatusCode::kUnavailable:
      return absl::UnavailableError(absl::StrCat("control plane at ", address, ": ", status.error_message()));
    case absl::StatusCode::kDeadlineExceeded:
      return absl::DeadlineExceededError(absl::StrCat("instance ", instance_id, ": no answer from ", address));
    default:
      return {code, absl::StrCat("instance ", instance_id, ": ", status.error_message())};
  }
}

absl::Status BadAnswer(const std::string& what) {
  return absl::InternalError(absl::StrCat("the control plane's answer: ", what));
}

// The serialised scene, in pieces; from a control plane of an earlier release in one message.
grpc::Status GetSceneBytes(Stub& stub, const v1::GetSceneRequest& request, Deadline deadline, std::string& bytes) {
  {
    grpc::ClientContext context;
    context.set_deadline(deadline);
    const auto stream = stub.StreamScene(&context, request);
    v1::GetSceneResponse piece;
    bool too_large = false;
    while (!too_large && stream->Read(&piece)) {
      bytes += piece.scene();
      too_large = bytes.size() > kMaxSceneBytes;
    }
    if (too_large) context.TryCancel();
    grpc::Status status = stream->Finish();
    if (too_large) {
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, absl::StrCat("scene: has more than ", kMaxSceneBytes, " bytes")};
    }
    if (status.error_code() != grpc::StatusCode::UNIMPLEMENTED) return status;
  }
  grpc::ClientContext context;
  context.set_deadline(deadline);
  v1::GetSceneResponse response;
  grpc::Status status = stub.GetScene(&context, request, &response);
  if (status.ok()) bytes = std::move(*response.mutable_scene());
  return status;
}

absl::StatusOr<std::shared_ptr<const Scene>> FetchScene(Stub& stub, const std::string& hash, Deadline deadline,
                                                        const std::string& address, const std::string& instance_id) {
  {
    const std::lock_guard lock(Scenes().mutex);
    if (const auto found = Scenes().scenes.find(hash); found != Scenes().scenes.end()) return found->second;
  }
  v1::GetSceneRequest request;
  request.set_scene_hash(hash);
  std::string bytes;
  if (const grpc::Status status = GetSceneBytes(stub, request, deadline, bytes); !status.ok()) {
    if (status.error_code() == grpc::StatusCode::NOT_FOUND)
      return BadAnswer(absl::StrCat("scene: none has hash ", hash));
    return ToStatus(status, address, instance_id);
  }
  absl::StatusOr<LoadedScene> loaded =
      LoadScene(SceneForm::kSerialised, bytes, "scene", {.scatter_count = {}, .hash = hash});
  if (!loaded.ok()) return BadAnswer(std::string(loaded.status().message()));
  const std::lock_guard lock(Scenes().mutex);
  Scenes().scenes.emplace(hash, loaded->scene);
  return std::move(loaded->scene);
}

absl::StatusOr<net::Credentials> CredentialsFrom(const v1::JoinInstanceResponse& response,
                                                 const std::string& instance_id) {
  const auto key = net::SigningKey::FromSeed(response.credential_key(), "credential_key");
  if (!key.ok()) return key.status();
  const auto instance_key = net::VerificationKeyFrom(response.instance_key(), "instance_key");
  if (!instance_key.ok()) return instance_key.status();
  const std::string& credential = response.credential();
  if (credential.size() > net::kMaxCredentialBytes) {
    return absl::InvalidArgumentError(absl::StrCat("credential: has ", credential.size(), " bytes"));
  }
  return net::Credentials{.instance_id = instance_id,
                          .statement = {credential.begin(), credential.end()},
                          .key = *key,
                          .instance_key = *instance_key};
}

absl::Status TakeRegions(const v1::JoinInstanceResponse& response, Session& session) {
  for (const v1::RegionAddress& address : response.regions()) {
    auto endpoint = EndpointFrom(address.region(), address.host(), address.game_port(), address.incarnation());
    if (!endpoint.ok()) return BadAnswer(absl::StrCat("regions: ", endpoint.status().message()));
    session.regions.push_back(*std::move(endpoint));
  }
  std::sort(session.regions.begin(), session.regions.end(),
            [](const RegionEndpoint& a, const RegionEndpoint& b) { return a.region < b.region; });
  const bool same = std::equal(session.regions.begin(), session.regions.end(), session.map.regions().begin(),
                               session.map.regions().end(),
                               [](const RegionEndpoint& a, const MapRegion& b) { return a.region == b.id; });
  return same ? absl::OkStatus() : BadAnswer("regions: not those of the map");
}

}  // namespace

absl::StatusOr<Session> JoinInstance(const trust::ControlPoint& control, const JoinCall& call) {
  const auto& [instance_id, player_name, ticket, returning, watch, deadline] = call;
  if (!ticket.empty() && !player_name.empty()) {
    return absl::InvalidArgumentError("player_name: the ticket says the name; leave it empty");
  }
  if (!ticket.empty() && !returning.empty()) {
    return absl::InvalidArgumentError("returning: the ticket says who comes back; leave it empty");
  }
  const Deadline until = std::chrono::system_clock::now() + deadline;
  const std::string& control_address = control.address;
  const auto dialled = DialSessions(control_address, control.credentials);
  if (!dialled.ok()) return dialled.status();
  Stub* stub = dialled->get();
  grpc::ClientContext context;
  context.set_deadline(until);
  v1::JoinInstanceRequest request;
  request.set_instance_id(instance_id);
  request.set_player_name(player_name);
  request.set_viewer(watch);
  request.set_ticket(ticket);
  if (!returning.empty()) {
    if (returning.size() <= net::kKeyBytes) return absl::InvalidArgumentError("returning: is no return token");
    const auto key_at = returning.last(net::kKeyBytes);
    request.set_credential(returning.data(), returning.size() - key_at.size());
    request.set_credential_key(key_at.data(), key_at.size());
  }
  v1::JoinInstanceResponse response;
  if (const grpc::Status status = stub->JoinInstance(&context, request, &response); !status.ok()) {
    return ToStatus(status, control_address, instance_id);
  }
  if (response.player() == 0) return BadAnswer("player 0");
  if (IsViewer(PlayerNumber(response.player())) != watch) {
    return BadAnswer(absl::StrCat("player ", response.player(), watch ? ": no viewer" : ": a viewer"));
  }
  if (response.tick_rate_hz() < 1 || response.tick_rate_hz() > kMaxRateHz) return BadAnswer("tick_rate_hz");
  if (response.snapshot_rate_hz() < 1 || response.snapshot_rate_hz() > kMaxRateHz) return BadAnswer("snapshot_rate_hz");
  absl::StatusOr<PartitionMap> map = FromProto(response.map());
  if (!map.ok()) return BadAnswer(absl::StrCat("map: ", map.status().message()));

  absl::StatusOr<net::Credentials> credentials = CredentialsFrom(response, instance_id);
  if (!credentials.ok()) return BadAnswer(std::string(credentials.status().message()));

  Session session{.player = PlayerNumber(response.player()),
                  .credentials = *std::move(credentials),
                  .map = *std::move(map),
                  .regions = {},
                  .scene_hash = response.scene_hash(),
                  .scene = nullptr,
                  .tick_rate_hz = response.tick_rate_hz(),
                  .snapshot_rate_hz = std::min(response.snapshot_rate_hz(), response.tick_rate_hz()),
                  .expected_players = response.expected_players()};
  if (absl::Status status = TakeRegions(response, session); !status.ok()) return status;
  auto scene = FetchScene(*stub, response.scene_hash(), until, control_address, instance_id);
  if (!scene.ok()) return scene.status();
  session.scene = *std::move(scene);
  return session;
}

absl::Status LeaveInstance(const trust::ControlPoint& control, const std::string& instance_id,
                           const net::Credentials& credentials, std::chrono::milliseconds deadline) {
  const auto dialled = DialSessions(control.address, control.credentials);
  if (!dialled.ok()) return dialled.status();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + deadline);
  v1::LeaveInstanceRequest request;
  request.set_instance_id(instance_id);
  request.set_credential(credentials.statement.data(), credentials.statement.size());
  const net::Seed seed = credentials.key.seed();
  request.set_credential_key(seed.data(), seed.size());
  v1::LeaveInstanceResponse response;
  const grpc::Status status = (*dialled)->LeaveInstance(&context, request, &response);
  return status.ok() ? absl::OkStatus() : ToStatus(status, control.address, instance_id);
}

}  // namespace tessera::client

#include "control_plane/doors.h"

#include <grpc/grpc_security_constants.h>
#include <grpc/support/log.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "control_plane/cluster/known_callers.h"
#include "control_plane/control_settings.h"
#include "control_plane/door_limits.h"
#include "control_plane/one_line.h"
#include "host/files.h"
#include "telemetry/log_throttle.h"
#include "telemetry/logging.h"
#include "trust/control_address.h"

namespace tessera::control {
namespace {

constexpr char kPathHeader[] = ":path", kTokenHeader[] = "authorization", kBearer[] = "Bearer ", kJoinToken[] = "tsj_";
constexpr std::size_t kMaxTokenBytes = 256, kMaxLoggedBytes = 128;
// Keepalive: a peer that is silent gets a ping, and is dropped if it does not answer. Ours may ping as often as we do,
// also while no call is open; gRPC's default would drop them after two pings in five minutes.
constexpr int kKeepaliveTimeMs = 10'000, kKeepaliveTimeoutMs = 5'000, kMinPingIntervalMs = 1'000;

grpc::Status Refusal(const absl::Status& status) {
  return {static_cast<grpc::StatusCode>(status.code()), std::string(status.message())};
}

// PEM; empty: none was shown. What the handshake left there is the same for all calls of a connection.
std::string CertificateOf(const grpc::AuthContext& context) {
  const auto values = context.FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  return values.empty() ? "" : std::string(values.front().data(), values.front().size());
}

// The token in the headers of a call; empty: it has none.
template <class Headers>
std::string TokenOf(const Headers& headers) {
  const auto header = headers.find(kTokenHeader);
  if (header == headers.end()) return "";
  const std::string value(header->second.data(), header->second.size());
  return value.starts_with(kBearer) && value.size() <= kMaxTokenBytes ? value.substr(sizeof kBearer - 1) : "";
}

// The caller that shows a token and a certificate at the operators' door. The certificate's authority has been checked;
// whether it still counts is in the store, and an error if not; so is a join token that admits nobody. Any other token
// that proves nothing is none.
absl::StatusOr<Caller> Recognise(const std::string& token, const std::string& certificate, ControlPlane& plane) {
  Caller caller{.door = Door::kOperators, .role = {}, .token = {}, .instances = {}, .host_id = {}};
  const std::shared_ptr<const KnownCallers> known = plane.known_callers();
  const Now now = ControlPlane::ReadClocks();
  if (token.starts_with(kJoinToken)) {
    if (absl::Status shown = known->CheckJoinToken(token, now); !shown.ok()) return shown;
    caller.may_join = true;
  } else if (const records::AccessToken* found = token.empty() ? nullptr : known->FindToken(token, now)) {
    caller.role = found->role();
    caller.token = found->name();
    caller.instances = found->instances();
  }
  if (certificate.empty()) return caller;
  const auto facts = trust::ReadCertificate(certificate);
  if (!facts.ok()) return absl::UnauthenticatedError(facts.status().message());
  if (absl::Status counts = known->CheckCertificate(facts->common_name, facts->serial); !counts.ok()) return counts;
  caller.host_id = facts->common_name;
  return caller;
}

class Doorkeeper final : public grpc::AuthMetadataProcessor {
 public:
  Doorkeeper(Door door, ControlPlane& plane) : door_(door), plane_(plane) {}

  // It reads a certificate, and waits for nobody. Where it says that it blocks, gRPC hands each call to a few threads
  // of its own, which may be asleep for up to a second (docs/decisions/0105-calls-are-judged-where-they-are-read.md).
  bool IsBlocking() const override { return false; }
  // `context` is one for all calls of a connection, so nothing about a call may be written into it.
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata*,
                       OutputMetadata*) override {
    const auto path = metadata.find(kPathHeader);
    if (path == metadata.end()) return Refusal(absl::InternalError("the call has no method"));
    const std::string method(path->second.data(), path->second.size());
    absl::StatusOr<Caller> caller = Caller{.door = door_, .role = {}, .token = {}, .instances = {}, .host_id = {}};
    if (door_ == Door::kOperators) caller = Recognise(TokenOf(metadata), CertificateOf(*context), plane_);
    const absl::Status status = caller.ok() ? CheckAccess(*caller, method) : caller.status();
    if (!status.ok()) {
      LogRefusal(method, caller.ok() ? caller->Name() : "nobody", status);
      return Refusal(status);
    }
    return grpc::Status::OK;
  }

 private:
  // Whoever reaches the port can be refused as often as he likes; the log stays short.
  void LogRefusal(const std::string& method, const std::string& who, const absl::Status& status) {
    const auto left_out = refusals_.Take(telemetry::LogThrottle::Clock::now());
    if (!left_out) return;
    spdlog::warn("refused method={} who={} reason={} more={}", telemetry::LogValue(OneLine(method, kMaxLoggedBytes)),
                 who, telemetry::LogValue(std::string(status.message())), *left_out);
  }

  const Door door_;
  ControlPlane& plane_;
  telemetry::LogThrottle refusals_;
};

absl::Status SocketError(const std::string& path, const std::string& why) {
  return absl::UnavailableError(absl::StrCat("socket ", path, ": ", why));
}

// Whether a process listens there; a socket that nobody listens on refuses.
bool SomebodyListens(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  const int socket_fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket_fd < 0) return false;
  const bool answered = connect(socket_fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(socket_fd);
  return answered;
}

}  // namespace

std::string DoorName(Door door) {
  return door == Door::kSocket ? "socket" : door == Door::kPlayers ? "players" : "operators";
}

TcpDoor::TcpDoor(grpc::ServerBuilder& builder, std::shared_ptr<grpc::ServerCredentials> credentials)
    : acceptor_(builder.experimental().AddExternalConnectionAcceptor(
          grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD, std::move(credentials))) {}

absl::StatusOr<std::unique_ptr<TcpListener>> TcpDoor::Listen(const host::SocketAddress& address, Door door,
                                                             ConnectionLimits limits, ControlMetrics& metrics) const {
  return TcpListener::Listen(address, DoorName(door), limits, metrics, [acceptor = acceptor_](int fd) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = fd;
    acceptor->HandleNewConnection(&connection);
  });
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> UnjudgedTlsCredentials(Door door, const Authority& authority) {
  const auto own = trust::IssueServer(authority.signer, MakeSerial(SystemRandomBytes));
  if (!own.ok()) return own.status();
  grpc::SslServerCredentialsOptions options(door == Door::kOperators ? GRPC_SSL_REQUEST_CLIENT_CERTIFICATE_AND_VERIFY
                                                                     : GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE);
  // The authority goes along, for those that know its fingerprint alone.
  options.pem_key_cert_pairs.push_back({own->key, own->certificate + authority.signer.certificate});
  if (door == Door::kOperators) options.pem_root_certs = authority.signer.certificate;
  return grpc::SslServerCredentials(options);
}

absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> TlsCredentials(Door door, const Authority& authority,
                                                                        ControlPlane& plane) {
  auto credentials = UnjudgedTlsCredentials(door, authority);
  if (credentials.ok()) (*credentials)->SetAuthMetadataProcessor(std::make_shared<Doorkeeper>(door, plane));
  return credentials;
}

void ForwardGrpcLog() {
  gpr_set_log_function(
      [](gpr_log_func_args* args) { spdlog::debug("grpc {}:{}: {}", args->file, args->line, args->message); });
}

void SetServerLimits(grpc::ServerBuilder& builder, Door door) {
  SetDoorLimits(builder, door);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kMinPingIntervalMs);
}

Caller CallerOf(const grpc::ServerContext& context, Door door, ControlPlane& plane) {
  const Caller nobody{.door = door, .role = {}, .token = {}, .instances = {}, .host_id = {}};
  switch (door) {
    case Door::kSocket:
      return {.door = door, .role = v1::ROLE_ADMINISTRATOR, .token = {}, .instances = {}, .host_id = {}};
    case Door::kPlayers:
      return nobody;
    case Door::kOperators:
      break;
  }
  return Recognise(TokenOf(context.client_metadata()), CertificateOf(*context.auth_context()), plane).value_or(nobody);
}

std::string ShownSerial(const grpc::ServerContext& context) {
  const std::string certificate = CertificateOf(*context.auth_context());
  const auto facts = certificate.empty() ? absl::NotFoundError("") : trust::ReadCertificate(certificate);
  return facts.ok() ? facts->serial : "";
}

absl::Status PrepareSocket(const std::string& path) {
  if (path.size() > trust::kMaxSocketPathBytes) {
    return absl::InvalidArgumentError(absl::StrCat("socket ", path, ": the path has ", path.size(),
                                                   " bytes, the kernel takes ", trust::kMaxSocketPathBytes,
                                                   "; name a shorter one with --socket"));
  }
  const std::string folder = std::filesystem::path(path).parent_path().string();
  if (!std::filesystem::exists(folder)) {
    if (absl::Status status = host::MakePrivateFolder(folder); !status.ok()) return status;
  }
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) {
    return errno == ENOENT ? absl::OkStatus() : SocketError(path, std::strerror(errno));
  }
  if (!S_ISSOCK(found.st_mode)) return SocketError(path, "is there, and is no socket");
  if (SomebodyListens(path)) return SocketError(path, "another control plane listens there");
  return unlink(path.c_str()) == 0 ? absl::OkStatus() : SocketError(path, std::strerror(errno));
}

absl::Status CloseToOthers(const std::string& path) {
  return chmod(path.c_str(), S_IRUSR | S_IWUSR) == 0 ? absl::OkStatus() : SocketError(path, std::strerror(errno));
}

}  // namespace tessera::control

#include "trust/dial.h"

#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "trust/certificate.h"
#include "trust/control_address.h"
#include "trust/fetch_authority.h"
#include "trust/find_leader.h"
#include "trust/message_size.h"

namespace tessera::trust {
namespace {

constexpr std::chrono::seconds kFetchTimeout{5};
constexpr std::size_t kMaxKept = 64;  // authorities, of one process
// For a channel to several: soon after another was elected it is connected to it. Control planes take pings from 1 s
// on.
constexpr int kFirstReconnect_ms = 100, kLastReconnect_ms = 1000, kSilence_ms = 1500, kAnswer_ms = 1000;

// A fingerprint names one certificate for ever, so what was found for it holds wherever it is met again.
absl::StatusOr<std::string> AuthorityOf(const ControlAddress& address, std::chrono::milliseconds patience) {
  static std::mutex mutex;
  static std::map<std::string, std::string> kept;  // by fingerprint
  {
    const std::lock_guard lock(mutex);
    if (const auto found = kept.find(address.fingerprint); found != kept.end()) return found->second;
  }
  auto fetched = FetchAuthority(address.tcp, address.fingerprint, patience);
  if (!fetched.ok()) return fetched.status();
  const std::lock_guard lock(mutex);
  if (kept.size() < kMaxKept) kept.emplace(address.fingerprint, *fetched);
  return fetched;
}

// Its bytes become a header's.
bool IsToken(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return absl::ascii_isgraph(c); });
}

// By TLS, with all that is shown.
absl::StatusOr<std::shared_ptr<grpc::ChannelCredentials>> ChannelCredentialsFor(const ControlAddress& address,
                                                                                const Credentials& credentials,
                                                                                std::chrono::milliseconds patience) {
  grpc::SslCredentialsOptions options{.pem_root_certs = credentials.authority,
                                      .pem_private_key = credentials.key,
                                      .pem_cert_chain = credentials.certificate};
  if (!address.fingerprint.empty() && !options.pem_root_certs.empty()) {
    const auto facts = ReadCertificate(options.pem_root_certs);
    if (!facts.ok()) return facts.status();
    if (facts->fingerprint != address.fingerprint) {
      return absl::UnauthenticatedError(
          absl::StrCat(address.target(), ": the fingerprint in the address is not that of the authority known for it"));
    }
  } else if (!address.fingerprint.empty()) {
    auto authority = AuthorityOf(address, patience);
    if (!authority.ok()) return authority.status();
    options.pem_root_certs = *std::move(authority);
  }
  if (options.pem_root_certs.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(address.target(), ": nothing says which cluster is to answer there; name its authority, ",
                     address.target(), "#FINGERPRINT, as `tessera cluster authority` prints it"));
  }
  auto channel_credentials = grpc::SslCredentials(options);
  if (credentials.bearer_token.empty()) return channel_credentials;
  if (!IsToken(credentials.bearer_token)) return absl::InvalidArgumentError("token: has spaces or control characters");
  return grpc::CompositeChannelCredentials(channel_credentials, grpc::AccessTokenCredentials(credentials.bearer_token));
}

// For every channel by TLS.
void SetArguments(grpc::ChannelArguments& arguments) {
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an environment's proxy is not for this
  arguments.SetSslTargetNameOverride(kControlName);
}

// gRPC takes no more than 4 MB from a server unless it is asked to.
void SetReceiveLimit(grpc::ChannelArguments& arguments) {
  const grpc_channel_args given = arguments.c_channel_args();
  for (std::size_t i = 0; i < given.num_args; ++i) {
    if (std::string_view(given.args[i].key) == GRPC_ARG_MAX_RECEIVE_MESSAGE_LENGTH) return;
  }
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
}

absl::StatusOr<std::shared_ptr<grpc::Channel>> DialOne(const ControlAddress& address, const Credentials& credentials,
                                                       grpc::ChannelArguments arguments,
                                                       std::chrono::milliseconds patience) {
  if (address.is_socket()) {
    arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
    // The kernel has checked who opens the file.
    return grpc::CreateCustomChannel(address.target(), grpc::InsecureChannelCredentials(), arguments);
  }
  auto shown = ChannelCredentialsFor(address, credentials, patience);
  if (!shown.ok()) return shown.status();
  SetArguments(arguments);
  return grpc::CreateCustomChannel(address.target(), *shown, arguments);
}

// All addresses as one that gRPC takes, "ipv4:10.0.0.1:7700,10.0.0.2:7700"; names are looked up now. Empty: they are of
// both families, which no single target holds.
std::string TargetOfAll(const std::vector<ControlAddress>& addresses) {
  std::vector<std::string> all;
  int family = AF_UNSPEC;
  for (const ControlAddress& address : addresses) {
    addrinfo hints{};
    hints.ai_family = family;
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (getaddrinfo(address.tcp.host.c_str(), nullptr, &hints, &found) != 0) return "";
    char text[NI_MAXHOST] = "";
    const int named = getnameinfo(found->ai_addr, found->ai_addrlen, text, sizeof text, nullptr, 0, NI_NUMERICHOST);
    family = found->ai_family;
    freeaddrinfo(found);
    if (named != 0) return "";
    all.push_back(ToString(host::SocketAddress{text, address.tcp.port}));
  }
  return absl::StrCat(family == AF_INET6 ? "ipv6:" : "ipv4:", absl::StrJoin(all, ","));
}

// To whichever of them serves. `found` is one of them: all are of one cluster, so of one authority.
absl::StatusOr<std::shared_ptr<grpc::Channel>> DialWhoServes(const std::string& target, const ControlAddress& found,
                                                             const Credentials& credentials,
                                                             grpc::ChannelArguments arguments) {
  auto shown = ChannelCredentialsFor(found, credentials, kFetchTimeout);
  if (!shown.ok()) return shown.status();
  SetArguments(arguments);
  arguments.SetServiceConfigJSON(
      R"({"loadBalancingConfig":[{"round_robin":{}}],"healthCheckConfig":{"serviceName":""}})");
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kFirstReconnect_ms);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kLastReconnect_ms);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLastReconnect_ms);
  // A leader that is silent is left, whether it was cut off or stands still: by the time that another leads.
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kSilence_ms);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kAnswer_ms);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  return grpc::CreateCustomChannel(target, *shown, arguments);
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> Dial(const std::string& text, const Credentials& credentials,
                                                    grpc::ChannelArguments arguments) {
  const auto addresses = ParseControlAddresses(text, host::PortRule::kFrom1);
  if (!addresses.ok()) return addresses.status();
  SetReceiveLimit(arguments);
  if (addresses->size() == 1) return DialOne(addresses->front(), credentials, arguments, kFetchTimeout);
  // A connection of our own: what is known of a member that was away when another channel asked does not count.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::vector<Asked> members;
  std::string fingerprint;
  std::optional<ControlAddress> known;  // one of those whose authority is at hand
  for (const ControlAddress& address : *addresses) {
    const auto patience = kFindLeaderPatience / static_cast<int>(addresses->size());
    if (fingerprint.empty()) fingerprint = address.fingerprint;
    if (!address.fingerprint.empty() && address.fingerprint != fingerprint) {
      return absl::InvalidArgumentError(absl::StrCat(
          "\"", text, "\": control planes of one cluster have one authority; name the same fingerprint for each"));
    }
    auto channel = DialOne(address, credentials, arguments, patience);
    // A list that is wrong is wrong whoever leads.
    if (!channel.ok() && !absl::IsUnavailable(channel.status())) return channel.status();
    if (channel.ok()) known = address;
    members.push_back({address.target(), std::move(channel)});
  }
  const std::string target = TargetOfAll(*addresses);
  if (target.empty() || !known) return FindLeader(members);
  auto channel = DialWhoServes(target, *known, credentials, arguments);
  if (!channel.ok()) return channel.status();
  if ((*channel)->WaitForConnected(std::chrono::system_clock::now() + kFindLeaderPatience)) return channel;
  // The channel to all does not say why, nor who cannot be reached.
  const auto leader = FindLeader(members);
  if (!leader.ok()) return leader.status();
  return channel;
}

}  // namespace tessera::trust

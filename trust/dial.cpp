#include "trust/dial.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "trust/certificate.h"
#include "trust/control_address.h"
#include "trust/fetch_authority.h"
#include "trust/find_leader.h"

namespace tessera::trust {
namespace {

constexpr std::chrono::seconds kFetchTimeout{5};
constexpr std::size_t kMaxKept = 64;  // authorities, of one process

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

absl::StatusOr<std::shared_ptr<grpc::Channel>> DialOne(const ControlAddress& address, const Credentials& credentials,
                                                       grpc::ChannelArguments arguments,
                                                       std::chrono::milliseconds patience) {
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an environment's proxy is not for this
  if (address.is_socket()) {
    // The kernel has checked who opens the file.
    return grpc::CreateCustomChannel(address.target(), grpc::InsecureChannelCredentials(), arguments);
  }
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
  arguments.SetSslTargetNameOverride(kControlName);
  auto channel_credentials = grpc::SslCredentials(options);
  if (!credentials.bearer_token.empty()) {
    if (!IsToken(credentials.bearer_token))
      return absl::InvalidArgumentError("token: has spaces or control characters");
    channel_credentials =
        grpc::CompositeChannelCredentials(channel_credentials, grpc::AccessTokenCredentials(credentials.bearer_token));
  }
  return grpc::CreateCustomChannel(address.target(), channel_credentials, arguments);
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> Dial(const std::string& text, const Credentials& credentials,
                                                    grpc::ChannelArguments arguments) {
  const auto addresses = ParseControlAddresses(text, host::PortRule::kFrom1);
  if (!addresses.ok()) return addresses.status();
  if (addresses->size() == 1) return DialOne(addresses->front(), credentials, arguments, kFetchTimeout);
  // A connection of our own: what is known of a member that was away when another channel asked does not count.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  std::vector<Asked> members;
  for (const ControlAddress& address : *addresses) {
    const auto patience = kFindLeaderPatience / static_cast<int>(addresses->size());
    auto channel = DialOne(address, credentials, arguments, patience);
    // A list that is wrong is wrong whoever leads.
    if (!channel.ok() && !absl::IsUnavailable(channel.status())) return channel.status();
    members.push_back({address.target(), std::move(channel)});
  }
  return FindLeader(members);
}

}  // namespace tessera::trust

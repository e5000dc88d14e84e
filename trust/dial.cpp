#include "trust/dial.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "trust/certificate.h"
#include "trust/control_address.h"
#include "trust/fetch_authority.h"

namespace tessera::trust {
namespace {

constexpr std::chrono::seconds kFetchTimeout{5};
constexpr std::size_t kMaxKept = 64;  // authorities, of one process

// A fingerprint names one certificate for ever, so what was found for it holds wherever it is met again.
absl::StatusOr<std::string> AuthorityOf(const ControlAddress& address) {
  static std::mutex mutex;
  static std::map<std::string, std::string> kept;  // by fingerprint
  {
    const std::lock_guard lock(mutex);
    if (const auto found = kept.find(address.fingerprint); found != kept.end()) return found->second;
  }
  auto fetched = FetchAuthority(address.tcp, address.fingerprint, kFetchTimeout);
  if (!fetched.ok()) return fetched.status();
  const std::lock_guard lock(mutex);
  if (kept.size() < kMaxKept) kept.emplace(address.fingerprint, *fetched);
  return fetched;
}

// Its bytes become a header's.
bool IsToken(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return absl::ascii_isgraph(c); });
}

}  // namespace

absl::StatusOr<std::shared_ptr<grpc::Channel>> Dial(const std::string& text, const Credentials& credentials,
                                                    grpc::ChannelArguments arguments) {
  const auto address = ParseControlAddress(text, host::PortRule::kFrom1);
  if (!address.ok()) return address.status();
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);  // an environment's proxy is not for this
  if (address->is_socket()) {
    // The kernel has checked who opens the file.
    return grpc::CreateCustomChannel(address->target(), grpc::InsecureChannelCredentials(), arguments);
  }
  grpc::SslCredentialsOptions options{.pem_root_certs = credentials.authority,
                                      .pem_private_key = credentials.key,
                                      .pem_cert_chain = credentials.certificate};
  if (!address->fingerprint.empty() && !options.pem_root_certs.empty()) {
    const auto facts = ReadCertificate(options.pem_root_certs);
    if (!facts.ok()) return facts.status();
    if (facts->fingerprint != address->fingerprint) {
      return absl::UnauthenticatedError(absl::StrCat(
          address->target(), ": the fingerprint in the address is not that of the authority known for it"));
    }
  } else if (!address->fingerprint.empty()) {
    auto authority = AuthorityOf(*address);
    if (!authority.ok()) return authority.status();
    options.pem_root_certs = *std::move(authority);
  }
  if (options.pem_root_certs.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat(address->target(), ": nothing says which cluster is to answer there; name its authority, ",
                     address->target(), "#FINGERPRINT, as `tessera cluster authority` prints it"));
  }
  arguments.SetSslTargetNameOverride(kControlName);
  auto channel_credentials = grpc::SslCredentials(options);
  if (!credentials.bearer_token.empty()) {
    if (!IsToken(credentials.bearer_token))
      return absl::InvalidArgumentError("token: has spaces or control characters");
    channel_credentials =
        grpc::CompositeChannelCredentials(channel_credentials, grpc::AccessTokenCredentials(credentials.bearer_token));
  }
  return grpc::CreateCustomChannel(address->target(), channel_credentials, arguments);
}

}  // namespace tessera::trust

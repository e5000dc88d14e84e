#include "control_plane/etcd/etcd_address.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "host/socket_address.h"

namespace tessera::control {
namespace {

constexpr char kEtcdScheme[] = "etcd://", kEtcdDefaultPrefix[] = "tessera";
constexpr std::size_t kMaxEtcdPrefixBytes = 200, kMaxEtcdEndpoints = 16;

bool IsEtcdPrefix(const std::string& text) {
  if (text.size() > kMaxEtcdPrefixBytes || text.starts_with('/') || text.ends_with('/')) return false;
  if (text.find("//") != std::string::npos) return false;
  return std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '-' || c == '_' || c == '.' || c == '/';
  });
}

bool IsLoopback(const std::string& host) { return host == "localhost" || host == "::1" || host.starts_with("127."); }

}  // namespace

absl::StatusOr<EtcdAddress> ParseEtcdAddress(const std::string& text) {
  if (!text.starts_with(kEtcdScheme)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\" is not of the form etcd://HOST:PORT,HOST:PORT/PREFIX"));
  }
  const std::string rest = text.substr(sizeof kEtcdScheme - 1);
  const std::size_t slash = rest.find('/');
  EtcdAddress address{.endpoints = {},
                      .prefix = slash == std::string::npos ? kEtcdDefaultPrefix : rest.substr(slash + 1),
                      .is_local = true};
  if (address.prefix.empty() || !IsEtcdPrefix(address.prefix)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "\"", address.prefix, "\" is no prefix of keys: letters, digits, - _ . and / between them, at most ",
        kMaxEtcdPrefixBytes, " bytes"));
  }
  const std::vector<std::string> endpoints = absl::StrSplit(rest.substr(0, slash), ',');
  for (const std::string& endpoint : endpoints) {
    const auto parsed = host::ParseSocketAddress(endpoint, host::PortRule::kFrom1);
    if (!parsed.ok()) return parsed.status();
    address.is_local = address.is_local && IsLoopback(parsed->host);
    address.endpoints.push_back(ToString(*parsed));
  }
  if (address.endpoints.size() > kMaxEtcdEndpoints) {
    return absl::InvalidArgumentError(absl::StrCat("names ", address.endpoints.size(), " members of etcd, at most ",
                                                   kMaxEtcdEndpoints, " are taken"));
  }
  return address;
}

}  // namespace tessera::control

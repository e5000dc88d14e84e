#include "trust/control_address.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "host/control_socket.h"
#include "trust/certificate.h"

namespace tessera::trust {
namespace {

constexpr char kSocketPrefix[] = "unix:";

}  // namespace

std::string ControlAddress::target() const {
  return is_socket() ? absl::StrCat(kSocketPrefix, socket_path) : ToString(tcp);
}

std::string ControlAddress::text() const {
  return fingerprint.empty() ? target() : absl::StrCat(target(), "#", fingerprint);
}

absl::StatusOr<ControlAddress> ParseControlAddress(const std::string& text, host::PortRule ports) {
  ControlAddress address;
  if (text.starts_with(kSocketPrefix)) {
    address.socket_path = text.substr(sizeof kSocketPrefix - 1);
    if (!address.socket_path.starts_with('/')) {
      return absl::InvalidArgumentError(absl::StrCat("\"", text, "\": the path of a socket begins with /"));
    }
    if (address.socket_path.size() > kMaxSocketPathBytes) {
      return absl::InvalidArgumentError(absl::StrCat("\"", text, "\": the path has ", address.socket_path.size(),
                                                     " bytes, the kernel takes ", kMaxSocketPathBytes));
    }
    return address;
  }
  const std::size_t mark = text.find('#');
  auto tcp = host::ParseSocketAddress(text.substr(0, mark), ports);
  if (!tcp.ok()) return tcp.status();
  address.tcp = *std::move(tcp);
  if (mark == std::string::npos) return address;
  address.fingerprint = text.substr(mark + 1);
  if (!IsFingerprint(address.fingerprint)) {
    return absl::InvalidArgumentError(
        absl::StrCat("\"", text, "\": after # comes a fingerprint of 64 hexadecimal digits in lower case"));
  }
  return address;
}

absl::StatusOr<std::vector<ControlAddress>> ParseControlAddresses(const std::string& text, host::PortRule ports) {
  // A path may hold commas.
  const std::vector<std::string> parts = text.starts_with(kSocketPrefix)
                                             ? std::vector<std::string>{text}
                                             : std::vector<std::string>(absl::StrSplit(text, ','));
  if (parts.size() > kMaxControlAddresses) {
    return absl::InvalidArgumentError(
        absl::StrCat("names ", parts.size(), " control planes, at most ", kMaxControlAddresses, " are taken"));
  }
  std::vector<ControlAddress> addresses;
  for (const std::string& part : parts) {
    auto address = ParseControlAddress(part, ports);
    if (!address.ok()) return address.status();
    if (address->is_socket() && parts.size() > 1) {
      return absl::InvalidArgumentError(absl::StrCat("\"", part, "\": a socket stands alone, in no list"));
    }
    addresses.push_back(*std::move(address));
  }
  return addresses;
}

std::string DefaultControlSocket() { return host::DefaultControlSocket(); }

std::string PageKeyFile(const std::string& socket_path) { return socket_path + ".page-key"; }

}  // namespace tessera::trust

#include "trust/control_address.h"

#include <unistd.h>

#include <cstdlib>

#include "absl/strings/str_cat.h"
#include "trust/certificate.h"

namespace tessera::trust {
namespace {

constexpr char kSocketPrefix[] = "unix:";

}  // namespace

std::string ControlAddress::target() const {
  return is_socket() ? absl::StrCat(kSocketPrefix, socket_path) : ToString(tcp);
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

std::string DefaultControlSocket() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const std::string folder = runtime != nullptr && runtime[0] == '/' ? absl::StrCat(runtime, "/tessera")
                                                                     : absl::StrCat("/tmp/tessera-", geteuid());
  return folder + "/control.sock";
}

std::string PageKeyFile(const std::string& socket_path) { return socket_path + ".page-key"; }

}  // namespace tessera::trust

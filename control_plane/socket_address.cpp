#include "control_plane/socket_address.h"

#include <errno.h>
#include <netdb.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <limits>
#include <memory>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace tessera::control {

absl::StatusOr<SocketAddress> ParseSocketAddress(const std::string& text) {
  const absl::Status malformed =
      absl::InvalidArgumentError(absl::StrCat("address ", text, ": needs the form HOST:PORT"));
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0) return malformed;
  SocketAddress address;
  address.host = text.substr(0, colon);
  if (address.host.front() == '[' && address.host.back() == ']') {
    address.host = address.host.substr(1, address.host.size() - 2);
  } else if (address.host.find(':') != std::string::npos) {
    return malformed;  // an IPv6 address without brackets
  }
  int port = 0;
  if (!absl::SimpleAtoi(text.substr(colon + 1), &port) || port < 0 ||
      port > std::numeric_limits<std::uint16_t>::max()) {
    return absl::InvalidArgumentError(absl::StrCat("address ", text, ": the port is not in 0 to 65535"));
  }
  address.port = static_cast<std::uint16_t>(port);
  return address;
}

std::string ToString(const SocketAddress& address) {
  if (address.host.find(':') != std::string::npos) return absl::StrCat("[", address.host, "]:", address.port);
  return absl::StrCat(address.host, ":", address.port);
}

absl::Status CheckBindable(const SocketAddress& address, const std::string& what) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int looked_up = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (looked_up != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("address ", ToString(address), ": ", gai_strerror(looked_up), " (", what, ")"));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, freeaddrinfo);
  const int fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0)
    return absl::UnavailableError(absl::StrCat("address ", ToString(address), ": ", strerror(errno), " (", what, ")"));
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const int error = bind(fd, found->ai_addr, found->ai_addrlen) == 0 && listen(fd, 1) == 0 ? 0 : errno;
  close(fd);
  if (error == 0) return absl::OkStatus();
  if (error == EADDRINUSE)
    return absl::UnavailableError(absl::StrCat("address ", ToString(address), " is in use (", what, ")"));
  return absl::UnavailableError(
      absl::StrCat("address ", ToString(address), " cannot be bound: ", strerror(error), " (", what, ")"));
}

}  // namespace tessera::control

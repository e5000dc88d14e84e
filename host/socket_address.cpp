#include "host/socket_address.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace tessera::host {
namespace {

constexpr std::size_t kMaxHostName = 253;  // RFC 1035, without the final dot
constexpr std::size_t kMaxPortDigits = 5;

bool IsPort(const std::string& digits, PortRule ports, std::uint16_t& port) {
  int number = 0;
  const bool decimal = !digits.empty() && digits.size() <= kMaxPortDigits &&
                       std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!decimal || !absl::SimpleAtoi(digits, &number)) return false;
  if (number > 65535 || (number == 0 && ports == PortRule::kFrom1)) return false;
  port = static_cast<std::uint16_t>(number);
  return true;
}

}  // namespace

bool IsHostName(const std::string& text) {
  return !text.empty() && text.size() <= kMaxHostName && std::all_of(text.begin(), text.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '_' || c == ':';
  });
}

bool IsLoopback(const std::string& host) {
  in_addr address{};
  if (inet_pton(AF_INET, host.c_str(), &address) == 1) return ntohl(address.s_addr) >> 24 == 127;
  return host == "::1" || host == "localhost";
}

absl::StatusOr<SocketAddress> ParseSocketAddress(const std::string& text, PortRule ports) {
  const std::size_t colon = text.rfind(':');
  SocketAddress address;
  if (colon != std::string::npos) {
    address.host = text.substr(0, colon);
    const bool bracketed = address.host.size() > 2 && address.host.front() == '[' && address.host.back() == ']';
    if (bracketed) address.host = address.host.substr(1, address.host.size() - 2);
    const bool is_ipv6 = address.host.find(':') != std::string::npos;
    if (bracketed == is_ipv6 && IsHostName(address.host) && IsPort(text.substr(colon + 1), ports, address.port)) {
      return address;
    }
  }
  return absl::InvalidArgumentError(absl::StrCat("\"", text, "\" is not of the form HOST:PORT"));
}

std::string ListenAddressFault(const std::string& text) {
  return std::string(ParseSocketAddress(text, PortRule::kFrom0).status().message());
}

std::string ToString(const SocketAddress& address) {
  if (address.host.find(':') != std::string::npos) return absl::StrCat("[", address.host, "]:", address.port);
  return absl::StrCat(address.host, ":", address.port);
}

absl::Status CheckBindable(const SocketAddress& address, const std::string& what) {
  const std::string name = absl::StrCat("address ", ToString(address));
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int looked_up = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (looked_up != 0) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": ", gai_strerror(looked_up), " (", what, ")"));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, freeaddrinfo);
  const int fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return absl::UnavailableError(absl::StrCat(name, ": ", std::strerror(errno), " (", what, ")"));
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const int error = bind(fd, found->ai_addr, found->ai_addrlen) == 0 && listen(fd, 1) == 0 ? 0 : errno;
  close(fd);
  if (error == 0) return absl::OkStatus();
  if (error == EADDRINUSE) return absl::UnavailableError(absl::StrCat(name, " is in use (", what, ")"));
  return absl::UnavailableError(absl::StrCat(name, " cannot be bound: ", std::strerror(error), " (", what, ")"));
}

bool PortsFree(const std::string& address, const std::string& metrics_address, std::uint16_t first) {
  for (const int offset : {0, 1, 2}) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    const std::string& where = offset < 2 ? address : metrics_address;
    if (inet_pton(AF_INET, where.c_str(), &name.sin_addr) != 1) continue;  // a name: the worker finds out
    const int fd = socket(AF_INET, (offset < 2 ? SOCK_DGRAM : SOCK_STREAM) | SOCK_CLOEXEC, 0);
    const int on = 1;
    // As HTTP servers do, so that a port in TIME_WAIT counts as free.
    if (offset == 2) setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    name.sin_port = htons(static_cast<std::uint16_t>(first + offset));
    const bool bound = bind(fd, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
    close(fd);
    if (!bound) return false;
  }
  return true;
}

}  // namespace tessera::host

#include "control_plane/tcp_listener.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/str_cat.h"
#include "telemetry/log_value.h"

namespace tessera::control {
namespace {

using AddressList = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

constexpr char kEveryIpv4[] = "0.0.0.0", kEveryAddress[] = "::";

// The sockets of one listener until they have an owner.
struct ListeningSockets {
  ~ListeningSockets() { CloseAll(); }
  void CloseAll() {
    for (const int fd : fds) close(fd);
    fds.clear();
  }
  std::vector<int> fds;
};

absl::StatusOr<AddressList> LookUp(const host::SocketAddress& address) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const int looked_up = getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &found);
  if (looked_up != 0) return absl::InvalidArgumentError(gai_strerror(looked_up));
  return AddressList(found, freeaddrinfo);
}

// 0, or why it cannot be listened at. `port`: 0 takes a free one, which is written there.
int ListenAt(const addrinfo& where, std::uint16_t& port, std::vector<int>& fds) {
  const int fd = socket(where.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return errno;
  sockaddr_storage name{};
  std::memcpy(&name, where.ai_addr, where.ai_addrlen);
  in_port_t& bound_port = where.ai_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(name).sin6_port
                                                      : reinterpret_cast<sockaddr_in&>(name).sin_port;
  bound_port = htons(port);
  const int on = 1, off = 0;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  // Connections inherit it. Messages are whole when they are written, so waiting for more only delays them.
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (where.ai_family == AF_INET6) setsockopt(fd, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
  socklen_t size = where.ai_addrlen;
  if (bind(fd, reinterpret_cast<const sockaddr*>(&name), size) != 0 || listen(fd, SOMAXCONN) != 0 ||
      getsockname(fd, reinterpret_cast<sockaddr*>(&name), &size) != 0) {
    const int error = errno;
    close(fd);
    return error;
  }
  port = ntohs(bound_port);
  fds.push_back(fd);
  return 0;
}

// Listens at all addresses of the name, at one port. 0, or the error of the last one that cannot be listened at, where
// none can.
int ListenAtAll(const addrinfo* found, std::uint16_t& port, std::vector<int>& fds) {
  int error = 0;
  for (const addrinfo* where = found; where != nullptr; where = where->ai_next) {
    if (where->ai_family != AF_INET && where->ai_family != AF_INET6) continue;
    if (const int failed = ListenAt(*where, port, fds); failed != 0) error = failed;
    if (error == EADDRINUSE) break;  // by half a door nobody is served
  }
  return error == EADDRINUSE || fds.empty() ? error : 0;
}

std::string PeerText(int fd) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &size) != 0 ||
      getnameinfo(reinterpret_cast<const sockaddr*>(&peer), size, text.data(), text.size(), nullptr, 0,
                  NI_NUMERICHOST) != 0) {
    return "nowhere";
  }
  return text.data();
}

}  // namespace

absl::StatusOr<std::unique_ptr<TcpListener>> TcpListener::Listen(const host::SocketAddress& address, std::string door,
                                                                 ConnectionLimits limits, ControlMetrics& metrics,
                                                                 AcceptLoop::Take take) {
  const std::string name = absl::StrCat("address ", ToString(address));
  ListeningSockets listening;
  host::SocketAddress bound = address;
  int error = EADDRNOTAVAIL;
  if (address.host == kEveryIpv4) {
    const auto every = LookUp({.host = kEveryAddress, .port = address.port});
    if (every.ok()) error = ListenAtAll(every->get(), bound.port, listening.fds);
  }
  if (listening.fds.empty() && error != EADDRINUSE) {
    const auto found = LookUp(address);
    if (!found.ok())
      return absl::InvalidArgumentError(absl::StrCat(name, ": ", found.status().message(), " (", door, ")"));
    error = ListenAtAll(found->get(), bound.port, listening.fds);
  }
  if (error == EADDRINUSE) return absl::UnavailableError(absl::StrCat(name, " is in use (", door, ")"));
  if (listening.fds.empty()) {
    return absl::UnavailableError(absl::StrCat(name, " cannot be bound: ", std::strerror(error), " (", door, ")"));
  }
  return std::unique_ptr<TcpListener>(new TcpListener(std::move(bound), std::move(door), limits, metrics,
                                                      std::exchange(listening.fds, {}), std::move(take)));
}

TcpListener::TcpListener(host::SocketAddress address, std::string door, ConnectionLimits limits,
                         ControlMetrics& metrics, std::vector<int> listening, AcceptLoop::Take take)
    : address_(std::move(address)),
      door_(std::move(door)),
      metrics_(metrics),
      take_(std::move(take)),
      open_(limits),
      loop_(
          std::move(listening), [this](int fd) { Take(fd); },
          [this] { metrics_.SetConnections(door_, open_.Sweep()); }) {}

TcpListener::~TcpListener() = default;

void TcpListener::Take(int fd) {
  const OpenConnections::Refusal refusal = open_.Take(fd, OpenConnections::Clock::now());
  if (refusal == OpenConnections::Refusal::kNone) {
    take_(fd);
    return;
  }
  const bool address = refusal == OpenConnections::Refusal::kAddress;
  metrics_.CountRefusedConnection(door_, address ? "address" : "door");
  if (const auto left_out = refusals_.Take(telemetry::LogThrottle::Clock::now())) {
    spdlog::warn("refused connection door={} from={} reason={} more={}", door_, PeerText(fd),
                 telemetry::LogValue(address ? "the address has as many connections as it may"
                                             : "the door has as many connections as it may"),
                 *left_out);
  }
  close(fd);
}

}  // namespace tessera::control

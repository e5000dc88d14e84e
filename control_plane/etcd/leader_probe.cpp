#include "control_plane/etcd/leader_probe.h"

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "host/socket_address.h"

namespace tessera::control {
namespace {

constexpr int kProbePatienceMs = 100;
constexpr unsigned kProbeRefusals = 2;

// 0, or why there is no connection.
int ConnectWithin(int fd, const sockaddr* address, socklen_t size, int patience_ms) {
  if (connect(fd, address, size) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd waited{.fd = fd, .events = POLLOUT, .revents = 0};
  if (poll(&waited, 1, patience_ms) <= 0) return ETIMEDOUT;
  int error = 0;
  socklen_t length = sizeof error;
  return getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &length) == 0 ? error : errno;
}

}  // namespace

LeaderProbe::~LeaderProbe() { Close(); }

void LeaderProbe::Begin(std::int64_t term, const std::string& address) {
  if (term_ == term) return;
  Close();
  term_ = term;
  target_ = LookUp(address);
  reached_ = false;
  refusals_ = 0;
}

std::optional<LeaderProbe::Target> LeaderProbe::LookUp(const std::string& address) {
  const auto parsed = host::ParseSocketAddress(address, host::PortRule::kFrom1);
  if (!parsed.ok()) return std::nullopt;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (getaddrinfo(parsed->host.c_str(), std::to_string(parsed->port).c_str(), &hints, &found) != 0) return std::nullopt;
  Target target;
  target.size = found->ai_addrlen;
  std::memcpy(&target.address, found->ai_addr, found->ai_addrlen);
  freeaddrinfo(found);
  return target;
}

bool LeaderProbe::IsGone() {
  if (!target_ || IsHeld()) return false;
  Close();
  held_ = socket(target_->address.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (held_ < 0) return false;
  const int fault =
      ConnectWithin(held_, reinterpret_cast<const sockaddr*>(&target_->address), target_->size, kProbePatienceMs);
  if (fault == 0) reached_ = true;
  if (fault != 0) Close();
  refusals_ = fault == ECONNREFUSED && reached_ ? refusals_ + 1 : 0;
  return refusals_ >= kProbeRefusals;
}

// Nothing is expected to be said; whatever is, is dropped.
bool LeaderProbe::IsHeld() {
  if (held_ < 0) return false;
  std::array<char, 512> said;
  const ssize_t got = recv(held_, said.data(), said.size(), MSG_DONTWAIT);
  return got > 0 || (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR));
}

void LeaderProbe::Close() {
  if (const int fd = std::exchange(held_, -1); fd >= 0) close(fd);
}

}  // namespace tessera::control

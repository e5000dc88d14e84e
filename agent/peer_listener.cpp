#include "agent/peer_listener.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "agent/limits.h"
#include "host/unix_socket.h"

namespace tessera::agent {
namespace {

// Above what this program has open otherwise, below the usual limit of 1024.
constexpr int kFirstNumber = 256;

}  // namespace

absl::StatusOr<std::unique_ptr<PeerListener>> PeerListener::Listen(const std::string& path, Take take) {
  const auto failed = [](const std::string& reason) {
    return absl::UnavailableError(absl::StrCat("cannot serve workers: ", reason));
  };
  struct stat old {};
  if (lstat(path.c_str(), &old) == 0 && S_ISSOCK(old.st_mode)) unlink(path.c_str());
  const absl::StatusOr<int> listening = host::ListenOnUnixSocket(path);
  if (!listening.ok()) return failed(std::string(listening.status().message()));
  const int stop = eventfd(0, EFD_CLOEXEC);
  if (stop < 0) {
    const int error = errno;
    close(*listening);
    return failed(std::strerror(error));
  }
  std::unique_ptr<PeerListener> listener(new PeerListener(*listening, stop, std::move(take)));
  listener->thread_ = std::thread([raw = listener.get()] { raw->Run(); });
  return listener;
}

PeerListener::PeerListener(int listening, int stop, Take take)
    : listening_(listening), stop_(stop), take_(std::move(take)), next_number_(kFirstNumber) {}

PeerListener::~PeerListener() {
  const std::uint64_t one = 1;
  (void)!write(stop_, &one, sizeof one);
  thread_.join();
  for (const auto& [fd, connection] : connections_) close(fd);
  close(listening_);
  close(stop_);
}

pid_t PeerListener::PeerOf(int fd) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(connections_, [fd](const auto& entry) { return entry.second.given == fd; });
  return found == connections_.end() ? 0 : found->second.peer;
}

// A connection that has ended, at either side, wakes our own descriptor of it: POLLHUP comes unasked.
void PeerListener::Run() {
  bool has_descriptors = true;
  for (;;) {
    std::vector<pollfd> watched{{.fd = stop_, .events = POLLIN, .revents = 0},
                                {.fd = has_descriptors ? listening_ : -1, .events = POLLIN, .revents = 0}};
    for (const auto& [fd, connection] : connections_) watched.push_back({.fd = fd, .events = 0, .revents = 0});
    const int woken = poll(watched.data(), watched.size(), has_descriptors ? -1 : kAcceptPause_ms);
    if (woken < 0 && errno != EINTR) return;
    if (watched[0].revents != 0) return;
    for (std::size_t i = 2; i < watched.size(); ++i) {
      if (watched[i].revents != 0) CloseEnded(watched[i].fd);
    }
    has_descriptors = !has_descriptors || watched[1].revents == 0 || Accept();
  }
}

// False: this program has no descriptor left.
bool PeerListener::Accept() {
  const int fd = accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return errno != EMFILE && errno != ENFILE;
  LetIn(fd);
  return true;
}

void PeerListener::LetIn(int fd) {
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool known = getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == geteuid();
  if (!known || !HasRoomFor(peer.pid)) {
    close(fd);
    return;
  }
  const int given = Number(fd);
  if (given < 0) {
    close(fd);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    connections_[fd] = {given, peer.pid};
  }
  take_(given);
}

void PeerListener::CloseEnded(int fd) {
  {
    const std::lock_guard lock(mutex_);
    connections_.erase(fd);
  }
  close(fd);
}

bool PeerListener::HasRoomFor(pid_t peer) const {
  const std::lock_guard lock(mutex_);
  const auto has = std::ranges::count_if(connections_, [peer](const auto& entry) { return entry.second.peer == peer; });
  return static_cast<std::size_t>(has) < kConnectionsOfAProcess && connections_.size() < kConnectionsOfAll;
}

// Another descriptor of the same connection, above the last one; from the beginning again at the end of the range.
int PeerListener::Number(int fd) {
  int number = fcntl(fd, F_DUPFD_CLOEXEC, next_number_);
  if (number < 0 && (errno == EMFILE || errno == EINVAL)) number = fcntl(fd, F_DUPFD_CLOEXEC, kFirstNumber);
  if (number < 0) number = fcntl(fd, F_DUPFD_CLOEXEC, 0);  // a limit below the range
  next_number_ = number + 1;
  return number;
}

}  // namespace tessera::agent

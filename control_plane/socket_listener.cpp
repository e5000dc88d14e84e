#include "control_plane/socket_listener.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <utility>

#include "control_plane/restraint.h"
#include "host/unix_socket.h"
#include "telemetry/log_value.h"

namespace tessera::control {

absl::StatusOr<std::unique_ptr<SocketListener>> SocketListener::Listen(const std::string& path, Take take) {
  const absl::StatusOr<int> listening = host::ListenOnUnixSocket(path);
  if (!listening.ok()) return listening.status();
  if (const auto own = RestraintOf(getpid()); !own.ok()) {
    spdlog::warn("at the socket workers are not told from their user reason={}",
                 telemetry::LogValue(std::string(own.status().message())));
  }
  return std::unique_ptr<SocketListener>(new SocketListener(path, *listening, std::move(take)));
}

SocketListener::SocketListener(std::string path, int listening, Take take)
    : path_(std::move(path)),
      take_(std::move(take)),
      loop_(
          {listening}, [this](int fd) { Judge(fd); }, [] {}) {}

SocketListener::~SocketListener() { unlink(path_.c_str()); }

void SocketListener::Judge(int fd) {
  const absl::Status status = CheckPeer(fd);
  if (status.ok()) {
    take_(fd);
    return;
  }
  close(fd);
  if (const auto left_out = refusals_.Take(telemetry::LogThrottle::Clock::now())) {
    spdlog::warn("refused at the socket reason={} more={}", telemetry::LogValue(std::string(status.message())),
                 *left_out);
  }
}

}  // namespace tessera::control

// Attacks by connections alone, without a byte of a call.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/socket_address.h"
#include "local_cluster/command_error.h"
#include "tessera/v1/host.grpc.pb.h"
#include "tests/support/attacks.h"
#include "trust/dial.h"

namespace tessera::support {
namespace {

constexpr std::chrono::milliseconds kConnectionPatience{20'000};
// All of 127/8 is this machine, and to a door each is another address.
constexpr char kOtherAddress[] = "127.0.0.9";

// A connection from there to this machine.
int ConnectFrom(const char* source, std::uint16_t port) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in from{}, to{};
  from.sin_family = to.sin_family = AF_INET;
  inet_pton(AF_INET, source, &from.sin_addr);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  to.sin_port = htons(port);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0 ||
      connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    close(fd);
    throw local::CommandError(fmt::format("no connection from {} to port {}", source, port));
  }
  return fd;
}

// By a connection of its own.
grpc::Status ListHostsAlone(const std::string& door) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  const auto channel = local::OrThrow(trust::Dial(door, {}, arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kConnectionPatience);
  v1::ListHostsResponse response;
  return v1::HostService::NewStub(channel)->ListHosts(&context, {}, &response);
}

}  // namespace

Outcome HoldConnections(const Target& target, int at_each_door, int most) {
  Outcome outcome;
  for (const std::string& door : {target.operators, target.players}) {
    const auto address =
        local::OrThrow(host::ParseSocketAddress(door.substr(0, door.find('#')), host::PortRule::kFrom1));
    std::vector<int> held;
    held.reserve(static_cast<std::size_t>(at_each_door));
    for (int i = 0; i < at_each_door; ++i) held.push_back(ConnectFrom(kOtherAddress, address.port));
    // They are judged one after another: once the last is closed, all are.
    pollfd last{.fd = held.back(), .events = POLLIN, .revents = 0};
    poll(&last, 1, static_cast<int>(kConnectionPatience.count()));
    const auto open = std::count_if(held.begin(), held.end(), [](int fd) {
      pollfd watched{.fd = fd, .events = POLLIN, .revents = 0};
      return poll(&watched, 1, 0) == 0;
    });
    outcome.Try(fmt::format("{} connections stay at {}", open, door), open <= most);
    // Whoever comes from elsewhere is answered: that he has nothing to show.
    const grpc::Status status = ListHostsAlone(door);
    const bool refused = status.error_code() == grpc::StatusCode::UNAUTHENTICATED ||
                         status.error_code() == grpc::StatusCode::PERMISSION_DENIED;
    outcome.Try(fmt::format("others are kept out of {}: {}", door, status.error_message()), refused);
    for (const int fd : held) close(fd);
  }
  return outcome;
}

}  // namespace tessera::support

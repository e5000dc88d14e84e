#include "control_plane/counted_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstddef>
#include <string_view>

namespace tessera::control {
namespace {

constexpr std::size_t kNetworkBytes = 8;  // a /64
constexpr std::string_view kIpv4Peer = "ipv4:", kIpv6Peer = "ipv6:";
// Brackets, as gRPC writes them in a peer's name.
constexpr std::string_view kOpening = "%5B", kClosing = "%5D";

std::string CountedIpv4(const in_addr& address) { return {reinterpret_cast<const char*>(&address), sizeof address}; }

std::string CountedIpv6(const in6_addr& address) {
  const char* bytes = reinterpret_cast<const char*>(&address);
  if (IN6_IS_ADDR_V4MAPPED(&address)) return {bytes + sizeof address - sizeof(in_addr), sizeof(in_addr)};
  return {bytes, kNetworkBytes};
}

}  // namespace

std::string CountedAddress(int socket_fd) {
  sockaddr_storage peer{};
  socklen_t size = sizeof peer;
  if (getpeername(socket_fd, reinterpret_cast<sockaddr*>(&peer), &size) != 0) return "";
  if (peer.ss_family == AF_INET) return CountedIpv4(reinterpret_cast<const sockaddr_in&>(peer).sin_addr);
  if (peer.ss_family == AF_INET6) return CountedIpv6(reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr);
  return "";
}

std::string CountedPeer(const std::string& peer) {
  std::string host = peer.substr(0, peer.rfind(':'));
  if (host.starts_with(kIpv4Peer)) {
    in_addr address{};
    if (inet_pton(AF_INET, host.c_str() + kIpv4Peer.size(), &address) == 1) return CountedIpv4(address);
  }
  if (host.starts_with(kIpv6Peer)) {
    std::string text = host.substr(kIpv6Peer.size());
    const bool escaped = text.starts_with(kOpening) && text.ends_with(kClosing);
    if (escaped) text = text.substr(kOpening.size(), text.size() - kOpening.size() - kClosing.size());
    if (!escaped && text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
    text = text.substr(0, text.find('%'));  // without the interface of a link-local address
    in6_addr address{};
    if (inet_pton(AF_INET6, text.c_str(), &address) == 1) return CountedIpv6(address);
  }
  return host;
}

}  // namespace tessera::control

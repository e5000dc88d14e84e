#include <winsock2.h>
#include <ws2tcpip.h>

#include <cassert>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "net/sockets.h"

namespace tessera::net {
namespace {

static_assert(sizeof(SystemSocket) == sizeof(SOCKET));

// Closes on scope exit. Winsock runs: enet_initialize has started it.
class ProbeSocket {
 public:
  ProbeSocket() : socket_(socket(AF_INET, SOCK_DGRAM, IPPROTO_UDP)) {}
  ~ProbeSocket() {
    if (socket_ != INVALID_SOCKET) closesocket(socket_);
  }
  ProbeSocket(const ProbeSocket&) = delete;
  ProbeSocket& operator=(const ProbeSocket&) = delete;
  bool open() const { return socket_ != INVALID_SOCKET; }
  SOCKET get() const { return socket_; }

 private:
  SOCKET socket_;
};

sockaddr_in ToSockaddr(const Address& address) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  result.sin_addr.s_addr = address.host;
  return result;
}

std::string TextOf(int error) {
  char text[256] = {};
  DWORD size = FormatMessageA(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, nullptr,
                              static_cast<DWORD>(error), 0, text, sizeof text, nullptr);
  while (size > 0 && (text[size - 1] == '\n' || text[size - 1] == '\r' || text[size - 1] == '.')) --size;
  return size == 0 ? absl::StrCat("error ", error) : std::string(text, size);
}

SocketFault FaultOf(int error) {
  SocketFault fault{.text = TextOf(error)};
  if (error == WSAEADDRINUSE) fault.kind = SocketFault::Kind::kInUse;
  if (error == WSAEADDRNOTAVAIL) fault.kind = SocketFault::Kind::kNoSuchAddress;
  if (error == WSAEACCES) fault.kind = SocketFault::Kind::kNoPrivilege;
  return fault;
}

void RaiseBuffer(SOCKET socket, int bytes, int option) {
  (void)setsockopt(socket, SOL_SOCKET, option, reinterpret_cast<const char*>(&bytes), sizeof bytes);
}

}  // namespace

std::optional<std::uint32_t> HostFrom(const std::string& text) {
  in_addr host{};
  if (inet_pton(AF_INET, text.c_str(), &host) != 1) return std::nullopt;
  return static_cast<std::uint32_t>(host.s_addr);
}

absl::StatusOr<std::uint32_t> LookUpHost(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    return absl::InvalidArgumentError(absl::StrCat("host ", host, ": ", TextOf(error)));
  }
  const auto result = static_cast<std::uint32_t>(reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr.s_addr);
  freeaddrinfo(found);
  return result;
}

std::optional<SocketFault> TryBind(const Address& address) {
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(address);
  if (probe.open() && bind(probe.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) return std::nullopt;
  return FaultOf(WSAGetLastError());
}

std::optional<SocketFault> TryRoute(const Address& to_address) {
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(to_address);
  if (probe.open() && connect(probe.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) {
    return std::nullopt;
  }
  return FaultOf(WSAGetLastError());
}

void ForgetFault() { WSASetLastError(0); }

SocketFault LastFault() {
  const int error = WSAGetLastError();
  return FaultOf(error != 0 ? error : WSAENOBUFS);
}

void RaiseBuffers(SystemSocket socket, int bytes) {
  RaiseBuffer(socket, bytes, SO_RCVBUF);
  RaiseBuffer(socket, bytes, SO_SNDBUF);
}

// ENet's sockets never wait.
void SendNow(SystemSocket socket, const Address& to, std::span<const std::uint8_t> bytes) {
  const sockaddr_in address = ToSockaddr(to);
  (void)sendto(socket, reinterpret_cast<const char*>(bytes.data()), static_cast<int>(bytes.size()), 0,
               reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

void SendNow(SystemSocket socket, std::span<OutgoingDatagram> datagrams) {
  assert(datagrams.size() <= kMaxSentAtOnce);
  for (const OutgoingDatagram& datagram : datagrams) {
    SendNow(socket, datagram.to, std::span(datagram.bytes).first(datagram.size));
  }
}

std::optional<std::uint32_t> KernelDrops(SystemSocket) { return std::nullopt; }
bool SetDropRules(SystemSocket, const DropRules&) { return false; }
void ClearDropRules(SystemSocket) {}

}  // namespace tessera::net

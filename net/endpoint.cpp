#include "net/endpoint.h"

#include <arpa/inet.h>
#include <enet/enet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <unordered_map>

#include "absl/strings/str_cat.h"

namespace tessera::net {
namespace {

constexpr enet_uint8 kReliableChannel = 0, kDatagramChannel = 1;
constexpr std::size_t kChannels = 2;
constexpr std::size_t kMaxPeers = 4095;  // ENet's ids have 12 bits
// The system's default of 208 KB holds 90 datagrams: one burst of full snapshots. Capped by net.core.rmem_max and
// wmem_max unless the process may exceed them.
constexpr int kSocketBufferBytes = 4 * 1024 * 1024;
// Reliable bytes on their way to one peer. ENet's 64 KB would make a large frame wait for a round trip of its own.
constexpr enet_uint32 kReliableWindowBytes = 512 * 1024;
// Messages of a peer that wait for an earlier one or for the caller, in units of the largest message.
constexpr std::size_t kWaitingMessages = 4;
constexpr std::size_t kMaxEventsPerService = 4096;
// A failing send to one peer makes ENet skip those after it; a few more rounds reach them.
constexpr int kMaxFailedRounds = 4;

bool InitializeEnet() {
  static const bool initialized = enet_initialize() == 0;  // never undone: other endpoints may live in static storage
  return initialized;
}

// Closes on scope exit.
class ProbeSocket {
 public:
  ProbeSocket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~ProbeSocket() {
    if (fd_ >= 0) close(fd_);
  }
  ProbeSocket(const ProbeSocket&) = delete;
  ProbeSocket& operator=(const ProbeSocket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

sockaddr_in ToSockaddr(const ENetAddress& address) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  result.sin_addr.s_addr = address.host;
  return result;
}

absl::Status BindError(int error, const EndpointOptions& options) {
  const std::string where = absl::StrCat("port ", options.port, " on ", options.bind_address);
  switch (error) {
    case EADDRINUSE:
      return absl::AlreadyExistsError(absl::StrCat(where, " is in use"));
    case EADDRNOTAVAIL:
      return absl::InvalidArgumentError(
          absl::StrCat("bind_address ", options.bind_address, " is not an address of this machine"));
    case EACCES:
      return absl::PermissionDeniedError(absl::StrCat(where, " needs privileges"));
    default:
      return absl::InternalError(absl::StrCat(where, ": ", std::strerror(error)));
  }
}

// ENet does not say why it could not bind, so the same bind is tried before.
absl::Status TryBind(const ENetAddress& address, const EndpointOptions& options) {
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(address);
  if (probe.fd() < 0 || bind(probe.fd(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    return BindError(errno, options);
  }
  return absl::OkStatus();
}

void RaiseSocketBuffer(ENetSocket socket, int forced_option, int option) {
  if (setsockopt(socket, SOL_SOCKET, forced_option, &kSocketBufferBytes, sizeof kSocketBufferBytes) == 0) return;
  setsockopt(socket, SOL_SOCKET, option, &kSocketBufferBytes, sizeof kSocketBufferBytes);
}

absl::StatusOr<ENetAddress> Resolve(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    return absl::InvalidArgumentError(absl::StrCat("host ", host, ": ", gai_strerror(error)));
  }
  ENetAddress address{};
  address.host = reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr.s_addr;
  address.port = port;
  freeaddrinfo(found);
  return address;
}

PeerHandle HandleOf(const ENetPeer& peer) { return PeerHandle(reinterpret_cast<std::uintptr_t>(peer.data)); }
void SetHandle(ENetPeer& peer, PeerHandle handle) {
  peer.data = reinterpret_cast<void*>(static_cast<std::uintptr_t>(handle.value()));
}

}  // namespace

struct Endpoint::Impl {
  struct Peer {
    ENetPeer* enet = nullptr;
    bool outgoing = false, connected = false;
    std::uint64_t bytes_sent = 0, bytes_received = 0;
  };

  EndpointOptions options;
  ENetHost* host = nullptr;
  std::uint16_t port = 0;
  std::uint64_t last_handle = 0;
  std::unordered_map<PeerHandle, Peer> peers;

  ~Impl() {
    if (host == nullptr) return;
    enet_host_flush(host);
    for (std::size_t i = 0; i < host->peerCount; ++i) enet_peer_disconnect_now(&host->peers[i], 0);
    enet_host_destroy(host);
  }

  PeerHandle Remember(ENetPeer& peer, bool outgoing) {
    const PeerHandle handle(++last_handle);
    SetHandle(peer, handle);
    peers[handle] = {.enet = &peer, .outgoing = outgoing};
    const auto timeout_ms = static_cast<enet_uint32>(options.peer_timeout.count());
    enet_peer_timeout(&peer, ENET_PEER_TIMEOUT_LIMIT, timeout_ms, timeout_ms);
    return handle;
  }

  void Forget(ENetPeer& peer) {
    peers.erase(HandleOf(peer));
    peer.data = nullptr;
  }

  // Each of these gives at most one event.
  void OnConnect(ENetPeer& peer, std::vector<Event>& out);
  void OnDisconnect(ENetPeer& peer, std::vector<Event>& out);
  void OnReceive(const ENetEvent& event, std::vector<Event>& out);
  void Handle(const ENetEvent& event, std::vector<Event>& out);
};

void Endpoint::Impl::OnConnect(ENetPeer& peer, std::vector<Event>& out) {
  if (peer.mtu < kMtuBytes) {  // the other side asked for less: datagrams would turn into reliable fragments
    enet_peer_disconnect_now(&peer, 0);
    OnDisconnect(peer, out);
    return;
  }
  PeerHandle handle = HandleOf(peer);
  if (handle == PeerHandle()) handle = Remember(peer, false);
  Peer& known = peers.at(handle);
  known.connected = true;
  // ENet drops unreliable packets when the round trip grows, by its measure even on one machine. No deceleration:
  // never.
  enet_peer_throttle_configure(&peer, ENET_PEER_PACKET_THROTTLE_INTERVAL, ENET_PEER_PACKET_THROTTLE_SCALE, 0);
  peer.packetThrottle = ENET_PEER_PACKET_THROTTLE_SCALE;
  peer.windowSize = kReliableWindowBytes;
  out.push_back({.kind = Event::Kind::kConnected, .peer = handle, .outgoing = known.outgoing});
}

void Endpoint::Impl::OnDisconnect(ENetPeer& peer, std::vector<Event>& out) {
  const PeerHandle handle = HandleOf(peer);
  if (handle == PeerHandle()) return;  // this side let go of it before
  out.push_back({.kind = Event::Kind::kDisconnected, .peer = handle, .outgoing = peers.at(handle).outgoing});
  Forget(peer);
}

void Endpoint::Impl::OnReceive(const ENetEvent& event, std::vector<Event>& out) {
  const std::span<const std::uint8_t> data(event.packet->data, event.packet->dataLength);
  const PeerHandle handle = HandleOf(*event.peer);
  // By flag, not by channel: the sender chooses the channel.
  const bool unsequenced = (event.packet->flags & ENET_PACKET_FLAG_RELIABLE) == 0;
  if (handle != PeerHandle()) {
    peers.at(handle).bytes_received += data.size();
    out.push_back({.kind = Event::Kind::kMessage,
                   .peer = handle,
                   .delivery = unsequenced ? Delivery::kUnsequenced : Delivery::kReliable,
                   .bytes = Bytes(data.begin(), data.end())});
  }
  enet_packet_destroy(event.packet);
}

void Endpoint::Impl::Handle(const ENetEvent& event, std::vector<Event>& out) {
  switch (event.type) {
    case ENET_EVENT_TYPE_CONNECT:
      return OnConnect(*event.peer, out);
    case ENET_EVENT_TYPE_DISCONNECT:
      return OnDisconnect(*event.peer, out);
    case ENET_EVENT_TYPE_RECEIVE:
      return OnReceive(event, out);
    case ENET_EVENT_TYPE_NONE:
      return;
  }
}

Endpoint::Endpoint(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Endpoint::~Endpoint() = default;

absl::StatusOr<std::unique_ptr<Endpoint>> Endpoint::Create(const EndpointOptions& options) {
  if (!InitializeEnet()) return absl::InternalError("ENet could not be initialised");
  if (options.max_peers < 1 || options.max_peers > kMaxPeers) {
    return absl::InvalidArgumentError(absl::StrCat("max_peers ", options.max_peers, ": 1 to ", kMaxPeers));
  }
  ENetAddress address{};
  address.port = options.port;
  if (inet_pton(AF_INET, options.bind_address.c_str(), &address.host) != 1) {
    return absl::InvalidArgumentError(absl::StrCat("bind_address ", options.bind_address, " is not an IPv4 address"));
  }
  if (const absl::Status status = TryBind(address, options); !status.ok()) return status;

  auto impl = std::make_unique<Impl>();
  impl->options = options;
  errno = 0;
  impl->host = enet_host_create(&address, options.max_peers, kChannels, 0, 0);
  if (impl->host == nullptr) return BindError(errno != 0 ? errno : ENOMEM, options);
  ENetHost& host = *impl->host;
  host.mtu = kMtuBytes;
  for (std::size_t i = 0; i < host.peerCount; ++i) host.peers[i].mtu = kMtuBytes;  // made with ENet's default
  host.checksum = enet_crc32;  // without one, damaged bytes that pass UDP's 16 bits are delivered
  host.duplicatePeers = options.max_peers_per_address == 0 ? options.max_peers : options.max_peers_per_address;
  host.maximumPacketSize = options.max_message_bytes;
  host.maximumWaitingData = kWaitingMessages * options.max_message_bytes;
  RaiseSocketBuffer(host.socket, SO_RCVBUFFORCE, SO_RCVBUF);
  RaiseSocketBuffer(host.socket, SO_SNDBUFFORCE, SO_SNDBUF);
  ENetAddress bound{};
  if (enet_socket_get_address(host.socket, &bound) != 0) return absl::InternalError("the socket has no address");
  impl->port = bound.port;
  return std::unique_ptr<Endpoint>(new Endpoint(std::move(impl)));
}

std::uint16_t Endpoint::port() const { return impl_->port; }

int Endpoint::socket() const { return impl_->host->socket; }

absl::StatusOr<PeerHandle> Endpoint::Connect(const std::string& host, std::uint16_t port) {
  if (port == 0) return absl::InvalidArgumentError("port 0: nobody can listen there");
  const absl::StatusOr<ENetAddress> address = Resolve(host, port);
  if (!address.ok()) return address.status();
  // Connecting a datagram socket sends nothing but asks for a route; a send without one would fail for all peers.
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(*address);
  if (probe.fd() < 0 || connect(probe.fd(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    return absl::UnavailableError(absl::StrCat(host, ":", port, ": ", std::strerror(errno)));
  }
  ENetPeer* peer = enet_host_connect(impl_->host, &*address, kChannels, 0);
  if (peer == nullptr) {
    return absl::ResourceExhaustedError(absl::StrCat("all ", impl_->options.max_peers, " peers are in use"));
  }
  return impl_->Remember(*peer, true);
}

absl::Status Endpoint::Send(PeerHandle peer, Delivery delivery, std::span<const std::uint8_t> bytes) {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end() || !found->second.connected) {
    return absl::NotFoundError(absl::StrCat("peer ", peer.value(), " is not connected"));
  }
  const bool reliable = delivery == Delivery::kReliable;
  const std::size_t limit = reliable ? impl_->options.max_message_bytes : kMaxDatagramBytes;
  if (bytes.size() > limit) {
    return absl::InvalidArgumentError(absl::StrCat("message of ", bytes.size(), " bytes; at most ", limit));
  }
  ENetPacket* packet = enet_packet_create(bytes.data(), bytes.size(),
                                          reliable ? ENET_PACKET_FLAG_RELIABLE : ENET_PACKET_FLAG_UNSEQUENCED);
  if (packet == nullptr) return absl::ResourceExhaustedError("no memory for a message");
  if (enet_peer_send(found->second.enet, reliable ? kReliableChannel : kDatagramChannel, packet) != 0) {
    enet_packet_destroy(packet);
    return absl::NotFoundError(absl::StrCat("peer ", peer.value(), " is going away"));
  }
  found->second.bytes_sent += bytes.size();
  return absl::OkStatus();
}

void Endpoint::Flush() { enet_host_flush(impl_->host); }

std::vector<Event> Endpoint::Service(std::chrono::milliseconds timeout) {
  std::vector<Event> out;
  auto wait_ms = static_cast<enet_uint32>(std::max<std::int64_t>(timeout.count(), 0));
  int failed_rounds = 0;
  while (out.size() < kMaxEventsPerService) {
    ENetEvent event{};
    const int result = enet_host_service(impl_->host, &event, wait_ms);
    wait_ms = 0;
    if (result < 0 && ++failed_rounds <= kMaxFailedRounds) continue;
    if (result <= 0) break;
    do {
      impl_->Handle(event, out);
    } while (out.size() < kMaxEventsPerService && enet_host_check_events(impl_->host, &event) > 0);
  }
  return out;
}

void Endpoint::Disconnect(PeerHandle peer) {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return;
  ENetPeer& enet = *found->second.enet;
  impl_->Forget(enet);
  enet_peer_disconnect_later(&enet, 0);
}

std::size_t Endpoint::connections() const {
  const std::span<const ENetPeer> peers(impl_->host->peers, impl_->host->peerCount);
  return static_cast<std::size_t>(std::count_if(
      peers.begin(), peers.end(), [](const ENetPeer& peer) { return peer.state != ENET_PEER_STATE_DISCONNECTED; }));
}

PeerStats Endpoint::StatsOf(PeerHandle peer) const {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return {};
  const Impl::Peer& known = found->second;
  return {.round_trip = std::chrono::milliseconds(known.enet->roundTripTime),
          .bytes_sent = known.bytes_sent,
          .bytes_received = known.bytes_received};
}

std::string Endpoint::AddressOf(PeerHandle peer) const {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return {};
  char text[INET_ADDRSTRLEN] = {};
  const ENetAddress& address = found->second.enet->address;
  inet_ntop(AF_INET, &address.host, text, sizeof text);
  return absl::StrCat(text, ":", address.port);
}

}  // namespace tessera::net

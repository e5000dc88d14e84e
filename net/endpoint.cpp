#include "net/endpoint.h"

#include <arpa/inet.h>
#include <enet/enet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "net/enet_seam.h"

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
// ENet looks at so many datagrams a call; where strangers sent them all, it is called again, but not for ever.
constexpr std::size_t kDatagramsPerRound = 256, kMaxDatagramsPerService = 8192;
// How often peers that ENet let go of are looked for.
constexpr std::chrono::milliseconds kSweepInterval{50};

using Clock = std::chrono::steady_clock;

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
    ENetPeer* enet = nullptr;  // none while the other side's door has not opened
    SessionNumber session{};
    bool outgoing = false, connected = false;
    Clock::time_point dial_until{};
    std::uint64_t bytes_sent = 0, bytes_received = 0;
  };
  // An ENet connection and the session that it lies in. ENet's peer may outlive its handle, to say farewell.
  struct Connection {
    SessionNumber session;
    ENetPeer* enet = nullptr;
  };

  explicit Impl(const EndpointOptions& options_in)
      : options(options_in),
        door({.max_sessions = options_in.max_peers,
              .max_per_address =
                  options_in.max_peers_per_address == 0 ? options_in.max_peers : options_in.max_peers_per_address}) {}
  ~Impl();

  EndpointOptions options;
  ENetHost* host = nullptr;
  std::uint16_t port = 0;
  std::uint64_t last_handle = 0;
  std::unordered_map<PeerHandle, Peer> peers;
  Door door;
  std::unordered_map<std::uint32_t, Connection> connections;  // by ENet's connectID
  std::unordered_map<std::uint32_t, std::uint32_t> connection_of_session;
  std::vector<Event> pending;  // of dials that failed
  std::array<std::uint8_t, ENET_PROTOCOL_MAXIMUM_MTU + kSealHeaderBytes + kSealTagBytes> sealed{};
  Clock::time_point sweep_at{};
  bool peer_gone = false;  // since the last sweep

  // ENet's callbacks have no argument of ours; every call into ENet is made under a Call.
  static thread_local Impl* current;
  class Call {
   public:
    explicit Call(Impl& impl) : before_(std::exchange(current, &impl)) {}
    ~Call() { current = before_; }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

   private:
    Impl* before_;
  };
  static int ENET_CALLBACK Intercept(ENetHost* host, ENetEvent* event);
  static enet_uint32 ENET_CALLBACK Checksum(const ENetBuffer* buffers, std::size_t count);

  PeerHandle NewHandle(bool outgoing, SessionNumber session) {
    const PeerHandle handle(++last_handle);
    peers[handle] = {.session = session, .outgoing = outgoing};
    return handle;
  }
  void Attach(PeerHandle handle, ENetPeer& enet) {
    peers.at(handle).enet = &enet;
    SetHandle(enet, handle);
    SetTimeout(enet);
  }
  void SetTimeout(ENetPeer& enet) const {
    const auto timeout_ms = static_cast<enet_uint32>(options.peer_timeout.count());
    enet_peer_timeout(&enet, ENET_PEER_TIMEOUT_LIMIT, timeout_ms, timeout_ms);
  }
  void Forget(ENetPeer& peer) {
    peers.erase(HandleOf(peer));
    peer.data = nullptr;
  }

  // The door's side.
  bool TakeDatagram(ENetEvent* event);
  bool HandToEnet(const Door::Received& received);
  void StartEnet(SessionNumber session);
  void EndDial(SessionNumber session, std::optional<Refusal> refusal);
  void Send(const Address& to, std::span<const std::uint8_t> bytes) const;
  void Remember(SessionNumber session, std::uint32_t connection, ENetPeer* enet);
  void ForgetSession(SessionNumber session);
  void Seal();
  void Progress(Clock::time_point now);
  void Sweep();
  void Take(std::chrono::milliseconds wait, std::vector<Event>& out);

  // Each of these gives at most one event.
  void OnConnect(ENetPeer& peer, std::vector<Event>& out);
  void OnDisconnect(ENetPeer& peer, std::vector<Event>& out);
  void OnReceive(const ENetEvent& event, std::vector<Event>& out);
  void Handle(const ENetEvent& event, std::vector<Event>& out);
};

thread_local Endpoint::Impl* Endpoint::Impl::current = nullptr;

Endpoint::Impl::~Impl() {
  if (host == nullptr) return;
  const Call call(*this);
  enet_host_flush(host);
  for (ENetPeer& peer : std::span(host->peers, host->peerCount)) {
    // To one that has not answered there is nobody to say farewell to.
    if (peer.state == ENET_PEER_STATE_CONNECTING) {
      enet_peer_reset(&peer);
    } else {
      enet_peer_disconnect_now(&peer, 0);
    }
  }
  enet_host_destroy(host);
}

// --- The door --------------------------------------------------------------------------------------------------------

int Endpoint::Impl::Intercept(ENetHost*, ENetEvent* event) { return current->TakeDatagram(event) ? 0 : 1; }

enet_uint32 Endpoint::Impl::Checksum(const ENetBuffer* buffers, std::size_t count) {
  if (buffers == current->host->buffers) {
    current->Seal();
    return 0;  // goes nowhere
  }
  // What ENet received. It has put in the field which connection the datagram ought to be of.
  (void)count;
  return FieldOf({static_cast<const std::uint8_t*>(buffers->data), buffers->dataLength});
}

// False: it is not for ENet.
bool Endpoint::Impl::TakeDatagram(ENetEvent* event) {
  const Address from{host->receivedAddress.host, host->receivedAddress.port};
  const auto unix_s = static_cast<std::uint64_t>(std::time(nullptr));
  if (peer_gone) Sweep();  // whoever comes may have its place
  const Door::Received received =
      door.Receive(Clock::now(), unix_s, from, {host->receivedData, host->receivedDataLength});
  switch (received.kind) {
    case Door::Received::Kind::kNothing:
      return false;
    case Door::Received::Kind::kReply:
      Send(from, received.bytes);
      return false;
    case Door::Received::Kind::kPayload:
      return HandToEnet(received);
    case Door::Received::Kind::kDialled:
      StartEnet(received.session);
      return false;
    case Door::Received::Kind::kRefused:
      EndDial(received.session, door.RefusalOf(received.session));
      // Ends the wait that ENet may be in: `Handle` knows an event of no peer.
      if (event != nullptr) event->type = ENET_EVENT_TYPE_DISCONNECT;
      return false;
  }
  return false;
}

bool Endpoint::Impl::HandToEnet(const Door::Received& received) {
  const Inner kind = Inspect(received.bytes, door.IsDialled(received.session));
  auto known = connection_of_session.find(received.session.value());
  if (kind == Inner::kRefused) return false;
  if (kind == Inner::kConnect) {
    // One connection a session; ENet says again itself what got lost of its answer.
    if (known != connection_of_session.end()) return false;
    Remember(received.session, ++host->randomSeed, nullptr);
    known = connection_of_session.find(received.session.value());
  }
  if (known == connection_of_session.end()) return false;
  const std::span<std::uint8_t> datagram = Restore(received.bytes, kind, known->second);
  host->receivedData = datagram.data();
  host->receivedDataLength = datagram.size();
  return true;
}

void Endpoint::Impl::Remember(SessionNumber session, std::uint32_t connection, ENetPeer* enet) {
  connections[connection] = {.session = session, .enet = enet};
  connection_of_session[session.value()] = connection;
}

void Endpoint::Impl::ForgetSession(SessionNumber session) {
  door.Forget(session);
  const auto found = connection_of_session.find(session.value());
  if (found == connection_of_session.end()) return;
  connections.erase(found->second);
  connection_of_session.erase(found);
}

void Endpoint::Impl::StartEnet(SessionNumber session) {
  const auto dial =
      std::find_if(peers.begin(), peers.end(), [&](const auto& p) { return p.second.session == session; });
  const Address& to = door.AddressOf(session);
  const ENetAddress address{.host = to.host, .port = to.port};
  ENetPeer* enet = dial == peers.end() ? nullptr : enet_host_connect(host, &address, kChannels, 0);
  if (enet == nullptr) return EndDial(session, std::nullopt);
  enet->packetThrottleInterval = kThrottleInterval_ms;  // the other side puts the same into its answer
  enet->packetThrottleAcceleration = kThrottleAcceleration;
  enet->packetThrottleDeceleration = kThrottleDeceleration;
  Attach(dial->first, *enet);
  Remember(session, enet->connectID, enet);
}

void Endpoint::Impl::EndDial(SessionNumber session, std::optional<Refusal> refusal) {
  ForgetSession(session);
  const auto dial =
      std::find_if(peers.begin(), peers.end(), [&](const auto& p) { return p.second.session == session; });
  if (dial == peers.end()) return;
  pending.push_back(
      {.kind = Event::Kind::kDisconnected, .peer = dial->first, .outgoing = true, .refusal = std::move(refusal)});
  peers.erase(dial);
}

void Endpoint::Impl::Send(const Address& to, std::span<const std::uint8_t> bytes) const {
  const sockaddr_in address = ToSockaddr({.host = to.host, .port = to.port});
  // Lost where the socket is full, like any datagram; whoever waits for it asks again.
  (void)sendto(host->socket, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

// Puts the sealed datagram in the place of the one that ENet is about to send.
void Endpoint::Impl::Seal() {
  const std::span<const ENetBuffer> buffers(host->buffers, host->bufferCount);
  const auto found = connections.find(ConnectionOf(buffers));
  std::size_t bytes = 0;
  if (found != connections.end() && door.Has(found->second.session)) {
    const std::span<std::uint8_t> room(sealed.data() + kSealHeaderBytes,
                                       sealed.size() - kSealHeaderBytes - kSealTagBytes);
    bytes = Gather(buffers, room);
    if (bytes > 0) bytes = door.Seal(found->second.session, sealed, bytes);
  }
  host->buffers[0].data = sealed.data();
  host->buffers[0].dataLength = bytes;  // 0, of a connection that is no more: an empty datagram
  host->bufferCount = 1;
}

void Endpoint::Impl::Progress(Clock::time_point now) {
  for (const Door::Outgoing& out : door.Due(now)) Send(out.to, out.bytes);
  if (now < sweep_at) return;
  sweep_at = now + kSweepInterval;
  Sweep();
  std::vector<SessionNumber> late;
  for (const auto& [handle, peer] : peers) {
    if (peer.enet == nullptr && now >= peer.dial_until) late.push_back(peer.session);
  }
  for (const SessionNumber session : late) EndDial(session, std::nullopt);
}

// Ends the sessions whose ENet peer is gone, and those that the door ended.
void Endpoint::Impl::Sweep() {
  peer_gone = false;
  for (ENetPeer& enet : std::span(host->peers, host->peerCount)) {
    if (enet.state == ENET_PEER_STATE_DISCONNECTED || enet.data != nullptr) continue;
    const auto found = connections.find(enet.connectID);
    if (found == connections.end() && enet.state == ENET_PEER_STATE_ACKNOWLEDGING_CONNECT) enet_peer_reset(&enet);
    if (found == connections.end() || found->second.enet != nullptr) continue;
    found->second.enet = &enet;
    SetTimeout(enet);  // ENet's own lets one that does not answer keep its place for half a minute
  }
  std::vector<SessionNumber> ended;
  for (const auto& [number, connection] : connections) {
    const ENetPeer* enet = connection.enet;
    const bool gone = enet != nullptr && (enet->state == ENET_PEER_STATE_DISCONNECTED || enet->connectID != number);
    if (gone || !door.Has(connection.session)) ended.push_back(connection.session);
  }
  for (const SessionNumber session : ended) ForgetSession(session);
}

// --- ENet's events ---------------------------------------------------------------------------------------------------

void Endpoint::Impl::OnConnect(ENetPeer& peer, std::vector<Event>& out) {
  const auto connection = connections.find(peer.connectID);
  // The other side asked for less: datagrams would turn into reliable fragments. Or its session has ended meanwhile.
  if (peer.mtu < kMtuBytes || connection == connections.end() || !door.Has(connection->second.session)) {
    enet_peer_disconnect_now(&peer, 0);
    OnDisconnect(peer, out);
    return;
  }
  const SessionNumber session = connection->second.session;
  connection->second.enet = &peer;
  PeerHandle handle = HandleOf(peer);
  Event event{.kind = Event::Kind::kConnected};
  if (handle == PeerHandle()) {
    door.Settle(session);
    handle = NewHandle(false, session);
    Attach(handle, peer);
    event.who = door.TokenOf(session);
  }
  Peer& known = peers.at(handle);
  known.connected = true;
  peer.packetThrottle = ENET_PEER_PACKET_THROTTLE_SCALE;
  peer.windowSize = kReliableWindowBytes;
  event.peer = handle;
  event.outgoing = known.outgoing;
  out.push_back(std::move(event));
}

void Endpoint::Impl::OnDisconnect(ENetPeer& peer, std::vector<Event>& out) {
  peer_gone = true;
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
  if (event.peer == nullptr) return;  // only woke us
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

  auto impl = std::make_unique<Impl>(options);
  errno = 0;
  impl->host = enet_host_create(&address, options.max_peers, kChannels, 0, 0);
  if (impl->host == nullptr) return BindError(errno != 0 ? errno : ENOMEM, options);
  ENetHost& host = *impl->host;
  host.mtu = kMtuBytes;
  for (std::size_t i = 0; i < host.peerCount; ++i) host.peers[i].mtu = kMtuBytes;  // made with ENet's default
  host.checksum = &Impl::Checksum;
  host.intercept = &Impl::Intercept;
  host.duplicatePeers = options.max_peers;  // the door counts
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

void Endpoint::Open(Doorplate plate) { impl_->door.Open(std::move(plate)); }
void Endpoint::Close(std::string why) { impl_->door.Close(std::move(why)); }

absl::StatusOr<PeerHandle> Endpoint::Connect(const std::string& host, std::uint16_t port, RegionId region,
                                             Credentials credentials) {
  if (port == 0) return absl::InvalidArgumentError("port 0: nobody can listen there");
  const absl::StatusOr<ENetAddress> address = Resolve(host, port);
  if (!address.ok()) return address.status();
  // Connecting a datagram socket sends nothing but asks for a route; a send without one would fail for all peers.
  const ProbeSocket probe;
  const sockaddr_in to = ToSockaddr(*address);
  if (probe.fd() < 0 || connect(probe.fd(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    return absl::UnavailableError(absl::StrCat(host, ":", port, ": ", std::strerror(errno)));
  }
  const Clock::time_point now = Clock::now();
  impl_->Sweep();
  const std::optional<SessionNumber> session =
      impl_->door.Dial(now, {.host = address->host, .port = port}, region, std::move(credentials));
  if (!session) {
    return absl::ResourceExhaustedError(absl::StrCat("all ", impl_->options.max_peers, " peers are in use"));
  }
  const PeerHandle handle = impl_->NewHandle(true, *session);
  impl_->peers.at(handle).dial_until = now + impl_->options.peer_timeout;
  impl_->Progress(now);
  return handle;
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

void Endpoint::Flush() {
  const Impl::Call call(*impl_);
  enet_host_flush(impl_->host);
}

std::vector<Event> Endpoint::Service(std::chrono::milliseconds timeout) {
  const Impl::Call call(*impl_);
  std::vector<Event> out;
  const Clock::time_point until = Clock::now() + std::max(timeout, std::chrono::milliseconds(0));
  for (;;) {
    const Clock::time_point now = Clock::now();
    impl_->Progress(now);
    Clock::time_point wake = until;
    if (const auto due = impl_->door.next_due()) wake = std::min(wake, *due);
    const bool idle = out.empty() && impl_->pending.empty();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(wake - now);
    impl_->Take(idle ? std::max(wait, std::chrono::milliseconds(0)) : std::chrono::milliseconds(0), out);
    out.insert(out.end(), std::make_move_iterator(impl_->pending.begin()),
               std::make_move_iterator(impl_->pending.end()));
    impl_->pending.clear();
    if (!out.empty() || Clock::now() >= until) return out;
  }
}

// What there is, up to a limit; waits for the first datagram.
void Endpoint::Impl::Take(std::chrono::milliseconds wait, std::vector<Event>& out) {
  auto wait_ms = static_cast<enet_uint32>(wait.count());
  int failed_rounds = 0;
  const enet_uint32 begin = host->totalReceivedPackets;
  while (out.size() < kMaxEventsPerService) {
    ENetEvent event{};
    const enet_uint32 before = host->totalReceivedPackets;
    const int result = enet_host_service(host, &event, std::exchange(wait_ms, 0));
    if (result < 0 && ++failed_rounds <= kMaxFailedRounds) continue;
    if (result < 0) break;
    const bool more = host->totalReceivedPackets - before >= kDatagramsPerRound &&
                      host->totalReceivedPackets - begin < kMaxDatagramsPerService;
    if (result == 0 && !more) break;
    if (result == 0) continue;
    do {
      Handle(event, out);
    } while (out.size() < kMaxEventsPerService && enet_host_check_events(host, &event) > 0);
  }
}

void Endpoint::Disconnect(PeerHandle peer) {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return;
  const Impl::Call call(*impl_);
  if (found->second.enet == nullptr) {  // nobody has let us in yet
    impl_->ForgetSession(found->second.session);
    impl_->peers.erase(found);
    return;
  }
  ENetPeer& enet = *found->second.enet;
  impl_->Forget(enet);
  if (enet.state == ENET_PEER_STATE_CONNECTING) {
    enet_peer_reset(&enet);
  } else {
    enet_peer_disconnect_later(&enet, 0);
  }
}

std::size_t Endpoint::connections() const {
  const std::span<const ENetPeer> enet(impl_->host->peers, impl_->host->peerCount);
  const auto dials = std::count_if(impl_->peers.begin(), impl_->peers.end(),
                                   [](const auto& peer) { return peer.second.enet == nullptr; });
  return static_cast<std::size_t>(dials + std::count_if(enet.begin(), enet.end(), [](const ENetPeer& peer) {
                                    return peer.state != ENET_PEER_STATE_DISCONNECTED;
                                  }));
}

PeerStats Endpoint::StatsOf(PeerHandle peer) const {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return {};
  const Impl::Peer& known = found->second;
  return {.round_trip = std::chrono::milliseconds(known.connected ? known.enet->roundTripTime : 0),
          .bytes_sent = known.bytes_sent,
          .bytes_received = known.bytes_received};
}

std::string Endpoint::AddressOf(PeerHandle peer) const {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return {};
  const SessionNumber session = found->second.session;
  return impl_->door.Has(session) ? ToText(impl_->door.AddressOf(session)) : std::string();
}

const DoorStats& Endpoint::door_stats() const { return impl_->door.stats(); }

}  // namespace tessera::net

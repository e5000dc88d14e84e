#include "net/endpoint.h"

#include <enet/enet.h>
#include <enet/time.h>

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "net/endpoint_impl.h"
#include "net/sockets.h"

namespace tessera::net {
namespace {

constexpr enet_uint8 kChannel = 0;
constexpr std::size_t kMaxPeers = 4095;  // ENet's ids have 12 bits
// The system's default of 208 KB holds 90 datagrams: one burst of full snapshots. Capped by net.core.rmem_max and
// wmem_max unless the process may exceed them.
constexpr int kSocketBufferBytes = 4 * 1024 * 1024;
// Reliable bytes on their way to one peer. With ENet's 64 KB a large frame would wait for a round trip of its own.
constexpr enet_uint32 kReliableWindowBytes = 512 * 1024;
// Messages of a peer that may wait for an earlier one or for the caller, in units of the largest message.
constexpr std::size_t kWaitingMessages = 4;
constexpr std::size_t kMaxEventsPerService = 4096;
// A failing send to one peer makes ENet skip those after it; a few more rounds reach them.
constexpr int kMaxFailedRounds = 4;
// ENet looks at so many datagrams a call. Where unproven peers sent them all it is called again, but not for ever.
constexpr std::size_t kDatagramsPerRound = 256;

bool InitializeEnet() {
  static const bool initialized = enet_initialize() == 0;  // never undone: other endpoints may live in static storage
  return initialized;
}

absl::Status BindError(const SocketFault& fault, const EndpointOptions& options) {
  const std::string where = absl::StrCat("port ", options.port, " on ", options.bind_address);
  switch (fault.kind) {
    case SocketFault::Kind::kInUse:
      return absl::AlreadyExistsError(absl::StrCat(where, " is in use"));
    case SocketFault::Kind::kNoSuchAddress:
      return absl::InvalidArgumentError(
          absl::StrCat("bind_address ", options.bind_address, " is not an address of this machine"));
    case SocketFault::Kind::kNoPrivilege:
      return absl::PermissionDeniedError(absl::StrCat(where, " needs privileges"));
    case SocketFault::Kind::kOther:
      break;
  }
  return absl::InternalError(absl::StrCat(where, ": ", fault.text));
}

}  // namespace

Endpoint::Impl::~Impl() {
  if (host == nullptr) return;
  const Call call(*this);
  enet_host_flush(host);
  if (outbox) outbox->Send();
  for (ENetPeer& peer : std::span(host->peers, host->peerCount)) {
    // A peer that has not answered has nothing to disconnect.
    if (peer.state == ENET_PEER_STATE_CONNECTING) {
      enet_peer_reset(&peer);
    } else {
      enet_peer_disconnect_now(&peer, 0);
    }
  }
  enet_host_destroy(host);
}

// --- ENet's events ---------------------------------------------------------------------------------------------------

void Endpoint::Impl::OnConnect(ENetPeer& peer, std::vector<Event>& out) {
  const auto connection = connections.find(peer.connectID);
  // The other side asked for a smaller MTU, so datagrams would turn into reliable fragments; or its session has ended.
  if (peer.mtu < kMtuBytes || connection == connections.end() || !acceptor.Has(connection->second.session)) {
    enet_peer_disconnect_now(&peer, 0);
    OnDisconnect(peer, out);
    return;
  }
  const SessionNumber session = connection->second.session;
  connection->second.enet = &peer;
  PeerHandle handle = HandleOf(peer);
  Event event{.kind = Event::Kind::kConnected};
  if (handle == PeerHandle()) {
    acceptor.Settle(session);
    handle = NewHandle(false, session);
    Attach(handle, peer);
    event.who = acceptor.WhoIs(session);
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
  TakePending(out);                    // messages that it sent before
  out.push_back({.kind = Event::Kind::kDisconnected, .peer = handle, .outgoing = peers.at(handle).outgoing});
  Forget(peer);
}

void Endpoint::Impl::OnReceive(const ENetEvent& event, std::vector<Event>& out) {
  const std::span<const std::uint8_t> data(event.packet->data, event.packet->dataLength);
  const PeerHandle handle = HandleOf(*event.peer);
  if (handle != PeerHandle()) {
    peers.at(handle).bytes_received += data.size();
    out.push_back({.kind = Event::Kind::kMessage,
                   .peer = handle,
                   .delivery = Delivery::kReliable,
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
  const std::optional<std::uint32_t> bind_to = HostFrom(options.bind_address);
  if (!bind_to) {
    return absl::InvalidArgumentError(absl::StrCat("bind_address ", options.bind_address, " is not an IPv4 address"));
  }
  // ENet does not say why it could not bind, so the same bind is tried before.
  if (const auto fault = TryBind({.host = *bind_to, .port = options.port})) return BindError(*fault, options);

  auto impl = std::make_unique<Impl>(options);
  ForgetFault();
  const ENetAddress address{.host = *bind_to, .port = options.port};
  impl->host = enet_host_create(&address, options.max_peers, kChannels, 0, 0);
  if (impl->host == nullptr) return BindError(LastFault(), options);
  ENetHost& host = *impl->host;
  host.mtu = kMtuBytes;
  for (std::size_t i = 0; i < host.peerCount; ++i) host.peers[i].mtu = kMtuBytes;  // made with ENet's default
  host.checksum = &Impl::Checksum;
  host.intercept = &Impl::Intercept;
  host.duplicatePeers = options.max_peers;  // the acceptor counts them
  host.maximumPacketSize = options.max_message_bytes;
  host.maximumWaitingData = kWaitingMessages * options.max_message_bytes;
  RaiseBuffers(host.socket, kSocketBufferBytes);
  ENetAddress bound{};
  if (enet_socket_get_address(host.socket, &bound) != 0) return absl::InternalError("the socket has no address");
  impl->port = bound.port;
  impl->outbox.emplace(host.socket);
  impl->flood_filter.emplace(host.socket);
  return std::unique_ptr<Endpoint>(new Endpoint(std::move(impl)));
}

std::uint16_t Endpoint::port() const { return impl_->port; }

SystemSocket Endpoint::socket() const { return impl_->host->socket; }

void Endpoint::Open(EndpointIdentity identity) {
  impl_->flood_filter->Open(KnockOf(identity.instance_key));
  impl_->acceptor.Open(std::move(identity));
}
void Endpoint::Close(std::string why) { impl_->acceptor.Close(std::move(why)); }

absl::StatusOr<PeerHandle> Endpoint::Connect(const std::string& host, std::uint16_t port, RegionId region,
                                             Incarnation least, Credentials credentials) {
  if (port == 0) return absl::InvalidArgumentError("port 0: nobody can listen there");
  const absl::StatusOr<std::uint32_t> found = LookUpHost(host);
  if (!found.ok()) return found.status();
  const Address address{.host = *found, .port = port};
  // Connecting a datagram socket sends nothing but asks for a route; a send without one would fail for all peers.
  if (const auto fault = TryRoute(address)) {
    return absl::UnavailableError(absl::StrCat(host, ":", port, ": ", fault->text));
  }
  const Impl::Clock::time_point now = Impl::Clock::now();
  impl_->Sweep();
  const std::optional<SessionNumber> session =
      impl_->acceptor.Dial(now, address, region, least, std::move(credentials));
  if (!session) {
    return absl::ResourceExhaustedError(absl::StrCat("all ", impl_->options.max_peers, " peers are in use"));
  }
  const PeerHandle handle = impl_->NewHandle(true, *session);
  impl_->peers.at(handle).dial_until = now + impl_->options.peer_timeout;
  impl_->Progress(now);
  return handle;
}

bool Endpoint::Impl::SendReliable(ENetPeer& peer, std::span<const std::uint8_t> bytes) {
  ENetPacket* packet = enet_packet_create(bytes.data(), bytes.size(), ENET_PACKET_FLAG_RELIABLE);
  if (packet == nullptr) return false;
  if (enet_peer_send(&peer, kChannel, packet) == 0) return true;
  enet_packet_destroy(packet);
  return false;
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
  if (!(reliable ? impl_->SendReliable(*found->second.enet, bytes) : impl_->SendDirect(found->second, bytes))) {
    return absl::NotFoundError(absl::StrCat("peer ", peer.value(), " is going away"));
  }
  found->second.bytes_sent += bytes.size();
  return absl::OkStatus();
}

void Endpoint::Flush() {
  const Impl::Call call(*impl_);
  enet_host_flush(impl_->host);  // first, because reliable messages may announce what the datagrams refer to
  impl_->outbox->Send();
}

std::vector<Event> Endpoint::Service(std::chrono::milliseconds timeout) {
  if (!impl_->outbox->empty()) Flush();
  const Impl::Call call(*impl_);
  std::vector<Event> out;
  const Impl::Clock::time_point until = Impl::Clock::now() + std::max(timeout, std::chrono::milliseconds(0));
  for (;;) {
    const Impl::Clock::time_point now = Impl::Clock::now();
    impl_->Progress(now);
    Impl::Clock::time_point wake = until;
    if (const auto due = impl_->acceptor.next_due()) wake = std::min(wake, *due);
    const bool idle = out.empty() && impl_->pending.empty();
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(wake - now);
    impl_->Take(idle ? std::max(wait, std::chrono::milliseconds(0)) : std::chrono::milliseconds(0), out);
    impl_->TakePending(out);
    if (!out.empty() || Impl::Clock::now() >= until) return out;
  }
}

void Endpoint::Impl::TakePending(std::vector<Event>& out) {
  out.insert(out.end(), std::make_move_iterator(pending.begin()), std::make_move_iterator(pending.end()));
  pending.clear();
}

// Takes the events that there are, up to a limit; waits for the first datagram.
void Endpoint::Impl::Take(std::chrono::milliseconds wait, std::vector<Event>& out) {
  auto wait_ms = static_cast<enet_uint32>(wait.count());
  int failed_rounds = 0;
  const enet_uint32 begin = host->totalReceivedPackets;
  const std::size_t most = options.datagrams_per_service + options.datagrams_per_peer * acceptor.sessions();
  while (out.size() < kMaxEventsPerService) {
    ENetEvent event{};
    const enet_uint32 before = host->totalReceivedPackets;
    // No bandwidth limits are set, and a peer that is sent them cuts its window to ENet's own.
    host->recalculateBandwidthLimits = 0;
    waiting = wait_ms > 0;
    const int result = enet_host_service(host, &event, std::exchange(wait_ms, 0));
    if (result < 0 && ++failed_rounds <= kMaxFailedRounds) continue;
    if (result < 0) break;
    if (result == 0 && host->totalReceivedPackets - before < kDatagramsPerRound) break;
    if (result > 0) {
      do {
        Handle(event, out);
      } while (out.size() < kMaxEventsPerService && enet_host_check_events(host, &event) > 0);
    }
    if (host->totalReceivedPackets - begin >= most) {
      ++receive_stats.cut_short;
      break;
    }
  }
}

void Endpoint::Disconnect(PeerHandle peer) {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return;
  const Impl::Call call(*impl_);
  if (found->second.enet == nullptr) {  // not accepted yet
    impl_->ForgetSession(found->second.session);
    impl_->Erase(peer);
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

void Endpoint::NoteRefused(PeerHandle peer, bool floods) {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end() || found->second.outgoing || !impl_->acceptor.Has(found->second.session)) return;
  const Impl::Clock::time_point now = Impl::Clock::now();
  const SessionNumber session = found->second.session;
  impl_->acceptor.NoteRefused(now, session, floods);
  if (floods) impl_->flood_filter->ShutOut(now, impl_->acceptor.AddressOf(session));
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
          .heard_ago = std::chrono::milliseconds(
              known.connected ? ENET_TIME_DIFFERENCE(enet_time_get(), known.enet->lastReceiveTime) : 0),
          .bytes_sent = known.bytes_sent,
          .bytes_received = known.bytes_received,
          .parts_sent = known.connected ? known.enet->packetsSent : 0,
          .parts_resent = known.connected ? known.enet->packetsLost : 0};
}

std::string Endpoint::AddressOf(PeerHandle peer) const {
  const auto found = impl_->peers.find(peer);
  if (found == impl_->peers.end()) return {};
  const SessionNumber session = found->second.session;
  return impl_->acceptor.Has(session) ? ToText(impl_->acceptor.AddressOf(session)) : std::string();
}

const AcceptorStats& Endpoint::acceptor_stats() const { return impl_->acceptor.stats(); }
const ReceiveStats& Endpoint::receive_stats() const { return impl_->receive_stats; }
bool Endpoint::flooded() const { return impl_->flood_filter->active(); }

}  // namespace tessera::net

// Between ENet and the acceptor: received datagrams are opened, sent ones are sealed, sessions begin and end.
#include <algorithm>
#include <array>

#include "net/endpoint_impl.h"
#include "net/enet_adapter.h"
#include "net/sockets.h"

namespace tessera::net {
namespace {

// Time between two searches for peers that ENet let go of.
constexpr std::chrono::milliseconds kSweepInterval{50};

// Ends the wait that ENet may be in: `Handle` ignores an event without a peer.
void EndWait(ENetEvent* event) {
  if (event != nullptr) event->type = ENET_EVENT_TYPE_DISCONNECT;
}

}  // namespace

thread_local Endpoint::Impl* Endpoint::Impl::current = nullptr;

int Endpoint::Impl::Intercept(ENetHost*, ENetEvent* event) { return current->TakeDatagram(event) ? 0 : 1; }

enet_uint32 Endpoint::Impl::Checksum(const ENetBuffer* buffers, std::size_t count) {
  if (buffers == current->host->buffers) {
    current->Seal();
    return 0;  // Seal has replaced the buffers, so nobody reads it
  }
  // A received datagram. ENet has put the connection that the datagram ought to belong to into the field.
  (void)count;
  return FieldOf({static_cast<const std::uint8_t*>(buffers->data), buffers->dataLength});
}

// Returns false if the datagram is not for ENet.
bool Endpoint::Impl::TakeDatagram(ENetEvent* event) {
  const Address from{host->receivedAddress.host, host->receivedAddress.port};
  if (peer_gone) Sweep();  // a new peer may take its place
  const Acceptor::Received received =
      acceptor.Receive(Clock::now(), from, {host->receivedData, host->receivedDataLength});
  switch (received.kind) {
    case Acceptor::Received::Kind::kNothing:
      return false;
    case Acceptor::Received::Kind::kReply:
      Send(from, received.bytes);
      return false;
    case Acceptor::Received::Kind::kPayload:
      return HandToEnet(received);
    case Acceptor::Received::Kind::kDirect:
      TakeDirect(received, event);
      return false;
    case Acceptor::Received::Kind::kDialled:
      StartEnet(received.session);
      return false;
    case Acceptor::Received::Kind::kRefused:
      EndDial(received.session, acceptor.RefusalOf(received.session));
      EndWait(event);
      return false;
    case Acceptor::Received::Kind::kFloods:
      if (const std::optional<PeerHandle> handle = PeerOf(received.session)) {
        pending.push_back({.kind = Event::Kind::kFloods, .peer = *handle});
        EndWait(event);
      } else {
        acceptor.Forget(received.session);  // it has not even connected
      }
      return false;
  }
  return false;
}

bool Endpoint::Impl::HandToEnet(const Acceptor::Received& received) {
  const bool dialled = acceptor.IsDialled(received.session);
  const Inner kind = Inspect(received.bytes, dialled, dialled || options.accept_reliable_messages);
  auto known = connection_of_session.find(received.session.value());
  if (kind == Inner::kRefused) return false;
  if (kind == Inner::kConnect) {
    // A session has one connection; ENet itself repeats an answer that got lost.
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

// An unsequenced message. Before ENet has reported the connection there is no peer to attribute it to.
void Endpoint::Impl::TakeDirect(const Acceptor::Received& received, ENetEvent* event) {
  const std::optional<PeerHandle> handle = PeerOf(received.session);
  if (!handle || received.bytes.size() > kMaxDatagramBytes) return;
  Peer& peer = peers.at(*handle);
  if (!peer.connected) return;
  peer.bytes_received += received.bytes.size();
  pending.push_back({.kind = Event::Kind::kMessage,
                     .peer = *handle,
                     .delivery = Delivery::kUnsequenced,
                     .bytes = Bytes(received.bytes.begin(), received.bytes.end())});
  if (std::exchange(waiting, false)) EndWait(event);
}

bool Endpoint::Impl::SendDirect(const Peer& peer, std::span<const std::uint8_t> bytes) {
  if (!acceptor.Has(peer.session)) return false;
  const std::span<std::uint8_t> room = outbox->Room();
  std::copy(bytes.begin(), bytes.end(), room.begin() + kSealHeaderBytes);
  outbox->Add(acceptor.AddressOf(peer.session), acceptor.Seal(peer.session, DatagramKind::kDirect, room, bytes.size()));
  return true;
}

void Endpoint::Impl::Remember(SessionNumber session, std::uint32_t connection, ENetPeer* enet) {
  connections[connection] = {.session = session, .enet = enet};
  connection_of_session[session.value()] = connection;
}

void Endpoint::Impl::ForgetSession(SessionNumber session) {
  acceptor.Forget(session);
  const auto found = connection_of_session.find(session.value());
  if (found == connection_of_session.end()) return;
  connections.erase(found->second);
  connection_of_session.erase(found);
}

void Endpoint::Impl::StartEnet(SessionNumber session) {
  const std::optional<PeerHandle> dial = PeerOf(session);
  const Address& to = acceptor.AddressOf(session);
  const ENetAddress address{.host = to.host, .port = to.port};
  ENetPeer* enet = dial ? enet_host_connect(host, &address, kChannels, 0) : nullptr;
  if (enet == nullptr) return EndDial(session, std::nullopt);
  enet->packetThrottleInterval = kThrottleInterval_ms;  // the other side puts the same into its answer
  enet->packetThrottleAcceleration = kThrottleAcceleration;
  enet->packetThrottleDeceleration = kThrottleDeceleration;
  Attach(*dial, *enet);
  Remember(session, enet->connectID, enet);
}

void Endpoint::Impl::EndDial(SessionNumber session, std::optional<Refusal> refusal) {
  ForgetSession(session);
  const std::optional<PeerHandle> dial = PeerOf(session);
  if (!dial) return;
  pending.push_back(
      {.kind = Event::Kind::kDisconnected, .peer = *dial, .outgoing = true, .refusal = std::move(refusal)});
  Erase(*dial);
}

void Endpoint::Impl::Send(const Address& to, std::span<const std::uint8_t> bytes) const {
  // Where the socket is full it is lost like any datagram; the peer that waits for it asks again.
  SendNow(host->socket, to, bytes);
}

// Replaces the datagram that ENet is about to send by a sealed one.
void Endpoint::Impl::Seal() {
  const std::span<const ENetBuffer> buffers(host->buffers, host->bufferCount);
  const auto found = connections.find(ConnectionOf(buffers));
  std::size_t bytes = 0;
  if (found != connections.end() && acceptor.Has(found->second.session)) {
    const std::span<std::uint8_t> room(sealed.data() + kSealHeaderBytes,
                                       sealed.size() - kSealHeaderBytes - kSealTagBytes);
    bytes = Gather(buffers, room);
    if (bytes > 0) bytes = acceptor.Seal(found->second.session, DatagramKind::kSealed, sealed, bytes);
  }
  host->buffers[0].data = sealed.data();
  host->buffers[0].dataLength = bytes;  // 0 for a connection that is gone: an empty datagram
  host->bufferCount = 1;
}

void Endpoint::Impl::Progress(Clock::time_point now) {
  for (const Acceptor::Outgoing& out : acceptor.Due(now)) Send(out.to, out.bytes);
  for (const SessionNumber session : acceptor.TakeExceeding()) {
    const std::optional<std::uint64_t> received = acceptor.ReceivedOf(session);
    if (!received) continue;
    flood_filter->Limit(now, session, acceptor.AddressOf(session), kLimitedTo * options.accepted.datagrams.per_s,
                        *received);
  }
  flood_filter->Measure(now, acceptor.unproven(),
                        [this](SessionNumber session) { return acceptor.ReceivedOf(session); });
  ReadKernelDrops(now);
  if (now < sweep_at) return;
  sweep_at = now + kSweepInterval;
  Sweep();
  std::vector<SessionNumber> late;
  for (const auto& [handle, peer] : peers) {
    if (peer.enet == nullptr && now >= peer.dial_until) late.push_back(peer.session);
  }
  for (const SessionNumber session : late) EndDial(session, std::nullopt);
}

void Endpoint::Impl::ReadKernelDrops(Clock::time_point now) {
  if (now < drops_read_at) return;
  drops_read_at = now + FloodFilter::kUpdate;
  const std::optional<std::uint32_t> drops = KernelDrops(host->socket);
  if (!drops) return;
  const auto before = static_cast<std::uint32_t>(receive_stats.kernel_dropped);
  receive_stats.kernel_dropped += *drops - before;  // the kernel counts modulo 2^32
}

// Ends the sessions whose ENet peer is gone, and forgets those that the acceptor ended.
void Endpoint::Impl::Sweep() {
  peer_gone = false;
  // ENet's peers are many and far apart in memory, so they are searched only for that of a new connection.
  const auto is_new = [](const auto& known) { return known.second.enet == nullptr; };
  if (std::any_of(connections.begin(), connections.end(), is_new)) {
    for (ENetPeer& enet : std::span(host->peers, host->peerCount)) {
      if (enet.state == ENET_PEER_STATE_DISCONNECTED || enet.data != nullptr) continue;
      const auto found = connections.find(enet.connectID);
      if (found == connections.end() || found->second.enet != nullptr) continue;
      found->second.enet = &enet;
      SetTimeout(enet);  // by ENet's default, a peer that does not answer keeps its place for half a minute
    }
  }
  std::vector<SessionNumber> ended;
  for (const auto& [number, connection] : connections) {
    ENetPeer* enet = connection.enet;
    const bool gone = enet != nullptr && (enet->state == ENET_PEER_STATE_DISCONNECTED || enet->connectID != number);
    if (!gone && acceptor.Has(connection.session)) continue;
    // A connection that was never finished has nobody to disconnect from.
    if (!gone && enet != nullptr && enet->state == ENET_PEER_STATE_ACKNOWLEDGING_CONNECT) enet_peer_reset(enet);
    ended.push_back(connection.session);
  }
  for (const SessionNumber session : ended) ForgetSession(session);
}

}  // namespace tessera::net

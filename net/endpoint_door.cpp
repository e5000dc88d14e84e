// Between ENet and the door: what comes in is opened, what goes out is sealed, sessions begin and end.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <ctime>

#include "net/endpoint_impl.h"
#include "net/enet_seam.h"

namespace tessera::net {
namespace {

// How often peers that ENet let go of are looked for.
constexpr std::chrono::milliseconds kSweepInterval{50};

// Ends the wait that ENet may be in: `Handle` knows an event of no peer.
void EndWait(ENetEvent* event) {
  if (event != nullptr) event->type = ENET_EVENT_TYPE_DISCONNECT;
}

}  // namespace

thread_local Endpoint::Impl* Endpoint::Impl::current = nullptr;

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
    case Door::Received::Kind::kDirect:
      TakeDirect(received, event);
      return false;
    case Door::Received::Kind::kDialled:
      StartEnet(received.session);
      return false;
    case Door::Received::Kind::kRefused:
      EndDial(received.session, door.RefusalOf(received.session));
      EndWait(event);
      return false;
  }
  return false;
}

bool Endpoint::Impl::HandToEnet(const Door::Received& received) {
  const bool dialled = door.IsDialled(received.session);
  const Inner kind = Inspect(received.bytes, dialled, dialled || options.guests_speak_reliably);
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

// A message without a place in any order. Before ENet has told of the connection there is nobody to give it to.
void Endpoint::Impl::TakeDirect(const Door::Received& received, ENetEvent* event) {
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
  if (!door.Has(peer.session)) return false;
  const std::span<std::uint8_t> room = outbox->Room();
  std::copy(bytes.begin(), bytes.end(), room.begin() + kSealHeaderBytes);
  outbox->Add(door.AddressOf(peer.session), door.Seal(peer.session, DatagramKind::kDirect, room, bytes.size()));
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
  const std::optional<PeerHandle> dial = PeerOf(session);
  const Address& to = door.AddressOf(session);
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
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(to.port);
  address.sin_addr.s_addr = to.host;
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
    if (bytes > 0) bytes = door.Seal(found->second.session, DatagramKind::kSealed, sealed, bytes);
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
  // ENet's peers are many and far apart in memory: they are looked through only for a newcomer's.
  const auto is_new = [](const auto& known) { return known.second.enet == nullptr; };
  if (std::any_of(connections.begin(), connections.end(), is_new)) {
    for (ENetPeer& enet : std::span(host->peers, host->peerCount)) {
      if (enet.state == ENET_PEER_STATE_DISCONNECTED || enet.data != nullptr) continue;
      const auto found = connections.find(enet.connectID);
      if (found == connections.end() || found->second.enet != nullptr) continue;
      found->second.enet = &enet;
      SetTimeout(enet);  // ENet's own lets one that does not answer keep its place for half a minute
    }
  }
  std::vector<SessionNumber> ended;
  for (const auto& [number, connection] : connections) {
    ENetPeer* enet = connection.enet;
    const bool gone = enet != nullptr && (enet->state == ENET_PEER_STATE_DISCONNECTED || enet->connectID != number);
    if (!gone && door.Has(connection.session)) continue;
    // One that never finished: there is nobody to say farewell to.
    if (!gone && enet != nullptr && enet->state == ENET_PEER_STATE_ACKNOWLEDGING_CONNECT) enet_peer_reset(enet);
    ended.push_back(connection.session);
  }
  for (const SessionNumber session : ended) ForgetSession(session);
}

}  // namespace tessera::net

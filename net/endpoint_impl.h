// Endpoint::Impl: the state of an endpoint. Only the endpoint's own files include this.
#pragma once

#include <enet/enet.h>

#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "net/acceptor.h"
#include "net/endpoint.h"
#include "net/flood_filter.h"
#include "net/outbox.h"

namespace tessera::net {

inline constexpr std::size_t kChannels = 1;

inline PeerHandle HandleOf(const ENetPeer& peer) { return PeerHandle(reinterpret_cast<std::uintptr_t>(peer.data)); }
inline void SetHandle(ENetPeer& peer, PeerHandle handle) {
  peer.data = reinterpret_cast<void*>(static_cast<std::uintptr_t>(handle.value()));
}

struct Endpoint::Impl {
  using Clock = std::chrono::steady_clock;

  struct Peer {
    ENetPeer* enet = nullptr;  // none while the other side has not accepted
    SessionNumber session{};
    bool outgoing = false, connected = false;
    Clock::time_point dial_until{};
    std::uint64_t bytes_sent = 0, bytes_received = 0;
  };
  // An ENet connection and the session that carries it. ENet's peer may outlive its handle, to disconnect in order.
  struct EnetConnection {
    SessionNumber session;
    ENetPeer* enet = nullptr;
  };

  explicit Impl(const EndpointOptions& options_in)
      : options(options_in),
        acceptor({.max_sessions = options_in.max_peers,
                  .max_per_address =
                      options_in.max_peers_per_address == 0 ? options_in.max_peers : options_in.max_peers_per_address,
                  .accepted = options_in.accepted}) {}
  ~Impl();

  EndpointOptions options;
  ENetHost* host = nullptr;
  std::uint16_t port = 0;
  std::uint64_t last_handle = 0;
  absl::flat_hash_map<PeerHandle, Peer> peers;
  absl::flat_hash_map<SessionNumber, PeerHandle> handle_of_session;  // the inverse of `peers`
  Acceptor acceptor;
  std::unordered_map<std::uint32_t, EnetConnection> connections;  // by ENet's connectID
  std::unordered_map<std::uint32_t, std::uint32_t> connection_of_session;
  std::vector<Event> pending;  // events outside of ENet: dials that failed, direct messages
  bool waiting = false;        // for the first datagram
  std::optional<Outbox> outbox;
  std::array<std::uint8_t, ENET_PROTOCOL_MAXIMUM_MTU + kSealHeaderBytes + kSealTagBytes> sealed{};
  std::optional<FloodFilter> flood_filter;
  ReceiveStats receive_stats;
  Clock::time_point sweep_at{}, drops_read_at{};
  bool peer_gone = false;  // since the last sweep

  // ENet passes its checksum callback neither the host nor user data, so the endpoint under way is found through this
  // thread's Call; every call into ENet is made under one.
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
    handle_of_session[session] = handle;
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
  void Erase(PeerHandle handle) {
    const auto found = peers.find(handle);
    if (found == peers.end()) return;
    handle_of_session.erase(found->second.session);
    peers.erase(found);
  }
  void Forget(ENetPeer& peer) {
    Erase(HandleOf(peer));
    peer.data = nullptr;
  }
  std::optional<PeerHandle> PeerOf(SessionNumber session) const {
    const auto found = handle_of_session.find(session);
    return found == handle_of_session.end() ? std::nullopt : std::optional(found->second);
  }

  // Between ENet and the acceptor (endpoint_sessions.cpp).
  bool TakeDatagram(ENetEvent* event);
  bool HandToEnet(const Acceptor::Received& received);
  void TakeDirect(const Acceptor::Received& received, ENetEvent* event);
  static bool SendReliable(ENetPeer& peer, std::span<const std::uint8_t> bytes);
  bool SendDirect(const Peer& peer, std::span<const std::uint8_t> bytes);
  void TakePending(std::vector<Event>& out);
  void StartEnet(SessionNumber session);
  void EndDial(SessionNumber session, std::optional<Refusal> refusal);
  void Send(const Address& to, std::span<const std::uint8_t> bytes) const;
  void Remember(SessionNumber session, std::uint32_t connection, ENetPeer* enet);
  void ForgetSession(SessionNumber session);
  void Seal();
  void Progress(Clock::time_point now);
  void Sweep();
  void ReadKernelDrops(Clock::time_point now);
  void Take(std::chrono::milliseconds wait, std::vector<Event>& out);

  // ENet's events (endpoint.cpp). Each of these adds at most one event.
  void OnConnect(ENetPeer& peer, std::vector<Event>& out);
  void OnDisconnect(ENetPeer& peer, std::vector<Event>& out);
  void OnReceive(const ENetEvent& event, std::vector<Event>& out);
  void Handle(const ENetEvent& event, std::vector<Event>& out);
};

}  // namespace tessera::net

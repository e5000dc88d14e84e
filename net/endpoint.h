// Endpoint: one ENet host behind an acceptor, as a worker's game or link port and as a client's socket.
//
// It sends reliable ordered messages and unsequenced datagrams to peers by handle. Every peer has proven who it is, and
// every datagram is sealed; unproven peers leave no trace but in the counters of `acceptor_stats`. ENet carries the
// reliable messages; its traps are hidden: limits on sizes and waiting data, small socket buffers. Strangers and
// accepted peers cost a bounded amount of work and memory (limits.h, flood_filter.h). Unsequenced messages bypass it,
// each sealed by itself and many by one system call: a thousand clients' snapshots would be most of its work.
//
//   auto endpoint = Endpoint::Create({.bind_address = "127.0.0.1", .port = 0, .max_peers = 64});
//   (*endpoint)->Open({.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(9), ...});
//   PeerHandle peer = *(*endpoint)->Connect("127.0.0.1", 7777, RegionId(1), Incarnation(4), credentials);
//   for (const Event& event : (*endpoint)->Service(std::chrono::milliseconds(2))) ...
//   (*endpoint)->Send(peer, Delivery::kReliable, bytes);
//
// Handles are never reused. Sends are queued and leave with the next Flush or Service.
// Thread rule: one thread at a time; Service is the only call that waits.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/world/ids.h"
#include "net/acceptor.h"
#include "net/credential.h"
#include "net/limits.h"
#include "net/protocol.h"
#include "net/sockets.h"

namespace tessera::net {

using PeerHandle = Id<struct PeerTag, std::uint64_t>;  // from 1
using Bytes = std::vector<std::uint8_t>;

enum class Delivery : std::uint8_t {
  kReliable,     // ordered, arrives unless the peer is gone; up to EndpointOptions::max_message_bytes
  kUnsequenced,  // may be lost or late; at most kMaxDatagramBytes
};

struct EndpointOptions {
  std::string bind_address = "0.0.0.0";   // IPv4
  std::uint16_t port = 0;                 // 0: the system chooses
  std::size_t max_peers = 64;             // 1 to 4095
  std::size_t max_peers_per_address = 0;  // accepted peers of one IPv4 address; 0: max_peers
  // A peer counts as gone after so long a silence, at most about twice that: ENet looks at each retry, and the time
  // between retries doubles.
  std::chrono::milliseconds peer_timeout{5000};
  // Largest reliable message, sent or received. Both ends must agree: a message longer than the receiver's limit is
  // never delivered.
  std::size_t max_message_bytes = kMaxMessageBytes;
  // False: reliable messages of accepted peers are dropped. ENet keeps such messages until they are complete and in
  // order, and trusts the peer on how many are missing.
  bool accept_reliable_messages = true;
  // Limits for each accepted peer; the excess is dropped. One that exceeds them for long gets a kFloods event.
  SessionLimits accepted{};
  // How many datagrams one Service looks at, and how many more for each peer; the others wait.
  std::size_t datagrams_per_service = kMaxDatagramsPerService, datagrams_per_peer = 0;
};

struct Event {
  enum class Kind : std::uint8_t {
    kConnected,
    kDisconnected,
    kMessage,
    kFloods,  // an accepted peer sends more than it may, and has for long: the caller is to end it. Once
  };
  Kind kind = Kind::kMessage;
  PeerHandle peer{};
  Delivery delivery = Delivery::kReliable;  // kMessage
  Bytes bytes{};                            // kMessage
  bool outgoing = false;                    // kConnected: this side dialled
  PeerIdentity who{};                       // kConnected, not outgoing: who the peer has proven to be
  std::optional<Refusal> refusal{};         // kDisconnected, outgoing: the other side's acceptor refused
};

struct PeerStats {
  std::chrono::milliseconds round_trip{0};
  // Since anything came from a peer that is connected, an answer to a ping at least; pings go out every half second.
  std::chrono::milliseconds heard_ago{0};
  std::uint64_t bytes_sent = 0, bytes_received = 0;  // payload
  // Parts of messages that went out, and of these, how many went out again for want of an answer. From 0 every 10 s.
  std::uint32_t parts_sent = 0, parts_resent = 0;
};

struct ReceiveStats {
  std::uint64_t cut_short = 0;       // calls of Service that left datagrams waiting
  std::uint64_t kernel_dropped = 0;  // datagrams that found the socket's buffer full, or that the flood filter dropped
};

class Endpoint {
 public:
  // Errors: INVALID_ARGUMENT "bind_address ..." or "max_peers ...", ALREADY_EXISTS "port 7777 on 127.0.0.1 is in use",
  // PERMISSION_DENIED (a port below 1024).
  static absl::StatusOr<std::unique_ptr<Endpoint>> Create(const EndpointOptions& options);
  ~Endpoint();
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  std::uint16_t port() const;
  // For poll(2), so that one thread can wait for several endpoints at once: readable means that Service has work.
  SystemSocket socket() const;
  // From now on peers with a credential of this instance are accepted; before, nobody is answered. A second call
  // changes the identity.
  void Open(EndpointIdentity identity);
  // From now on everybody is refused with STOPPING. Peers stay.
  void Close(std::string why);
  // Begins to connect to the port of `region`, in its life `least` or a later one; kConnected or kDisconnected follows.
  // `host` is an IPv4 address or a name, whose look-up blocks. Errors: INVALID_ARGUMENT (address), UNAVAILABLE (no
  // route), RESOURCE_EXHAUSTED (peers).
  absl::StatusOr<PeerHandle> Connect(const std::string& host, std::uint16_t port, RegionId region, Incarnation least,
                                     Credentials credentials);
  // Errors: NOT_FOUND (no such peer any more), INVALID_ARGUMENT (too long).
  absl::Status Send(PeerHandle peer, Delivery delivery, std::span<const std::uint8_t> bytes);
  void Flush();
  // Events since the last call, oldest first; waits up to `timeout` for the first one, not at all when 0. Gives at most
  // a few thousand events a call, so that a flood cannot hold the caller.
  std::vector<Event> Service(std::chrono::milliseconds timeout);
  // Takes effect after queued messages have gone out. The peer learns of it; no further event of it comes here.
  void Disconnect(PeerHandle peer);
  // Before Disconnect: the caller refuses an accepted peer that it was told of as connected. One that comes back so
  // again and again is not looked at for a while; all that one that `floods` sends is dropped by the kernel.
  void NoteRefused(PeerHandle peer, bool floods);
  // Connections, including those that are being made or ended: 0 after Disconnect of the last peer once all is sent.
  std::size_t connections() const;
  PeerStats StatsOf(PeerHandle peer) const;      // zeros when there is no such peer any more
  std::string AddressOf(PeerHandle peer) const;  // "127.0.0.1:7777"; empty when there is no such peer any more
  const AcceptorStats& acceptor_stats() const;
  const ReceiveStats& receive_stats() const;
  // The kernel drops a part of what is sent to this port.
  bool flooded() const;

 private:
  struct Impl;
  explicit Endpoint(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::net

// Endpoint: one ENet host behind a door, as a worker's game or link port and as a client's socket.
//
// Reliable ordered messages and unsequenced datagrams to peers by handle. Whoever connects has proven who it is, and
// every datagram is sealed: strangers leave no trace but in the counters of `door_stats`. Reliable messages are ENet's,
// whose traps are hidden: limits on sizes and waiting data, small socket buffers. Unsequenced ones go past it, each
// sealed by itself and many by one system call: a thousand clients' snapshots would be most of what it does.
//
//   auto endpoint = Endpoint::Create({.bind_address = "127.0.0.1", .port = 0, .max_peers = 64});
//   (*endpoint)->Open({.instance_id = "plaza-1", .region = RegionId(2), .incarnation = Incarnation(9), .key = key});
//   PeerHandle peer = *(*endpoint)->Connect("127.0.0.1", 7777, RegionId(1), credentials);
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
#include "net/connect_token.h"
#include "net/door.h"
#include "net/protocol.h"

namespace tessera::net {

using PeerHandle = Id<struct PeerTag, std::uint64_t>;  // from 1
using Bytes = std::vector<std::uint8_t>;

enum class Delivery : std::uint8_t {
  kReliable,     // ordered, arrives or the peer is gone; up to EndpointOptions::max_message_bytes
  kUnsequenced,  // may be lost or late; at most kMaxDatagramBytes
};

struct EndpointOptions {
  std::string bind_address = "0.0.0.0";   // IPv4
  std::uint16_t port = 0;                 // 0: the system chooses
  std::size_t max_peers = 64;             // 1 to 4095
  std::size_t max_peers_per_address = 0;  // of those that come in; 0: max_peers
  // Of silence, until a peer counts as gone; at most about twice that, because ENet looks at each retry, and their
  // distance doubles.
  std::chrono::milliseconds peer_timeout{5000};
  // Of one reliable message, sent or received. Both ends must agree: what is longer than the receiver's is never
  // delivered.
  std::size_t max_message_bytes = kMaxMessageBytes;
  // False: of those that come in nothing reliable is taken. ENet keeps such messages until they are whole and in order,
  // and trusts what it is told of those that are missing.
  bool guests_speak_reliably = true;
};

struct Event {
  enum class Kind : std::uint8_t { kConnected, kDisconnected, kMessage };
  Kind kind = Kind::kMessage;
  PeerHandle peer{};
  Delivery delivery = Delivery::kReliable;  // kMessage
  Bytes bytes{};                            // kMessage
  bool outgoing = false;                    // kConnected: this side dialled
  ConnectToken who{};                       // kConnected, not outgoing: what it proved to hold
  std::optional<Refusal> refusal{};         // kDisconnected, outgoing: the other side's door did not let it in
};

struct PeerStats {
  std::chrono::milliseconds round_trip{0};
  std::uint64_t bytes_sent = 0, bytes_received = 0;  // payload
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
  int socket() const;
  // From now on those with a token of this instance may come in; before, nobody is answered. Again: another plate.
  void Open(Doorplate plate);
  // From now on nobody may: STOPPING. Peers stay.
  void Close(std::string why);
  // Begins to connect to the port of `region`; kConnected or kDisconnected follows. `host` is an IPv4 address or a
  // name, whose look-up blocks. Errors: INVALID_ARGUMENT (address), UNAVAILABLE (no route), RESOURCE_EXHAUSTED (peers).
  absl::StatusOr<PeerHandle> Connect(const std::string& host, std::uint16_t port, RegionId region,
                                     Credentials credentials);
  // Errors: NOT_FOUND (no such peer any more), INVALID_ARGUMENT (too long).
  absl::Status Send(PeerHandle peer, Delivery delivery, std::span<const std::uint8_t> bytes);
  void Flush();
  // What has happened, oldest first; waits up to `timeout` for the first event, not at all when 0. At most a few
  // thousand events a call, so that a flood cannot hold the caller.
  std::vector<Event> Service(std::chrono::milliseconds timeout);
  // After what is queued has gone out. The peer hears of it; no further event of it comes here.
  void Disconnect(PeerHandle peer);
  // Those that are being made or ended included: 0 after Disconnect of the last peer once all has gone out.
  std::size_t connections() const;
  PeerStats StatsOf(PeerHandle peer) const;      // zeros when there is no such peer any more
  std::string AddressOf(PeerHandle peer) const;  // "127.0.0.1:7777"; empty when there is no such peer any more
  const DoorStats& door_stats() const;

 private:
  struct Impl;
  explicit Endpoint(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tessera::net

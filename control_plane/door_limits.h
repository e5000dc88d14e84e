// Limits of the control plane's doors: what a connection, a message and a caller may cost, before and after proof.
//
//   SetDoorLimits(builder, Door::kPlayers);
//   const auto slot = slots.Take(caller, context.peer(), method);  // held for as long as the call is under way
//   if (!slot) return absl::ResourceExhaustedError(...);
//
// Thread rule: any thread.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "control_plane/access.h"

namespace tessera::control {

// A connection that has not finished its TLS handshake holds a file; an honest one takes two round trips, on a machine
// that has no time left some seconds.
inline constexpr std::chrono::seconds kHandshakePatience{10};
// A connection without a call is closed; clients dial again without anybody noticing. Agents always have a call.
inline constexpr std::chrono::seconds kConnectionIdle{60};
// Players' connections end after that long, and calls under way after the grace: none of theirs takes minutes.
inline constexpr std::chrono::minutes kPlayersConnectionAge{10};
inline constexpr std::chrono::seconds kPlayersConnectionGrace{60};
// Calls that one connection may have open; further ones wait at the client.
inline constexpr int kPlayersStreams = 100, kOperatorsStreams = 1000;
// Players' requests are a name and a ticket. gRPC refuses a longer message, but collects it before: what bounds that is
// the memory of the door, and how much is read of a connection at once, which else grows with its speed to 4 MiB.
inline constexpr int kPlayersMessageBytes = 64 * 1024, kPlayersReadBytes = 64 * 1024;
// Memory that gRPC may hold for all connections of a door; beyond it closes some. Operators send scenes and states: at
// their door a request of kMaxMessageBytes is read, but of nobody who has shown no proof in the call's headers.
inline constexpr std::size_t kPlayersMemoryBytes = std::size_t{16} << 20, kOperatorsMemoryBytes = std::size_t{1} << 30;
// Threads of the players' door; each call under way takes one.
inline constexpr int kPlayersThreads = 256;

// Calls of one service under way at once: of a token or a host, of one address at the players' door. Dashboards and
// gateways share a token. Imports keep up to 512 MB each on the disk, scenes up to 256 MiB, files of meshes up to 64
// MiB in memory.
inline constexpr int kCallsOfACaller = 256, kCallsOfAnAddress = 64, kImportsOfACaller = 2;

// A request has at most so many bytes, measured before it is parsed (bounded_service.h): most bring names, ids,
// properties and reasons, one a game of 1 MiB at most. One that brings a scene has the door's limit.
inline constexpr std::size_t kRequestBytes = std::size_t{256} << 10, kGameRequestBytes = std::size_t{2} << 20;

// `method`: "InstanceService/CreateInstance". One that is not known is small.
std::size_t RequestLimit(std::string_view method);
// The same for each message of a stream that clients send: what is around a piece of a file is small.
inline constexpr std::size_t kAroundPieceBytes = std::size_t{64} << 10;
std::size_t StreamMessageLimit(std::string_view method);
// A file's next piece comes within that time, over however thin a line; so many wait for one at a door.
inline constexpr std::chrono::seconds kPiecePatience{60};
inline constexpr std::size_t kMaxPieceStreams = 1024;
void SetDoorLimits(grpc::ServerBuilder& builder, Door door);

// Counts calls under way by caller; remembers nobody who has none.
class CallSlots {
 public:
  class Slot {
   public:
    Slot(CallSlots& slots, std::string key) : slots_(slots), key_(std::move(key)) {}
    ~Slot() { slots_.GiveBack(key_); }
    Slot(const Slot&) = delete;
    Slot& operator=(const Slot&) = delete;

   private:
    CallSlots& slots_;
    const std::string key_;
  };

  // Null: the caller has as many calls under way as it may. The socket's callers are this machine's user: no limit.
  // `peer` is gRPC's: "ipv4:192.0.2.7:5000".
  std::unique_ptr<Slot> Take(const Caller& caller, const std::string& peer, std::string_view method);
  std::size_t callers() const;

 private:
  void GiveBack(const std::string& key);

  mutable std::mutex mutex_;
  std::map<std::string, int> calls_;
};

}  // namespace tessera::control

// RegionConnection: a client's connection to one region: dials, reads snapshots, acknowledges, dials again when it
// breaks.
//
//   IDLE -dial-> DIALLING -accepted-> ACCEPTED -welcome-> WELCOMED -stopping-> STOPPED
//   any of the middle three -disconnected-> IDLE, with a wait that doubles up to kMaxRetry
//   any -another endpoint-> IDLE, dialled at once
//
// Thread rule: one thread at a time; time comes in.
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_sdk/client_endpoint.h"
#include "client_sdk/session.h"
#include "client_sdk/stats.h"
#include "core/replication/input.h"
#include "core/replication/scene_transfer.h"
#include "core/replication/snapshot.h"

namespace tessera::client {

class RegionConnection {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  enum class State : std::uint8_t { kIdle, kDialling, kAccepted, kWelcomed, kStopped };

  static constexpr std::chrono::milliseconds kFirstRetry{100}, kMaxRetry{2000};

  RegionConnection(RegionEndpoint where, const Aabb& world_bounds, const replication::SnapshotSettings& settings);

  RegionId region() const { return where_.region; }
  const RegionEndpoint& where() const { return where_; }
  State state() const { return state_; }
  bool welcomed() const { return state_ == State::kWelcomed; }
  net::PeerHandle peer() const { return peer_; }  // PeerHandle() while idle or stopped
  std::string Where() const;                      // "region 2 at 127.0.0.1:7777"
  const std::string& last_error() const { return last_error_; }

  void DialIfDue(TimePoint now, ClientEndpoint& endpoint, const net::Credentials& credentials);
  // The region's acceptor accepted the endpoint's `peer`.
  void Accepted(net::PeerHandle peer);
  void Welcomed();
  void Disconnected(TimePoint now);
  void Stop(ClientEndpoint& endpoint);
  // The region says that its process ends and the world need not.
  void NoteGoesOn() { goes_on_ = true; }
  // Since it said so, until it welcomes again: refusals because its process ends mean nothing new.
  bool goes_on() const { return goes_on_; }
  // The region is to be found there from now on.
  void Move(RegionEndpoint where, ClientEndpoint& endpoint);
  void Failed(std::string why) { last_error_ = std::move(why); }
  // Counts a malformed answer.
  void CountError() { ++stats_.decode_errors; }

  // Nothing if it is refused or this side is not welcomed yet.
  std::optional<replication::ReceivedSnapshot> ReadSnapshot(std::span<const std::uint8_t> datagram);
  // A snapshot is not read, for newer ones are there; it is not acknowledged either.
  void PassOver();
  // Takes the region's figures; counts an error if they are malformed.
  void TakeFigures(std::span<const std::uint8_t> datagram);
  // Sends inputs with the acknowledgement; the bytes sent, 0 where there is nothing to send.
  std::size_t Send(TimePoint now, ClientEndpoint& endpoint, std::vector<PlayerInput> inputs);
  // Sends a datagram of commands (core/replication/command.h); the bytes sent.
  std::size_t SendCommands(TimePoint now, ClientEndpoint& endpoint, const net::Bytes& bytes);
  // The scene is here, with these bounds: snapshots are read from now on.
  void Begin(const Aabb& world_bounds, const replication::SnapshotSettings& settings);
  // Asks for the scene, or says that it is here, if something has changed since the last time, or nothing has come for
  // a while; the bytes sent.
  std::size_t AskForScene(TimePoint now, ClientEndpoint& endpoint, const replication::SceneRequest& request);
  // Asks for these tiles of the scene with this hash, and no others, under the same conditions; the bytes sent.
  std::size_t AskForTiles(TimePoint now, ClientEndpoint& endpoint, const replication::Digest& scene_hash,
                          const std::vector<replication::TileRequest::Wish>& wishes);
  // Whether the region was told to send no snapshots, and has sent none since.
  bool holds() const { return asked_.has_value(); }

  // True when so many datagrams came since the last acknowledgement that its mask would soon not cover them.
  bool AcknowledgementUrgent() const { return unacknowledged_ >= 32; }

  RegionStats Stats(const ClientEndpoint& endpoint) const;

 private:
  void CloseCount();

  RegionEndpoint where_;
  Aabb world_bounds_;
  replication::SnapshotSettings settings_;
  State state_ = State::kIdle;
  net::PeerHandle peer_;
  std::optional<TimePoint> dial_at_;  // nothing: at once
  std::chrono::milliseconds retry_ = kFirstRetry;
  replication::SnapshotReceiver receiver_;
  std::optional<replication::SceneRequest> asked_;  // last, of this connection; until snapshots come
  TimePoint asked_at_{};
  replication::TileRequest tiles_;  // asked for last, of this connection
  TimePoint tiles_asked_at_{};
  std::size_t unacknowledged_ = 0;
  std::uint64_t read_here_ = 0;  // datagrams of this connection
  bool was_welcomed_ = false, goes_on_ = false;
  RegionStats stats_;
  std::string last_error_;
};

}  // namespace tessera::client

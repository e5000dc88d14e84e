#include "client_sdk/region_connection.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace tessera::client {
namespace {

// The same is asked for again after so long, and at once when so many more bytes have come.
constexpr std::chrono::milliseconds kAskAgain{200};
constexpr std::uint64_t kStep = replication::kSceneWindowBytes / 4;

}  // namespace

RegionConnection::RegionConnection(RegionEndpoint where, const Aabb& world_bounds,
                                   const replication::SnapshotSettings& settings)
    : where_(std::move(where)), world_bounds_(world_bounds), settings_(settings), receiver_(world_bounds, settings) {
  stats_.region = where_.region;
}

std::string RegionConnection::Where() const {
  return absl::StrCat("region ", where_.region.value(), " at ", where_.host, ":", where_.port);
}

void RegionConnection::DialIfDue(TimePoint now, ClientEndpoint& endpoint, const net::Credentials& credentials) {
  if (state_ != State::kIdle || (dial_at_.has_value() && now < *dial_at_)) return;
  const absl::StatusOr<net::PeerHandle> peer =
      endpoint.Connect(where_.host, where_.port, where_.region, where_.incarnation, credentials);
  if (!peer.ok()) {
    last_error_ = std::string(peer.status().message());
    return Disconnected(now);
  }
  peer_ = *peer;
  state_ = State::kDialling;
}

void RegionConnection::Accepted(net::PeerHandle peer) {
  peer_ = peer;
  state_ = State::kAccepted;
}

void RegionConnection::Begin(const Aabb& world_bounds, const replication::SnapshotSettings& settings) {
  world_bounds_ = world_bounds;
  settings_ = settings;
  receiver_ = replication::SnapshotReceiver(world_bounds_, settings_);
}

std::size_t RegionConnection::AskForScene(TimePoint now, ClientEndpoint& endpoint,
                                          const replication::SceneRequest& request) {
  const bool news = !asked_ || asked_->want != request.want || request.offset >= asked_->offset + kStep;
  if (!welcomed() || (!news && now - asked_at_ < kAskAgain)) return 0;
  asked_ = request;
  asked_at_ = now;
  net::Bytes bytes = replication::EncodeSceneRequest(request);
  const std::size_t size = bytes.size();
  return endpoint.Send(now, peer_, std::move(bytes)) ? size : 0;
}

std::size_t RegionConnection::AskForTiles(TimePoint now, ClientEndpoint& endpoint,
                                          const replication::Digest& scene_hash,
                                          const std::vector<replication::TileRequest::Wish>& wishes) {
  if (!welcomed() || (wishes.empty() && tiles_.wishes.empty())) return 0;
  constexpr auto kTile = &replication::TileRequest::Wish::tile;
  bool news = !std::ranges::equal(wishes, tiles_.wishes, {}, kTile, kTile);
  for (std::size_t i = 0; i < wishes.size() && !news; ++i) {
    news = wishes[i].offset >= tiles_.wishes[i].offset + kStep;
  }
  if (!news && now - tiles_asked_at_ < kAskAgain) return 0;
  tiles_ = {.number = tiles_.number + 1, .scene_hash = scene_hash, .wishes = wishes};
  tiles_asked_at_ = now;
  net::Bytes bytes = replication::EncodeTileRequest(tiles_);
  const std::size_t size = bytes.size();
  return endpoint.Send(now, peer_, std::move(bytes)) ? size : 0;
}

void RegionConnection::Welcomed() {
  state_ = State::kWelcomed;
  goes_on_ = false;
  asked_.reset();
  tiles_ = {};
  receiver_ = replication::SnapshotReceiver(world_bounds_, settings_);  // the region begins from nothing, too
  unacknowledged_ = 0;
  read_here_ = 0;
  stats_.figures_received = 0;  // it may be another process
  retry_ = kFirstRetry;
  if (was_welcomed_) ++stats_.reconnects;
  was_welcomed_ = true;
}

void RegionConnection::CloseCount() {
  if (state_ == State::kWelcomed) stats_.datagrams_lost += receiver_.newest_sequence() - read_here_;
}

void RegionConnection::Disconnected(TimePoint now) {
  CloseCount();
  state_ = State::kIdle;
  peer_ = net::PeerHandle();
  dial_at_ = now + retry_;
  retry_ = std::min(2 * retry_, kMaxRetry);
}

void RegionConnection::Stop(ClientEndpoint& endpoint) {
  CloseCount();
  if (peer_ != net::PeerHandle()) endpoint.Disconnect(peer_);
  peer_ = net::PeerHandle();
  state_ = State::kStopped;
}

void RegionConnection::Move(RegionEndpoint where, ClientEndpoint& endpoint) {
  Stop(endpoint);
  where_ = std::move(where);
  state_ = State::kIdle;
  dial_at_.reset();
  retry_ = kFirstRetry;
}

std::optional<replication::ReceivedSnapshot> RegionConnection::ReadSnapshot(std::span<const std::uint8_t> datagram) {
  if (!welcomed()) return std::nullopt;  // overtook the welcome; not acknowledged, so it is sent again
  absl::StatusOr<replication::ReceivedSnapshot> snapshot = receiver_.Read(datagram);
  if (!snapshot.ok()) {
    if (!absl::IsAlreadyExists(snapshot.status())) ++stats_.decode_errors;
    return std::nullopt;
  }
  if (asked_ && asked_->want == replication::SceneRequest::Want::kHave) asked_.reset();
  ++unacknowledged_;
  ++read_here_;
  ++stats_.datagrams;
  return *std::move(snapshot);
}

void RegionConnection::PassOver() {
  if (!welcomed()) return;
  ++read_here_;  // it is not lost
  ++stats_.datagrams_passed_over;
}

void RegionConnection::TakeFigures(std::span<const std::uint8_t> datagram) {
  if (!welcomed()) return;
  absl::StatusOr<replication::RegionFigures> figures = replication::DecodeRegionFigures(datagram);
  if (!figures.ok()) return CountError();
  // They only grow: fewer steps are a datagram that was overtaken.
  if (stats_.figures_received > 0 && figures->step.count < stats_.figures.step.count) return;
  stats_.figures_before = stats_.figures_received > 0 ? stats_.figures : replication::RegionFigures{};
  stats_.figures = *figures;
  ++stats_.figures_received;
}

std::size_t RegionConnection::Send(TimePoint now, ClientEndpoint& endpoint, std::vector<PlayerInput> inputs) {
  if (!welcomed() || (inputs.empty() && unacknowledged_ == 0)) return 0;
  unacknowledged_ = 0;
  net::Bytes bytes = replication::EncodeInput({.ack = receiver_.WriteAck(), .inputs = std::move(inputs)});
  const std::size_t size = bytes.size();
  return endpoint.Send(now, peer_, std::move(bytes)) ? size : 0;
}

std::size_t RegionConnection::SendCommands(TimePoint now, ClientEndpoint& endpoint, const net::Bytes& bytes) {
  return welcomed() && endpoint.Send(now, peer_, bytes) ? bytes.size() : 0;
}

RegionStats RegionConnection::Stats(const ClientEndpoint& endpoint) const {
  RegionStats stats = stats_;
  stats.connected = welcomed();
  if (welcomed()) {
    stats.round_trip_s = std::chrono::duration<double>(endpoint.StatsOf(peer_).round_trip).count();
    stats.datagrams_lost += receiver_.newest_sequence() - read_here_;
  }
  return stats;
}

}  // namespace tessera::client

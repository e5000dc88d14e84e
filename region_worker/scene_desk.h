// SceneDesk: serves clients the packed scene of their world, and the tiles of its level where it has some
// (core/replication/scene_transfer.h).
//
// Promise: a client that asks costs at most kSession_bytes_per_s, all together at most kAll_bytes_per_s, and at most
// kSceneWindowBytes wait for one that is slow. A client that asks for the same bytes again on one connection does not
// get them again, because the channel is reliable; of a tile for as long as it goes on asking for that one. The scene
// is packed once, when the first client asks, on a thread of its own, and kept: a region whose clients all bring the
// scene pays nothing. Clients are served in turns.
//
//   SceneDesk desk(scene, scene_hash);
//   desk.Take(peer, request);       // of the scene, or of tiles
//   desk.Serve(now, [&](net::PeerHandle peer, std::span<const std::uint8_t> message) { ... });
//   desk.Retain([&](net::PeerHandle peer) { return port.clients().contains(peer); });
//
// Thread rule: one thread; time comes in.
#pragma once

#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/replication/scene_transfer.h"
#include "core/world/packed_scene.h"
#include "core/world/scene.h"
#include "net/endpoint.h"
#include "region_worker/core/time.h"

namespace tessera::worker {

class SceneDesk {
 public:
  // Two players on a fast line each, or forty at 200 KB/s. A scene of a million bodies takes its player 50 s.
  static constexpr double kSession_bytes_per_s = 2e6, kAll_bytes_per_s = 8e6;
  // So much may be sent at once after a quiet while: less than a tick's worth of snapshots to fifty clients.
  static constexpr double kBurstBytes = 128 * 1024;

  using Send = std::function<void(net::PeerHandle, std::span<const std::uint8_t>)>;

  // `scene_hash`: 64 hexadecimal digits; empty: a client may name any, because this world was given no hash.
  SceneDesk(std::shared_ptr<const Scene> scene, const std::string& scene_hash);

  void Take(net::PeerHandle from, const replication::SceneRequest& request);
  void Take(net::PeerHandle from, const replication::TileRequest& request);
  // Forgets those that are not here any more.
  template <class Here>
  void Retain(const Here& here) {
    std::erase_if(sessions_, [&](const auto& entry) { return !here(entry.first); });
  }
  // Sends what is due. True: bytes wait for time to pass.
  bool Serve(TimePoint now, const Send& send);

  std::uint64_t sent_bytes() const { return sent_bytes_; }  // packed scenes and tiles only, since the beginning

 private:
  struct Packed {
    PackedLevel level;
    replication::Digest sha256{};
  };
  struct TileUnderWay {
    std::uint32_t tile = 0;
    std::uint64_t offset = 0, sent_to = 0;  // offset: what the client has
  };
  struct Session {
    bool wants_scene = false;
    std::uint64_t sent_to = 0, up_to = 0;  // up_to: what the client has room for
    std::uint32_t newest_wishes = 0;       // number of the request
    std::vector<TileUnderWay> tiles;       // in the order of wishes
    double tokens = kBurstBytes;
    bool refused = false, told = false;  // that it is another scene: once
  };
  // The part to be sent next.
  struct Part {
    std::span<const std::uint8_t> bytes;  // from `sent_to` on, as many as there is room for; none: nothing
    std::uint64_t* sent_to = nullptr;
    const TileUnderWay* tile = nullptr;  // null: of the scene
  };

  bool IsOther(const replication::Digest& hash, Session& session) const;
  void BeginPacking();
  void Refill(TimePoint now);
  Part NextPart(Session& session) const;
  // Sends one chunk; false: nothing is due.
  bool ServeOne(net::PeerHandle peer, Session& session, const Send& send);

  std::shared_ptr<const Scene> scene_;
  std::optional<replication::Digest> scene_hash_;
  std::future<Packed> packing_;
  std::optional<Packed> packed_;
  std::map<net::PeerHandle, Session> sessions_;
  std::optional<TimePoint> refilled_;
  double tokens_ = kBurstBytes;
  net::PeerHandle served_last_;
  std::uint64_t sent_bytes_ = 0;
};

}  // namespace tessera::worker

#include "region_worker/scene_desk.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/world/byte_view.h"
#include "core/world/sha256.h"

namespace tessera::worker {

SceneDesk::SceneDesk(std::shared_ptr<const Scene> scene, const std::string& scene_hash) : scene_(std::move(scene)) {
  if (auto digest = replication::DigestFrom(scene_hash); digest.ok()) scene_hash_ = *digest;
}

bool SceneDesk::IsOther(const replication::Digest& hash, Session& session) const {
  session.refused = session.refused || (scene_hash_ && hash != *scene_hash_);
  return session.refused;
}

void SceneDesk::Take(net::PeerHandle from, const replication::SceneRequest& request) {
  if (request.want != replication::SceneRequest::Want::kSend) {
    const auto found = sessions_.find(from);
    if (found == sessions_.end()) return;
    found->second.wants_scene = false;
    if (found->second.tiles.empty()) sessions_.erase(found);
    return;
  }
  Session& session = sessions_[from];
  if (IsOther(request.scene_hash, session)) return;
  if (!std::exchange(session.wants_scene, true)) session.sent_to = request.offset;
  session.up_to = std::max(session.up_to, request.offset + replication::kSceneWindowBytes);
  BeginPacking();
}

void SceneDesk::Take(net::PeerHandle from, const replication::TileRequest& request) {
  Session& session = sessions_[from];
  if (request.number <= session.newest_wishes || IsOther(request.scene_hash, session)) return;
  session.newest_wishes = request.number;
  std::vector<TileUnderWay> tiles;
  for (const replication::TileRequest::Wish& wish : request.wishes) {
    TileUnderWay& tile = tiles.emplace_back(TileUnderWay{wish.tile, wish.offset, wish.offset});
    const auto before = std::ranges::find(session.tiles, wish.tile, &TileUnderWay::tile);
    if (before != session.tiles.end()) tile.sent_to = std::max(wish.offset, before->sent_to);
  }
  session.tiles = std::move(tiles);
  if (!session.tiles.empty()) BeginPacking();
}

void SceneDesk::BeginPacking() {
  if (packed_ || packing_.valid()) return;
  packing_ = std::async(std::launch::async, [scene = scene_] {
    Packed packed{.level = PackLevel(*scene)};
    packed.sha256 = *replication::DigestFrom(Sha256Hex(AsText(packed.level.scene)));
    return packed;
  });
}

void SceneDesk::Refill(TimePoint now) {
  const double passed_s = refilled_ ? std::max(0.0, std::chrono::duration<double>(now - *refilled_).count()) : 0;
  refilled_ = now;
  tokens_ = std::min(kBurstBytes, tokens_ + passed_s * kAll_bytes_per_s);
  for (auto& [peer, session] : sessions_) {
    session.tokens = std::min(kBurstBytes, session.tokens + passed_s * kSession_bytes_per_s);
  }
}

SceneDesk::Part SceneDesk::NextPart(Session& session) const {
  if (session.refused) return {};
  const auto part = [](const std::vector<std::uint8_t>& whole, std::uint64_t begin, std::uint64_t end) {
    const auto size = std::min<std::uint64_t>(replication::kMaxSceneChunkBytes, end - begin);
    return std::span(whole).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(size));
  };
  const std::vector<std::uint8_t>& scene = packed_->level.scene;
  const std::uint64_t end = std::min<std::uint64_t>(scene.size(), session.up_to);
  if (session.wants_scene && session.sent_to < end) {
    return {.bytes = part(scene, session.sent_to, end), .sent_to = &session.sent_to};
  }
  std::uint64_t room = replication::kSceneWindowBytes;
  for (const TileUnderWay& tile : session.tiles) room -= std::min(room, tile.sent_to - tile.offset);
  for (TileUnderWay& tile : session.tiles) {
    if (room == 0 || tile.tile >= packed_->level.tiles.size()) continue;
    const std::vector<std::uint8_t>& whole = packed_->level.tiles[tile.tile];
    if (tile.sent_to >= whole.size()) continue;
    const std::uint64_t tile_end = std::min<std::uint64_t>(whole.size(), tile.sent_to + room);
    return {.bytes = part(whole, tile.sent_to, tile_end), .sent_to = &tile.sent_to, .tile = &tile};
  }
  return {};
}

bool SceneDesk::ServeOne(net::PeerHandle peer, Session& session, const Send& send) {
  const Part part = NextPart(session);
  const auto size = static_cast<double>(part.bytes.size());
  if (part.bytes.empty() || session.tokens < size || tokens_ < size) return false;
  if (part.tile != nullptr) {
    send(peer, replication::EncodeTileChunk({.tile = part.tile->tile, .offset = *part.sent_to, .bytes = part.bytes}));
  } else {
    send(peer, replication::EncodeSceneChunk({.total_bytes = packed_->level.scene.size(),
                                              .sha256 = packed_->sha256,
                                              .offset = *part.sent_to,
                                              .bytes = part.bytes}));
  }
  *part.sent_to += part.bytes.size();
  session.tokens -= size;
  tokens_ -= size;
  sent_bytes_ += part.bytes.size();
  served_last_ = peer;
  return true;
}

bool SceneDesk::Serve(TimePoint now, const Send& send) {
  Refill(now);
  if (sessions_.empty()) return false;
  for (auto& [peer, session] : sessions_) {
    if (session.refused && !std::exchange(session.told, true)) {
      send(peer, replication::EncodeSceneRefusal("the region runs another scene"));
    }
  }
  if (packing_.valid() && packing_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    packed_ = packing_.get();
  }
  if (!packed_) return packing_.valid();
  for (bool any = true; any;) {
    any = false;
    // In turns, beginning behind the one that was served last.
    auto it = sessions_.upper_bound(served_last_);
    for (std::size_t i = 0; i < sessions_.size(); ++i, ++it) {
      if (it == sessions_.end()) it = sessions_.begin();
      any = ServeOne(it->first, it->second, send) || any;
    }
  }
  return std::ranges::any_of(sessions_, [this](auto& entry) { return !NextPart(entry.second).bytes.empty(); });
}

}  // namespace tessera::worker

#include "region_worker/scene_desk.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/world/byte_view.h"
#include "core/world/packed_scene.h"
#include "core/world/sha256.h"

namespace tessera::worker {

SceneDesk::SceneDesk(std::shared_ptr<const Scene> scene, const std::string& scene_hash) : scene_(std::move(scene)) {
  if (auto digest = replication::DigestFrom(scene_hash); digest.ok()) scene_hash_ = *digest;
}

void SceneDesk::Take(net::PeerHandle from, const replication::SceneRequest& request) {
  if (request.want != replication::SceneRequest::Want::kSend) {
    sessions_.erase(from);
    return;
  }
  const auto [at, fresh] = sessions_.try_emplace(from);
  Session& session = at->second;
  if (scene_hash_ && request.scene_hash != *scene_hash_) {
    session.refused = true;
    return;
  }
  if (fresh) session.sent_to = request.offset;
  session.up_to = std::max(session.up_to, request.offset + replication::kSceneWindowBytes);
  if (packed_ || packing_.valid()) return;
  packing_ = std::async(std::launch::async, [scene = scene_] {
    Packed packed{.bytes = PackScene(*scene)};
    packed.sha256 = *replication::DigestFrom(Sha256Hex(AsText(packed.bytes)));
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

bool SceneDesk::ServeOne(net::PeerHandle peer, Session& session, const Send& send) {
  if (session.refused) return false;
  const std::uint64_t total = packed_->bytes.size();
  const std::uint64_t end = std::min(total, session.up_to);
  if (session.sent_to >= end) return false;
  const auto size =
      static_cast<std::size_t>(std::min<std::uint64_t>(replication::kMaxSceneChunkBytes, end - session.sent_to));
  if (session.tokens < static_cast<double>(size) || tokens_ < static_cast<double>(size)) return false;
  const std::span<const std::uint8_t> part =
      std::span(packed_->bytes).subspan(static_cast<std::size_t>(session.sent_to), size);
  send(peer, replication::EncodeSceneChunk(
                 {.total_bytes = total, .sha256 = packed_->sha256, .offset = session.sent_to, .bytes = part}));
  session.sent_to += size;
  session.tokens -= static_cast<double>(size);
  tokens_ -= static_cast<double>(size);
  sent_bytes_ += size;
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
  return std::ranges::any_of(sessions_, [this](const auto& entry) {
    return !entry.second.refused &&
           entry.second.sent_to < std::min<std::uint64_t>(packed_->bytes.size(), entry.second.up_to);
  });
}

}  // namespace tessera::worker

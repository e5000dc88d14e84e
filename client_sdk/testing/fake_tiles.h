// FakeTiles: how a test double of a region serves the tiles of its level: as a region does, but without a rate.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "core/replication/scene_transfer.h"
#include "net/endpoint.h"

namespace tessera::client {

class FakeTiles {
 public:
  using Packed = std::vector<std::vector<std::uint8_t>>;
  using Send = std::function<void(const replication::TileChunk&)>;

  std::size_t chunks_left = ~std::size_t{0};  // then it falls silent
  std::set<std::uint32_t> spoiled;            // these are sent damaged
  std::vector<replication::TileRequest> requests;
  std::map<std::uint32_t, std::uint64_t> sent;  // bytes, by tile

  // A tile that is not asked for any more is forgotten.
  void Serve(const Packed& packed, net::PeerHandle peer, const replication::TileRequest& request, const Send& send) {
    if (request.number <= std::exchange(newest_[peer], std::max(newest_[peer], request.number))) return;
    requests.push_back(request);
    std::map<std::uint32_t, std::uint64_t> before = std::exchange(sent_to_[peer], {});
    std::uint64_t room = replication::kSceneWindowBytes;
    for (const auto& [tile, offset] : request.wishes) {
      std::uint64_t& end = sent_to_[peer][tile];
      end = std::max(offset, before[tile]);
      room -= std::min(room, end - offset);
      const std::vector<std::uint8_t>& whole = packed.at(tile);
      for (; end < whole.size() && room > 0 && chunks_left > 0; --chunks_left) {
        const auto size = static_cast<std::size_t>(
            std::min<std::uint64_t>({replication::kMaxSceneChunkBytes, room, whole.size() - end}));
        const auto from = whole.begin() + static_cast<std::ptrdiff_t>(end);
        std::vector<std::uint8_t> part(from, from + static_cast<std::ptrdiff_t>(size));
        if (spoiled.contains(tile)) part.back() ^= 1;
        send({.tile = tile, .offset = end, .bytes = part});
        end += size;
        room -= size;
        sent[tile] += size;
      }
    }
  }

 private:
  std::map<net::PeerHandle, std::uint32_t> newest_;
  std::map<net::PeerHandle, std::map<std::uint32_t, std::uint64_t>> sent_to_;
};

}  // namespace tessera::client

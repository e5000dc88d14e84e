// ViewerDecoder: the other end of docs/viewer_protocol.md, for tests: what a viewer knows after the messages it was
// sent.
//
// `Take` also gives the message in words, the form of the descriptions beside the golden messages. It throws
// std::runtime_error, naming the field, for what the protocol does not allow. Thread rule: one thread.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/world/bytes.h"
#include "core/world/math.h"

namespace tessera::gateway {

class ViewerDecoder {
 public:
  struct Body {
    std::uint32_t shape = 0;
    std::uint8_t flags = 0;
    std::uint32_t player = 0;
    std::string name{};
    float mass_kg = 0;
    std::array<std::int64_t, 3> position{};
    std::uint32_t orientation = 0, owner = 0, speed = 0;
    std::uint8_t state = 0;
    Vec3d Metres() const;
  };

  nlohmann::ordered_json Take(std::span<const std::uint8_t> message);

  std::map<std::uint64_t, Body> bodies;
  std::uint32_t shapes = 0;
  std::vector<std::pair<std::string, std::uint64_t>> tiles;  // hashes and bytes
  std::size_t statics = 0, frames = 0, welcomes = 0;
  std::uint64_t tick = 0, map_version = 0, own_body = 0, own_player = 0;
  double time_s = 0;
  bool paused = false;
  std::vector<std::string> hosts;
  std::string instance;

 private:
  nlohmann::ordered_json Welcome(ByteReader& in);
  nlohmann::ordered_json Shapes(ByteReader& in);
  nlohmann::ordered_json Visuals(ByteReader& in);
  nlohmann::ordered_json Statics(ByteReader& in);
  nlohmann::ordered_json Tiles(ByteReader& in);
  nlohmann::ordered_json Map(ByteReader& in);
  nlohmann::ordered_json Frame(ByteReader& in);
};

}  // namespace tessera::gateway

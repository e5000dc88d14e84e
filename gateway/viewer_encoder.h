// ViewerEncoder: the binary messages of docs/viewer_protocol.md to one viewer.
//
// It keeps what the viewer was sent, so a frame holds what differs from then: a viewer that reads slowly is asked less
// often for, and gets fewer and newer frames. A view with a radius shows the bodies within it; one that is shown stays
// until it is a tenth further away, so that nothing flickers at the edge.
//
//   ViewerEncoder encoder;
//   send(EncodeWelcome(...)); for (...) send(book messages); send(EncodeMap(...));
//   encoder.Frame(picture, view, out);
//
// Thread rule: one thread.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/world/bytes.h"
#include "core/world/ids.h"
#include "core/world/math.h"
#include "core/world/partition_map.h"
#include "core/world/scene.h"
#include "gateway/picture.h"

namespace tessera::gateway {

struct Welcome {
  std::string instance;
  BodyId own_body{};
  PlayerNumber own_player{};
};
Bytes EncodeWelcome(const Welcome& welcome, const Scene& scene);
// `hosts`: names by region; those of regions that are not in it are empty.
Bytes EncodeMap(const PartitionMap& map, const std::map<RegionId, std::string>& hosts);

struct ViewerView {
  Vec3d center;
  double radius_m = 0;  // 0: everything
};

struct FrameContent {
  std::size_t vanished = 0, appeared = 0, changed = 0;
  bool empty() const { return vanished + appeared + changed == 0; }
};

class ViewerEncoder {
 public:
  // Appends a frame to `out`: the differences between the picture and what was sent before.
  FrameContent Frame(const Picture& picture, const ViewerView& view, ByteWriter& out);
  // The viewer begins anew, with a welcome: it has no body.
  void Begin() { sent_.clear(); }
  std::size_t shown() const { return sent_.size(); }

 private:
  struct Sent {
    BodyId id;
    std::uint32_t identity = 0;
    std::array<std::int64_t, 3> position{};
    std::uint32_t orientation = 0, owner = 0, speed = 0;
    std::uint8_t state = 0;
  };
  void Vanish(BodyId id);
  void Appear(const PictureBody& body);
  void Change(const PictureBody& body, const Sent* before);

  std::vector<Sent> sent_, next_;  // ascending by id
  // The frame under way.
  ByteWriter vanished_, appeared_, changed_;
  FrameContent content_;
  std::uint64_t last_vanished_ = 0, last_changed_ = 0;
};

}  // namespace tessera::gateway

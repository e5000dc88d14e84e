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
#include <limits>
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
  Vec3d center{};
  double radius_m = 0;      // 0: everything
  bool near_first = false;  // under a limit of bytes bodies near the centre come before others
  BodyId foremost{};        // comes before all; 0: none
  // A frame ends with the first body by which it is as long; what has vanished is always in it.
  std::size_t max_bytes = std::numeric_limits<std::size_t>::max();
};

struct FrameContent {
  std::size_t vanished = 0, appeared = 0, changed = 0;
  std::size_t deferred = 0;  // bodies that differ from what the viewer has, and had no room
  bool empty() const { return vanished + appeared + changed == 0; }
};

class ViewerEncoder {
 public:
  // Appends a frame to `out`: the differences between the picture and what was sent before.
  FrameContent Frame(const Picture& picture, const ViewerView& view, ByteWriter& out);
  // The viewer begins anew, with a welcome: it has no body.
  void Begin() { sent_.clear(); }

 private:
  struct Sent {
    BodyId id;
    bool there = true;        // the viewer has it; else it waits for room
    std::uint32_t since = 0;  // frame by which it was last as in the picture, or began to wait
    std::uint32_t identity = 0;
    std::array<std::int64_t, 3> position{};
    std::uint32_t orientation = 0, owner = 0, speed = 0;
    std::uint8_t state = 0;
  };
  // A body that the frame has to show anew.
  struct Candidate {
    std::uint32_t index = 0, bytes = 0;  // in the picture; in the frame
    const Sent* before = nullptr;        // null: never waited before
    double rank = 0;
  };
  enum class Room : std::uint8_t { kForAll, kForChosen };
  void Write(const Picture& picture, const ViewerView& view, Room room);
  void Choose(const Picture& picture, const ViewerView& view);
  double Rank(const PictureBody& body, const Sent* before, const ViewerView& view) const;
  std::size_t written() const { return vanished_.size() + appeared_.size() + changed_.size(); }
  void Vanish(BodyId id);
  void Appear(const PictureBody& body);
  void Change(const PictureBody& body, const Sent* before);

  std::vector<Sent> sent_, next_;  // ascending by id
  std::uint32_t frame_ = 0;
  // The frame under way.
  std::vector<Candidate> candidates_;
  std::vector<char> deferred_;  // by index in the picture
  ByteWriter vanished_, appeared_, changed_;
  FrameContent content_;
  std::uint64_t last_vanished_ = 0, last_changed_ = 0;
};

}  // namespace tessera::gateway

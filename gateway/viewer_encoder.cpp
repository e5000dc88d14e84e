#include "gateway/viewer_encoder.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

// A body that is shown stays until it is so much further away than the view reaches.
constexpr double kStaysWithin = 1.1;
// The kind, tick, time, flags and counts of a frame, at most so.
constexpr std::size_t kFrameHead_bytes = 40;
// Errors that are no distance, as large as this one: a body that is not there, and one that has turned, fallen asleep
// or changed its owner.
constexpr double kAppears_m = 2, kOtherChange_m = 0.05;
// Nearer than this all bodies are equally near.
constexpr double kNear_m = 10;

// A change: an id, the mask, three differences, an orientation, an owner, a state and a speed, at most so long.
constexpr std::size_t kVarint64_bytes = 10, kVarint32_bytes = 5;
constexpr std::size_t kChange_bytes = 4 * kVarint64_bytes + 2 * kVarint32_bytes + 4 + 2;

// As ByteWriter::Varint, where there is room.
std::uint8_t* Put(std::uint8_t* to, std::uint64_t v) {
  for (; v >= 0x80; v >>= 7) *to++ = static_cast<std::uint8_t>(v | 0x80);
  *to++ = static_cast<std::uint8_t>(v);
  return to;
}

std::uint64_t ZigZag(std::int64_t v) {
  return (static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63);
}

Vec3d Metres(const std::array<std::int64_t, 3>& steps) {
  return {static_cast<double>(steps[0]) / kPositionSteps_per_m, static_cast<double>(steps[1]) / kPositionSteps_per_m,
          static_cast<double>(steps[2]) / kPositionSteps_per_m};
}

bool IsShown(const PictureBody& body, const ViewerView& view, bool is_shown_now) {
  if (view.radius_m <= 0) return true;
  const double radius = view.radius_m * (is_shown_now ? kStaysWithin : 1);
  const double x = static_cast<double>(body.position[0]) / kPositionSteps_per_m - view.center.x;
  const double z = static_cast<double>(body.position[2]) / kPositionSteps_per_m - view.center.z;
  return x * x + z * z <= radius * radius;
}

}  // namespace

Bytes EncodeWelcome(const Welcome& welcome, const Scene& scene) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(MessageKind::kWelcome));
  out.U8(kViewerProtocolVersion);
  out.Block(std::string_view(welcome.instance));
  out.Block(std::string_view(scene.name));
  out.Varint(scene.tick_rate_hz);
  out.V(scene.bounds.min);
  out.V(scene.bounds.max);
  out.V(scene.gravity_m_s2);
  out.Varint(welcome.own_body.value());
  out.Varint(welcome.own_player.value());
  out.Varint(scene.properties.size());
  for (const PropertyDef& property : scene.properties) {
    out.Block(std::string_view(property.name));
    out.U8(static_cast<std::uint8_t>(property.initial.index()));
  }
  return out.Take();
}

Bytes EncodeMap(const PartitionMap& map, const std::map<RegionId, std::string>& hosts) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(MessageKind::kMap));
  out.Varint(map.version().value());
  out.Varint(map.regions().size());
  for (const MapRegion& region : map.regions()) {
    out.Varint(region.id.value());
    out.Varint(region.standby.value());
    const auto host = hosts.find(region.id);
    out.Block(host == hosts.end() ? std::string_view() : std::string_view(host->second));
  }
  out.Varint(map.cells().size());
  for (const Cell& cell : map.cells()) {
    out.Varint(cell.owner.value());
    out.F64(cell.area.min_x);
    out.F64(cell.area.min_z);
    out.F64(cell.area.max_x);
    out.F64(cell.area.max_z);
  }
  return out.Take();
}

FrameContent ViewerEncoder::Frame(const Picture& picture, const ViewerView& view, ByteWriter& out) {
  ++frame_;
  Write(picture, view, Room::kForAll);
  if (written() + kFrameHead_bytes > view.max_bytes) {
    Choose(picture, view);
    Write(picture, view, Room::kForChosen);
  }
  sent_.swap(next_);

  out.U8(static_cast<std::uint8_t>(MessageKind::kFrame));
  out.Varint(picture.tick.value());
  out.F64(picture.time_s);
  out.U8(static_cast<std::uint8_t>((picture.paused ? kPausedFlag : 0) | (content_.deferred > 0 ? kDeferredFlag : 0)));
  for (auto [count, section] : {std::pair(content_.vanished, &vanished_), std::pair(content_.appeared, &appeared_),
                                std::pair(content_.changed, &changed_)}) {
    out.Varint(count);
    out.Bytes(section->bytes());
  }
  return content_;
}

// Writes the sections from what was sent before, and what will have been sent then into next_. The first time finds the
// candidates, the second passes over those that have no room.
void ViewerEncoder::Write(const Picture& picture, const ViewerView& view, Room room) {
  content_ = {};
  last_vanished_ = last_changed_ = 0;
  for (ByteWriter* section : {&vanished_, &appeared_, &changed_}) section->Wrote(section->bytes().data());
  if (room == Room::kForAll) candidates_.clear();
  next_.clear();
  next_.reserve(picture.bodies.size());
  auto sent = sent_.begin();
  const auto drop = [this](const Sent& gone) {
    if (gone.there) Vanish(gone.id);
  };
  for (std::size_t index = 0; index < picture.bodies.size(); ++index) {
    const PictureBody& body = picture.bodies[index];
    for (; sent != sent_.end() && sent->id < body.id; ++sent) drop(*sent);
    const Sent* before = sent != sent_.end() && sent->id == body.id ? &*sent++ : nullptr;
    const bool there = before != nullptr && before->there;
    if (!IsShown(body, view, there)) {
      if (there) Vanish(body.id);
      continue;
    }
    if (room == Room::kForChosen && deferred_[index] != 0) {
      ++content_.deferred;
      next_.push_back(before != nullptr ? *before : Sent{.id = body.id, .there = false, .since = frame_});
      continue;
    }
    const bool renamed = there && before->identity != body.number;
    const std::size_t length = appeared_.size() + changed_.size();
    if (renamed) Vanish(body.id);
    if (!there || renamed) Appear(body);
    Change(body, there && !renamed ? before : nullptr);
    next_.push_back(
        {body.id, true, frame_, body.number, body.position, body.orientation, body.owner, body.speed, body.state});
    const std::size_t bytes = appeared_.size() + changed_.size() - length;
    if (room == Room::kForAll && bytes > 0) {
      candidates_.push_back({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(bytes), before});
    }
  }
  for (; sent != sent_.end(); ++sent) drop(*sent);
}

// Defers those for which there is no room, of all candidates.
void ViewerEncoder::Choose(const Picture& picture, const ViewerView& view) {
  deferred_.assign(picture.bodies.size(), 0);
  for (Candidate& candidate : candidates_) {
    deferred_[candidate.index] = 1;
    candidate.rank = Rank(picture.bodies[candidate.index], candidate.before, view);
  }
  const auto ranks_lower = [](const Candidate& a, const Candidate& b) { return a.rank < b.rank; };
  std::make_heap(candidates_.begin(), candidates_.end(), ranks_lower);
  std::size_t bytes = vanished_.size() + kFrameHead_bytes;
  for (auto end = candidates_.end(); end != candidates_.begin() && bytes < view.max_bytes; --end) {
    std::pop_heap(candidates_.begin(), end, ranks_lower);
    const Candidate& chosen = *std::prev(end);
    deferred_[chosen.index] = 0;
    bytes += chosen.bytes;
  }
}

// How much a viewer would miss the change: the error that it sees, times the frames for which it has been wrong.
double ViewerEncoder::Rank(const PictureBody& body, const Sent* before, const ViewerView& view) const {
  if (body.id == view.foremost) return std::numeric_limits<double>::infinity();
  double error_m = kAppears_m;
  if (before != nullptr && before->there) {
    const Vec3d moved = Metres(body.position) - Metres(before->position);
    error_m = kOtherChange_m + std::sqrt(Dot(moved, moved));
  }
  const double frames = before == nullptr ? 1 : 1 + frame_ - before->since;
  const Vec3d away = view.near_first ? Metres(body.position) - view.center : Vec3d();
  return error_m * frames / (kNear_m + std::sqrt(Dot(away, away)));
}

void ViewerEncoder::Vanish(BodyId id) {
  vanished_.Varint(id.value() - last_vanished_);
  last_vanished_ = id.value();
  ++content_.vanished;
}

void ViewerEncoder::Appear(const PictureBody& body) {
  const Identity& identity = *body.identity;
  appeared_.Varint(body.id.value());
  appeared_.Varint(identity.shape);
  appeared_.U8(identity.flags);
  appeared_.Varint(identity.player.value());
  appeared_.Block(std::string_view(identity.name));
  appeared_.F32(identity.mass_kg);
  ++content_.appeared;
}

// `before`: as it was sent last; null for one that appears.
void ViewerEncoder::Change(const PictureBody& body, const Sent* before) {
  std::uint8_t mask = kAllBits;
  if (before != nullptr) {
    mask = static_cast<std::uint8_t>((before->position != body.position ? kPositionBit : 0) |
                                     (before->orientation != body.orientation ? kOrientationBit : 0) |
                                     (before->owner != body.owner ? kOwnerBit : 0) |
                                     (before->state != body.state ? kStateBit : 0) |
                                     (before->speed != body.speed ? kSpeedBit : 0));
    if (mask == 0) return;
  }
  std::uint8_t* to = Put(changed_.Room(kChange_bytes), body.id.value() - last_changed_);
  last_changed_ = body.id.value();
  *to++ = mask;
  if ((mask & kPositionBit) != 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      to = Put(to, ZigZag(body.position[axis] - (before == nullptr ? 0 : before->position[axis])));
    }
  }
  if ((mask & kOrientationBit) != 0) {
    for (int shift = 0; shift < 32; shift += 8) *to++ = static_cast<std::uint8_t>(body.orientation >> shift);
  }
  if ((mask & kOwnerBit) != 0) to = Put(to, body.owner);
  if ((mask & kStateBit) != 0) *to++ = body.state;
  if ((mask & kSpeedBit) != 0) to = Put(to, body.speed);
  changed_.Wrote(to);
  ++content_.changed;
}

}  // namespace tessera::gateway

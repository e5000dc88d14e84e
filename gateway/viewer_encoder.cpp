#include "gateway/viewer_encoder.h"

#include "gateway/viewer_format.h"

namespace tessera::gateway {
namespace {

// A body that is shown stays until it is so much further away than the view reaches.
constexpr double kStaysWithin = 1.1;

std::uint64_t ZigZag(std::int64_t v) {
  return (static_cast<std::uint64_t>(v) << 1) ^ static_cast<std::uint64_t>(v >> 63);
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
  content_ = {};
  last_vanished_ = last_changed_ = 0;
  next_.clear();
  next_.reserve(picture.bodies.size());
  auto sent = sent_.begin();
  for (const PictureBody& body : picture.bodies) {
    for (; sent != sent_.end() && sent->id < body.id; ++sent) Vanish(sent->id);
    const Sent* before = sent != sent_.end() && sent->id == body.id ? &*sent++ : nullptr;
    const bool shown = IsShown(body, view, before != nullptr);
    if (before != nullptr && (!shown || before->identity != body.identity->number)) {
      Vanish(body.id);
      before = nullptr;
    }
    if (!shown) continue;
    if (before == nullptr) Appear(body);
    Change(body, before);
    next_.push_back(
        {body.id, body.identity->number, body.position, body.orientation, body.owner, body.speed, body.state});
  }
  for (; sent != sent_.end(); ++sent) Vanish(sent->id);
  sent_.swap(next_);

  out.U8(static_cast<std::uint8_t>(MessageKind::kFrame));
  out.Varint(picture.tick.value());
  out.F64(picture.time_s);
  out.U8(picture.paused ? kPausedFlag : 0);
  for (auto [count, section] : {std::pair(content_.vanished, &vanished_), std::pair(content_.appeared, &appeared_),
                                std::pair(content_.changed, &changed_)}) {
    out.Varint(count);
    out.Bytes(section->bytes());
    section->Wrote(section->bytes().data());
  }
  return content_;
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
  changed_.Varint(body.id.value() - last_changed_);
  last_changed_ = body.id.value();
  changed_.U8(mask);
  if ((mask & kPositionBit) != 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      changed_.Varint(ZigZag(body.position[axis] - (before == nullptr ? 0 : before->position[axis])));
    }
  }
  if ((mask & kOrientationBit) != 0) changed_.U32(body.orientation);
  if ((mask & kOwnerBit) != 0) changed_.Varint(body.owner);
  if ((mask & kStateBit) != 0) changed_.U8(body.state);
  if ((mask & kSpeedBit) != 0) changed_.Varint(body.speed);
  ++content_.changed;
}

}  // namespace tessera::gateway

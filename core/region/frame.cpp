#include "core/region/frame.h"

#include <algorithm>
#include <bit>

#include "core/region/wire.h"

namespace tessera::region {
namespace {

constexpr std::uint8_t kFormat = 8;

// Flags of a header.
constexpr std::uint8_t kOffer = 1, kWasClosed = 2, kVouches = 4;
// Flags of a state.
constexpr std::uint8_t kAsleep = 1, kAtRest = 2, kHasForce = 4;          // kAtRest: both velocities are +0
constexpr std::uint8_t kHasMomentum = 8, kHasStill = 16, kHasLoad = 32;  // without: +0
constexpr std::uint8_t kHasProperties = 64;                              // of a granted body
constexpr std::uint8_t kPropped = 64, kCalm = 128;                       // of a ghost

constexpr std::size_t kMinStateBytes = 1 + 24 + 32;
constexpr std::size_t kMinGhostBytes = 2 + kMinStateBytes;
constexpr std::size_t kImpulseBytes = 2 + 36;
constexpr std::size_t kMinInputBytes = 1 + 24;
constexpr std::size_t kLateBytes = 1 + 24;

bool Zero(Vec3f v) {
  return (std::bit_cast<std::uint32_t>(v.x) | std::bit_cast<std::uint32_t>(v.y) | std::bit_cast<std::uint32_t>(v.z)) ==
         0;
}

std::uint8_t FlagsOf(const BodyState& state) {
  const bool at_rest = Zero(state.linear_velocity) && Zero(state.angular_velocity);
  const bool still = std::bit_cast<std::uint32_t>(state.still_s) != 0;
  return static_cast<std::uint8_t>((state.asleep ? kAsleep : 0) | (at_rest ? kAtRest : 0) |
                                   (Zero(state.angular_momentum) ? 0 : kHasMomentum) | (still ? kHasStill : 0));
}

void WriteState(Writer& out, const BodyState& state, std::uint8_t more_flags) {
  const std::uint8_t flags = FlagsOf(state) | more_flags;
  out.U8(flags);
  out.V(state.position);
  out.Q(state.orientation);
  if ((flags & kAtRest) == 0) {
    out.V(state.linear_velocity);
    out.V(state.angular_velocity);
  }
  if ((flags & kHasMomentum) != 0) out.V(state.angular_momentum);
  if ((flags & kHasStill) != 0) out.F32(state.still_s);
}

std::uint8_t ReadState(Reader& in, BodyState& state) {
  const std::uint8_t flags = in.U8();
  state.asleep = (flags & kAsleep) != 0;
  state.position = in.V3d();
  state.orientation = in.Q();
  if ((flags & kAtRest) == 0) {
    state.linear_velocity = in.V3f();
    state.angular_velocity = in.V3f();
  }
  if ((flags & kHasMomentum) != 0) state.angular_momentum = in.V3f();
  if ((flags & kHasStill) != 0) state.still_s = in.F32();
  return flags;
}

const GhostRecord* FindGhost(std::span<const GhostRecord> ghosts, BodyId id) {
  const auto it =
      std::lower_bound(ghosts.begin(), ghosts.end(), id, [](const GhostRecord& g, BodyId v) { return g.id < v; });
  return it != ghosts.end() && it->id == id ? &*it : nullptr;
}

bool Unchanged(const GhostRecord& ghost, std::span<const GhostRecord> previous) {
  if (!ghost.state.asleep || !Zero(ghost.force_n) || !Zero(ghost.torque_nm)) return false;
  if (!Zero(ghost.load_ns) || !Zero(ghost.load_nms) || ghost.calm || ghost.propped) return false;
  const GhostRecord* before = FindGhost(previous, ghost.id);
  return before != nullptr && before->epoch == ghost.epoch && SameBits(before->state, ghost.state);
}

void WriteGhosts(Writer& out, std::span<const GhostRecord> ghosts, std::span<const GhostRecord> previous) {
  std::vector<const GhostRecord*> changed;
  std::vector<BodyId> same;
  for (const GhostRecord& ghost : ghosts) {
    if (Unchanged(ghost, previous)) {
      same.push_back(ghost.id);
    } else {
      changed.push_back(&ghost);
    }
  }
  std::uint64_t last = 0;
  out.Varint(same.size());
  for (const BodyId id : same) {
    out.Varint(id.value() - last);
    last = id.value();
  }
  last = 0;
  out.Varint(changed.size());
  for (const GhostRecord* ghost : changed) {
    const bool force = !Zero(ghost->force_n) || !Zero(ghost->torque_nm);
    out.Varint(ghost->id.value() - last);
    last = ghost->id.value();
    out.Varint(ghost->epoch.value());
    const bool load = !Zero(ghost->load_ns) || !Zero(ghost->load_nms);
    WriteState(out, ghost->state,
               static_cast<std::uint8_t>((force ? kHasForce : 0) | (load ? kHasLoad : 0) | (ghost->calm ? kCalm : 0) |
                                         (ghost->propped ? kPropped : 0)));
    if (force) {
      out.V(ghost->force_n);
      out.V(ghost->torque_nm);
    }
    if (load) {
      out.V(ghost->load_ns);
      out.V(ghost->load_nms);
    }
    if (ghost->propped) out.F32(ghost->island_load);
  }
}

// Ids of a list ascend: each is the one before plus a difference that is not 0 and does not wrap.
bool NextId(Reader& in, std::uint64_t& last) {
  const std::uint64_t step = in.Varint();
  if (step == 0 || last + step < last) return false;
  last += step;
  return true;
}

absl::Status Malformed(const char* what) { return absl::InvalidArgumentError(what); }

absl::Status ReadGhosts(Reader& in, std::span<const GhostRecord> previous, std::vector<GhostRecord>& ghosts) {
  std::uint64_t last = 0;
  const std::size_t same = in.Count(1);
  for (std::size_t i = 0; i < same; ++i) {
    if (!NextId(in, last)) return Malformed("unchanged ghosts: ids do not ascend");
    const GhostRecord* before = FindGhost(previous, BodyId(last));
    if (before == nullptr) return Malformed("unchanged ghosts: not in the frame before");
    ghosts.push_back(*before);
    ghosts.back().force_n = ghosts.back().torque_nm = ghosts.back().load_ns = ghosts.back().load_nms = Vec3f();
    ghosts.back().calm = ghosts.back().propped = false;
    ghosts.back().island_load = 0;
  }
  last = 0;
  const std::size_t changed = in.Count(kMinGhostBytes);
  for (std::size_t i = 0; i < changed; ++i) {
    GhostRecord ghost;
    if (!NextId(in, last)) return Malformed("ghosts: ids do not ascend");
    ghost.id = BodyId(last);
    ghost.epoch = Epoch(in.Varint32());
    const std::uint8_t flags = ReadState(in, ghost.state);
    ghost.calm = (flags & kCalm) != 0;
    ghost.propped = (flags & kPropped) != 0;
    if ((flags & kHasForce) != 0) {
      ghost.force_n = in.V3f();
      ghost.torque_nm = in.V3f();
    }
    if ((flags & kHasLoad) != 0) {
      ghost.load_ns = in.V3f();
      ghost.load_nms = in.V3f();
    }
    if (ghost.propped) ghost.island_load = in.F32();
    ghosts.push_back(ghost);
  }
  const auto middle = ghosts.begin() + static_cast<std::ptrdiff_t>(std::min(same, ghosts.size()));
  const auto by_id = [](const GhostRecord& a, const GhostRecord& b) { return a.id < b.id; };
  std::inplace_merge(ghosts.begin(), middle, ghosts.end(), by_id);
  const auto same_id = [](const GhostRecord& a, const GhostRecord& b) { return a.id == b.id; };
  if (std::adjacent_find(ghosts.begin(), ghosts.end(), same_id) != ghosts.end()) {
    return Malformed("ghosts: a body twice");
  }
  return absl::OkStatus();
}

void WriteInput(Writer& out, const QueuedInput& input) {
  out.Varint(input.number);
  out.V(input.force_n);
  out.V(input.torque_nm);
}

void ReadInput(Reader& in, QueuedInput& input) {
  input.number = in.Varint32();
  input.force_n = in.V3f();
  input.torque_nm = in.V3f();
}

void WriteGrant(Writer& out, const Grant& grant) {
  out.Varint(grant.bodies.size());
  for (const GrantedBody& body : grant.bodies) {
    out.Varint(body.id.value());
    out.Varint(body.epoch.value());
    WriteState(out, body.state, body.properties.empty() ? std::uint8_t{0} : kHasProperties);
    if (!body.properties.empty()) WriteProperties(out, body.properties);
  }
  const bool player = grant.bodies.size() == 1 && IsPlayerBody(grant.bodies[0].id);
  if (player) WriteControl(out, grant.control);
  out.Varint(grant.touching.size());
  for (const TouchingPair& pair : grant.touching) {
    out.Varint(pair.body_a.value());
    out.Varint(pair.body_b.value());
    out.U8(pair.trigger ? 1 : 0);
  }
}

void ReadGrant(Reader& in, Grant& grant) {
  grant.bodies.resize(in.Count(kMinGhostBytes));
  for (GrantedBody& body : grant.bodies) {
    body.id = BodyId(in.Varint());
    body.epoch = Epoch(in.Varint32());
    const std::uint8_t flags = ReadState(in, body.state);
    if ((flags & kHasProperties) != 0) ReadProperties(in, body.properties);
  }
  const bool player = grant.bodies.size() == 1 && IsPlayerBody(grant.bodies[0].id);
  if (player) ReadControl(in, grant.control);
  grant.touching.resize(in.Count(3));
  for (TouchingPair& pair : grant.touching) {
    pair.body_a = BodyId(in.Varint());
    pair.body_b = BodyId(in.Varint());
    pair.trigger = in.U8() != 0;
  }
}

absl::StatusOr<FrameHeader> ReadHeader(Reader& in) {
  const std::uint8_t format = in.U8();
  FrameHeader header;
  header.tick = Tick(in.Varint());
  header.sender = RegionId(in.Varint32());
  header.map_version = MapVersion(in.Varint());
  header.committed_version = MapVersion(in.Varint());
  const std::uint8_t flags = in.U8();
  header.stamp.offer = (flags & kOffer) != 0;
  std::uint64_t at = 0;
  if ((flags & kWasClosed) != 0) {
    header.stamp.closings = in.Varint();
    header.stamp.peer_closings = in.Varint();
  }
  (header.stamp.offer ? at : header.stamp.number) = in.Varint();
  header.stamp.open_at = Tick(at);
  if ((flags & kVouches) != 0) header.stamp.vouched = in.Varint32();
  if (!in.ok()) return Malformed("truncated");
  if (format != kFormat) return Malformed("unknown format");
  return header;
}

}  // namespace

void WriteControl(Writer& out, const PlayerControl& control) {
  out.Varint(control.last_input);
  out.U8(control.committed ? 1 : 0);
  out.Varint(control.committed_number);
  out.V(control.force_n);
  out.V(control.torque_nm);
  out.Varint(control.queue.size());
  for (const QueuedInput& input : control.queue) WriteInput(out, input);
}

void ReadControl(Reader& in, PlayerControl& control) {
  control.last_input = in.Varint32();
  control.committed = in.U8() != 0;
  control.committed_number = in.Varint32();
  control.force_n = in.V3f();
  control.torque_nm = in.V3f();
  control.queue.resize(in.Count(kMinInputBytes));
  for (QueuedInput& input : control.queue) ReadInput(in, input);
}

void WriteProperties(Writer& out, const CarriedProperties& properties) {
  out.Varint(properties.change);
  out.Varint(properties.bytes.size());
  for (const std::uint8_t byte : properties.bytes) out.U8(byte);
}

void ReadProperties(Reader& in, CarriedProperties& properties) {
  properties.change = in.Varint();
  const std::size_t size = in.Count(1);
  const std::span<const std::uint8_t> bytes = in.rest().first(size);
  properties.bytes.assign(bytes.begin(), bytes.end());
  in.Skip(size);
}

bool SameBits(const BodyState& a, const BodyState& b) {
  const auto same_f = [](float x, float y) {
    return std::bit_cast<std::uint32_t>(x) == std::bit_cast<std::uint32_t>(y);
  };
  const auto same_d = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  };
  const auto same_v = [&](Vec3f x, Vec3f y) { return same_f(x.x, y.x) && same_f(x.y, y.y) && same_f(x.z, y.z); };
  return a.asleep == b.asleep && same_d(a.position.x, b.position.x) && same_d(a.position.y, b.position.y) &&
         same_d(a.position.z, b.position.z) && same_d(a.orientation.x, b.orientation.x) &&
         same_d(a.orientation.y, b.orientation.y) && same_d(a.orientation.z, b.orientation.z) &&
         same_d(a.orientation.w, b.orientation.w) && same_v(a.linear_velocity, b.linear_velocity) &&
         same_v(a.angular_velocity, b.angular_velocity) && same_v(a.angular_momentum, b.angular_momentum) &&
         same_f(a.still_s, b.still_s);
}

std::vector<std::uint8_t> Encode(const Frame& frame, std::span<const GhostRecord> previous) {
  Writer out;
  out.U8(kFormat);
  out.Varint(frame.tick.value());
  out.Varint(frame.sender.value());
  out.Varint(frame.map_version.value());
  out.Varint(frame.committed_version.value());
  const FrameStamp& stamp = frame.stamp;
  const bool was_closed = stamp.closings != 0 || stamp.peer_closings != 0;
  out.U8(static_cast<std::uint8_t>((stamp.offer ? kOffer : 0) | (was_closed ? kWasClosed : 0) |
                                   (stamp.vouched != 0 ? kVouches : 0)));
  if (was_closed) {
    out.Varint(stamp.closings);
    out.Varint(stamp.peer_closings);
  }
  out.Varint(stamp.offer ? stamp.open_at.value() : stamp.number);
  if (stamp.vouched != 0) out.Varint(stamp.vouched);
  if (stamp.offer) return out.Take();
  WriteGhosts(out, frame.ghosts, previous);
  out.Varint(frame.impulses.size());
  for (const ImpulseRecord& record : frame.impulses) {
    out.Varint(record.own.value());
    out.Varint(record.other.value());
    out.V(record.impulse_on_own);
    out.V(record.angular_on_own);
    out.V(record.angular_on_other);
  }
  out.Varint(frame.grants.size());
  for (const Grant& grant : frame.grants) WriteGrant(out, grant);
  out.Varint(frame.confirmations.size());
  for (const Confirmation& confirmation : frame.confirmations) {
    out.Varint(confirmation.id.value());
    out.Varint(confirmation.epoch.value());
  }
  out.Varint(frame.late_corrections.size());
  for (const LateCorrection& late : frame.late_corrections) {
    out.Varint(late.id.value());
    out.V(late.impulse_ns);
    out.V(late.angular_nms);
  }
  out.Varint(frame.inputs.size());
  for (const ForwardedInput& forwarded : frame.inputs) {
    out.Varint(forwarded.body.value());
    WriteInput(out, forwarded.input);
  }
  return out.Take();
}

absl::StatusOr<FrameHeader> DecodeHeader(std::span<const std::uint8_t> bytes) {
  Reader in(bytes);
  return ReadHeader(in);
}

absl::StatusOr<Frame> Decode(std::span<const std::uint8_t> bytes, std::span<const GhostRecord> previous) {
  Reader in(bytes);
  const absl::StatusOr<FrameHeader> header = ReadHeader(in);
  if (!header.ok()) return header.status();
  Frame frame;
  frame.tick = header->tick;
  frame.sender = header->sender;
  frame.map_version = header->map_version;
  frame.committed_version = header->committed_version;
  frame.stamp = header->stamp;
  if (frame.stamp.offer) return Malformed("an offer where a frame should be");
  if (absl::Status status = ReadGhosts(in, previous, frame.ghosts); !status.ok()) {
    return in.ok() ? status : Malformed("truncated");
  }
  frame.impulses.resize(in.Count(kImpulseBytes));
  for (ImpulseRecord& record : frame.impulses) {
    record.own = BodyId(in.Varint());
    record.other = BodyId(in.Varint());
    record.impulse_on_own = in.V3f();
    record.angular_on_own = in.V3f();
    record.angular_on_other = in.V3f();
  }
  frame.grants.resize(in.Count(2));
  for (Grant& grant : frame.grants) ReadGrant(in, grant);
  frame.confirmations.resize(in.Count(2));
  for (Confirmation& confirmation : frame.confirmations) {
    confirmation.id = BodyId(in.Varint());
    confirmation.epoch = Epoch(in.Varint32());
  }
  frame.late_corrections.resize(in.Count(kLateBytes));
  for (LateCorrection& late : frame.late_corrections) {
    late.id = BodyId(in.Varint());
    late.impulse_ns = in.V3f();
    late.angular_nms = in.V3f();
  }
  frame.inputs.resize(in.Count(1 + kMinInputBytes));
  for (ForwardedInput& forwarded : frame.inputs) {
    forwarded.body = BodyId(in.Varint());
    ReadInput(in, forwarded.input);
  }
  if (!in.ok()) return Malformed("truncated");
  if (in.remaining() != 0) return Malformed("trailing bytes");
  return frame;
}

}  // namespace tessera::region

#include "core/region/frame.h"

#include <algorithm>
#include <bit>

namespace tessera::region {
namespace {

constexpr std::uint8_t kFormat = 15;

// Flags of a header.
constexpr std::uint8_t kReconnect = 1, kWasDown = 2, kPromises = 4;
// Flags of a state.
constexpr std::uint8_t kAsleep = 1, kAtRest = 2, kHasForce = 4;          // kAtRest: both velocities are +0
constexpr std::uint8_t kHasMomentum = 8, kHasStill = 16, kHasLoad = 32;  // without: +0
constexpr std::uint8_t kHasRecord = 64;                                  // on a granted body
constexpr std::uint8_t kExternallySupported = 64, kSettled = 128;        // on a ghost
// Flags of an altered ghost.
constexpr std::uint8_t kGhostJumped = 1, kGhostWoken = 2, kGhostJointed = 4;

constexpr std::size_t kMinStateBytes = 1 + 24 + 32;
constexpr std::size_t kMinGhostBytes = 2 + kMinStateBytes;
constexpr std::size_t kImpulseBytes = 2 + 36;
constexpr std::size_t kMinInputBytes = 1 + kMinSteeringBytes;
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

void WriteState(ByteWriter& out, const BodyState& state, std::uint8_t more_flags) {
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

std::uint8_t ReadState(ByteReader& in, BodyState& state) {
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
  if (!Zero(ghost.load_ns) || !Zero(ghost.load_nms) || ghost.settled || ghost.externally_supported) return false;
  const GhostRecord* before = FindGhost(previous, ghost.id);
  return before != nullptr && before->epoch == ghost.epoch && SameBits(before->state, ghost.state);
}

void WriteGhosts(ByteWriter& out, std::span<const GhostRecord> ghosts, std::span<const GhostRecord> previous) {
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
    WriteState(
        out, ghost->state,
        static_cast<std::uint8_t>((force ? kHasForce : 0) | (load ? kHasLoad : 0) | (ghost->settled ? kSettled : 0) |
                                  (ghost->externally_supported ? kExternallySupported : 0)));
    if (force) {
      out.V(ghost->force_n);
      out.V(ghost->torque_nm);
    }
    if (load) {
      out.V(ghost->load_ns);
      out.V(ghost->load_nms);
    }
    if (ghost->externally_supported) out.F32(ghost->island_load);
  }
}

// Those of the ghosts, unchanged ones among them, that a game did something to.
void WriteAltered(ByteWriter& out, std::span<const GhostRecord> ghosts) {
  out.Varint(static_cast<std::uint64_t>(std::ranges::count_if(ghosts, &GhostRecord::altered)));
  std::uint64_t last = 0;
  for (const GhostRecord& ghost : ghosts) {
    if (!ghost.altered()) continue;
    out.Varint(ghost.id.value() - last);
    last = ghost.id.value();
    out.U8(static_cast<std::uint8_t>((ghost.jumped ? kGhostJumped : 0) | (ghost.woken ? kGhostWoken : 0) |
                                     (ghost.joints.empty() ? 0 : kGhostJointed)));
    Write(out, ghost.tuning);
    if (!ghost.joints.empty()) Write(out, ghost.joints);
  }
}

absl::Status Malformed(absl::string_view what) { return absl::InvalidArgumentError(what); }

absl::Status ReadGhosts(ByteReader& in, std::span<const GhostRecord> previous, std::vector<GhostRecord>& ghosts) {
  std::uint64_t last = 0;
  in.Field("unchanged ghosts");
  const std::size_t same = in.Count(1);
  for (std::size_t i = 0; i < same; ++i) {
    if (!in.Ascend(last)) return Malformed("unchanged ghosts: ids do not ascend");
    const GhostRecord* before = FindGhost(previous, BodyId(last));
    if (before == nullptr) return Malformed("unchanged ghosts: not in the frame before");
    ghosts.push_back(*before);
    ghosts.back().force_n = ghosts.back().torque_nm = ghosts.back().load_ns = ghosts.back().load_nms = Vec3f();
    ghosts.back().settled = ghosts.back().externally_supported = false;
    ghosts.back().island_load = 0;
    ghosts.back().jumped = ghosts.back().woken = false;
    ghosts.back().tuning = {};
    ghosts.back().joints.clear();
  }
  last = 0;
  in.Field("ghosts");
  const std::size_t changed = in.Count(kMinGhostBytes);
  for (std::size_t i = 0; i < changed; ++i) {
    GhostRecord ghost;
    if (!in.Ascend(last)) return Malformed("ghosts: ids do not ascend");
    ghost.id = BodyId(last);
    ghost.epoch = Epoch(in.Varint32());
    const std::uint8_t flags = ReadState(in, ghost.state);
    ghost.settled = (flags & kSettled) != 0;
    ghost.externally_supported = (flags & kExternallySupported) != 0;
    if ((flags & kHasForce) != 0) {
      ghost.force_n = in.V3f();
      ghost.torque_nm = in.V3f();
    }
    if ((flags & kHasLoad) != 0) {
      ghost.load_ns = in.V3f();
      ghost.load_nms = in.V3f();
    }
    if (ghost.externally_supported) ghost.island_load = in.F32();
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

absl::Status ReadAltered(ByteReader& in, std::vector<GhostRecord>& ghosts) {
  in.Field("altered ghosts");
  std::uint64_t last = 0;
  for (std::size_t left = in.Count(3); left > 0 && in.ok(); --left) {
    if (!in.Ascend(last)) return Malformed("altered ghosts: ids do not ascend");
    const auto ghost = std::ranges::lower_bound(ghosts, BodyId(last), {}, &GhostRecord::id);
    if (ghost == ghosts.end() || ghost->id != BodyId(last)) return Malformed("altered ghosts: not among the ghosts");
    const std::uint8_t flags = in.U8();
    if (flags > (kGhostJumped | kGhostWoken | kGhostJointed)) return Malformed("altered ghosts: unknown flags");
    ghost->jumped = (flags & kGhostJumped) != 0;
    ghost->woken = (flags & kGhostWoken) != 0;
    ghost->tuning = ReadTuning(in);
    if ((flags & kGhostJointed) != 0) ReadJoints(in, ghost->joints);
  }
  return absl::OkStatus();
}

void WriteInput(ByteWriter& out, const PlayerInput& input) {
  out.Varint(input.number);
  WriteSteering(out, input);
}

void ReadInput(ByteReader& in, BodyId body, PlayerInput& input) {
  input.body = body;
  if (IsPlayerBody(body)) input.player = PlayerOf(body);
  input.number = in.Varint32();
  ReadSteering(in, input);
}

void WriteGrant(ByteWriter& out, const Grant& grant) {
  out.Varint(grant.bodies.size());
  for (const GrantedBody& body : grant.bodies) {
    out.Varint(body.id.value());
    out.Varint(body.epoch.value());
    WriteState(out, body.state, body.record.empty() ? std::uint8_t{0} : kHasRecord);
    if (!body.record.empty()) WriteRecord(out, body.record);
  }
  if (PlayerIn(grant) != PlayerNumber()) WriteControl(out, grant.control);
  out.Varint(grant.touching.size());
  for (const TouchingPair& pair : grant.touching) {
    out.Varint(pair.body_a.value());
    out.Varint(pair.body_b.value());
    out.U8(pair.trigger ? 1 : 0);
  }
}

void ReadGrant(ByteReader& in, Grant& grant) {
  grant.bodies.resize(in.Count(kMinGhostBytes));
  for (GrantedBody& body : grant.bodies) {
    body.id = BodyId(in.Varint());
    body.epoch = Epoch(in.Varint32());
    const std::uint8_t flags = ReadState(in, body.state);
    if ((flags & kHasRecord) != 0) ReadRecord(in, body.record);
  }
  if (const PlayerNumber player = PlayerIn(grant); player != PlayerNumber()) ReadControl(in, player, grant.control);
  grant.touching.resize(in.Count(3));
  for (TouchingPair& pair : grant.touching) {
    pair.body_a = BodyId(in.Varint());
    pair.body_b = BodyId(in.Varint());
    pair.trigger = in.U8() != 0;
  }
}

absl::StatusOr<BorderFrameHeader> ReadHeader(ByteReader& in) {
  in.Field("header");
  const std::uint8_t format = in.U8();
  BorderFrameHeader header;
  header.tick = Tick(in.Varint());
  header.sender = RegionId(in.Varint32());
  header.map_version = MapVersion(in.Varint());
  header.committed_version = MapVersion(in.Varint());
  const std::uint8_t flags = in.U8();
  header.stamp.reconnect = (flags & kReconnect) != 0;
  std::uint64_t at = 0;
  if ((flags & kWasDown) != 0) {
    header.stamp.outages = in.Varint();
    header.stamp.peer_outages = in.Varint();
  }
  (header.stamp.reconnect ? at : header.stamp.number) = in.Varint();
  header.stamp.up_at = Tick(at);
  if ((flags & kPromises) != 0) header.stamp.promised = in.Varint32();
  if (!in.ok()) return Malformed(in.error());
  if (format != kFormat) return Malformed("unknown format");
  return header;
}

}  // namespace

PlayerNumber PlayerIn(const Grant& grant) {
  const auto at = std::ranges::find_if(grant.bodies, [](const GrantedBody& body) { return IsPlayerBody(body.id); });
  return at == grant.bodies.end() ? PlayerNumber() : PlayerOf(at->id);
}

void WriteControl(ByteWriter& out, const PlayerControl& control) {
  out.Varint(control.last_input);
  out.U8(control.committed ? 1 : 0);
  out.U8(control.held);
  WriteInput(out, control.next);
  out.Varint(control.queue.size());
  for (const PlayerInput& input : control.queue) WriteInput(out, input);
  Write(out, control.state);
  Write(out, control.next_state);
}

void ReadControl(ByteReader& in, PlayerNumber player, PlayerControl& control) {
  const BodyId body = PlayerBodyId(player);
  control.last_input = in.Varint32();
  control.committed = in.U8() != 0;
  control.held = in.U8();
  ReadInput(in, body, control.next);
  control.queue.resize(in.Count(kMinInputBytes));
  for (PlayerInput& input : control.queue) ReadInput(in, body, input);
  control.state = ReadMovementState(in);
  control.next_state = ReadMovementState(in);
}

void WriteRecord(ByteWriter& out, const CarriedRecord& record) {
  out.Varint(record.change);
  out.Block(record.bytes);
  game::Write(out, record.game);
}

void ReadRecord(ByteReader& in, CarriedRecord& record) {
  record.change = in.Varint();
  const std::span<const std::uint8_t> bytes = in.Bytes(in.Count(1));
  record.bytes.assign(bytes.begin(), bytes.end());
  record.game = game::ReadRecord(in);
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

std::vector<std::uint8_t> Encode(const BorderFrame& frame, std::span<const GhostRecord> previous) {
  ByteWriter out;
  out.U8(kFormat);
  out.Varint(frame.tick.value());
  out.Varint(frame.sender.value());
  out.Varint(frame.map_version.value());
  out.Varint(frame.committed_version.value());
  const FrameStamp& stamp = frame.stamp;
  const bool was_down = stamp.outages != 0 || stamp.peer_outages != 0;
  out.U8(static_cast<std::uint8_t>((stamp.reconnect ? kReconnect : 0) | (was_down ? kWasDown : 0) |
                                   (stamp.promised != 0 ? kPromises : 0)));
  if (was_down) {
    out.Varint(stamp.outages);
    out.Varint(stamp.peer_outages);
  }
  out.Varint(stamp.reconnect ? stamp.up_at.value() : stamp.number);
  if (stamp.promised != 0) out.Varint(stamp.promised);
  if (stamp.reconnect) return out.Take();
  WriteGhosts(out, frame.ghosts, previous);
  WriteAltered(out, frame.ghosts);
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
  out.Varint(frame.acknowledgements.size());
  for (const GrantAcknowledgement& acknowledgement : frame.acknowledgements) {
    out.Varint(acknowledgement.id.value());
    out.Varint(acknowledgement.epoch.value());
  }
  out.Varint(frame.late_corrections.size());
  for (const LateCorrection& late : frame.late_corrections) {
    out.Varint(late.id.value());
    out.V(late.impulse_ns);
    out.V(late.angular_nms);
  }
  out.Varint(frame.inputs.size());
  for (const PlayerInput& input : frame.inputs) {
    out.Varint(input.body.value());
    WriteInput(out, input);
  }
  out.Varint(frame.properties.size());
  for (const GhostProperties& one : frame.properties) {
    out.Varint(one.body.value());
    out.Block(one.bytes);
  }
  Write(out, frame.packets);
  return out.Take();
}

absl::StatusOr<BorderFrameHeader> DecodeHeader(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  return ReadHeader(in);
}

absl::StatusOr<BorderFrame> Decode(std::span<const std::uint8_t> bytes, std::span<const GhostRecord> previous) {
  ByteReader in(bytes);
  const absl::StatusOr<BorderFrameHeader> header = ReadHeader(in);
  if (!header.ok()) return header.status();
  BorderFrame frame;
  frame.tick = header->tick;
  frame.sender = header->sender;
  frame.map_version = header->map_version;
  frame.committed_version = header->committed_version;
  frame.stamp = header->stamp;
  if (frame.stamp.reconnect) return Malformed("a reconnect request where a frame should be");
  if (absl::Status status = ReadGhosts(in, previous, frame.ghosts); !status.ok()) {
    return in.ok() ? status : Malformed(in.error());
  }
  if (absl::Status status = ReadAltered(in, frame.ghosts); !status.ok()) {
    return in.ok() ? status : Malformed(in.error());
  }
  in.Field("impulses");
  frame.impulses.resize(in.Count(kImpulseBytes));
  for (ImpulseRecord& record : frame.impulses) {
    record.own = BodyId(in.Varint());
    record.other = BodyId(in.Varint());
    record.impulse_on_own = in.V3f();
    record.angular_on_own = in.V3f();
    record.angular_on_other = in.V3f();
  }
  in.Field("grants");
  frame.grants.resize(in.Count(2));
  for (Grant& grant : frame.grants) ReadGrant(in, grant);
  in.Field("acknowledgements");
  frame.acknowledgements.resize(in.Count(2));
  for (GrantAcknowledgement& acknowledgement : frame.acknowledgements) {
    acknowledgement.id = BodyId(in.Varint());
    acknowledgement.epoch = Epoch(in.Varint32());
  }
  in.Field("late corrections");
  frame.late_corrections.resize(in.Count(kLateBytes));
  for (LateCorrection& late : frame.late_corrections) {
    late.id = BodyId(in.Varint());
    late.impulse_ns = in.V3f();
    late.angular_nms = in.V3f();
  }
  in.Field("inputs");
  frame.inputs.resize(in.Count(1 + kMinInputBytes));
  for (PlayerInput& input : frame.inputs) {
    const BodyId body(in.Varint());
    ReadInput(in, body, input);
  }
  in.Field("properties");
  frame.properties.resize(in.Count(2));
  for (GhostProperties& one : frame.properties) {
    one.body = BodyId(in.Varint());
    const std::span<const std::uint8_t> block = in.Block(kMaxPropertyBytes);
    one.bytes.assign(block.begin(), block.end());
  }
  in.Field("packets");
  Read(in, frame.packets);
  if (!in.ok()) return Malformed(in.error());
  if (in.remaining() != 0) return Malformed("trailing bytes");
  return frame;
}

}  // namespace tessera::region

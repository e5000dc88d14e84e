#include "core/game/joint.h"

#include <algorithm>
#include <cmath>

#include "core/game/settings.h"
#include "core/world/spawned_id.h"

namespace tessera::game {
namespace {

constexpr std::size_t kMinJointBytes = 2 + 2 * 56;
constexpr float kMaxJointLimit = 1'000;
constexpr double kJointUnitTolerance = 1e-3;
enum : std::uint8_t { kCollides = 1, kWaits = 2, kAnswers = 4 };

absl::Status BadJoint(const char* what) { return absl::InvalidArgumentError(what); }

bool IsSaneFrame(const Pose& frame) {
  const auto near = [](double x) { return std::abs(x) <= 2 * kMaxJointReach_m; };
  return near(frame.position.x) && near(frame.position.y) && near(frame.position.z) &&
         std::abs(Length(frame.orientation) - 1) <= kJointUnitTolerance;
}

void WriteJoint(ByteWriter& out, const GameJoint& joint) {
  out.Varint(joint.id.value());
  out.Varint(joint.other.value());
  out.U8(static_cast<std::uint8_t>(joint.kind));
  for (const Pose& frame : {joint.frame, joint.other_frame}) {
    out.V(frame.position);
    out.Q(frame.orientation);
  }
  out.F32(joint.lower);
  out.F32(joint.upper);
  out.F32(joint.stiffness_n_m);
  out.F32(joint.damping_ns_m);
  out.U8(static_cast<std::uint8_t>((joint.bodies_collide ? kCollides : 0) | (joint.until != Tick() ? kWaits : 0) |
                                   (joint.answer.empty() ? 0 : kAnswers)));
  if (joint.until != Tick()) out.Varint(joint.until.value());
  if (joint.answer.empty()) return;
  out.Block(std::string_view(joint.answer));
  out.Varint(joint.asked_by.value());
}

void ReadJoint(ByteReader& in, GameJoint& joint) {
  joint.id = JointId(in.Varint());
  joint.other = BodyId(in.Varint());
  joint.kind = static_cast<GameJointKind>(in.U8());
  for (Pose* frame : {&joint.frame, &joint.other_frame}) {
    frame->position = in.V3d();
    frame->orientation = in.Q();
  }
  joint.lower = in.F32();
  joint.upper = in.F32();
  joint.stiffness_n_m = in.F32();
  joint.damping_ns_m = in.F32();
  const std::uint8_t flags = in.U8();
  if (flags > (kCollides | kWaits | kAnswers)) in.Fail("a joint with unknown flags");
  joint.bodies_collide = (flags & kCollides) != 0;
  if ((flags & kWaits) != 0) joint.until = Tick(in.Varint());
  if ((flags & kAnswers) == 0) return;
  const auto answer = in.Block(kMaxMessageNameBytes);
  joint.answer.assign(answer.begin(), answer.end());
  joint.asked_by = BodyId(in.Varint());
}

}  // namespace

JointDef DefinitionOf(const GameJoint& joint, BodyId body) {
  JointDef def;
  def.id = joint.id;
  def.body_a = body;
  def.body_b = joint.other;
  def.frame_a = joint.frame;
  def.frame_b = joint.other_frame;
  def.bodies_collide = joint.bodies_collide;
  const Limit limit{joint.lower, joint.upper};
  switch (joint.kind) {
    case GameJointKind::kBall:
      def.kind = PointJoint{};
      break;
    case GameJointKind::kFixed:
      def.kind = FixedJoint{};
      break;
    case GameJointKind::kHinge:
      def.kind = HingeJoint{limit, {}};
      break;
    case GameJointKind::kSlider:
      def.kind = SliderJoint{limit, {}};
      break;
    case GameJointKind::kSpring:
    case GameJointKind::kDistance: {
      SixDofJoint six;
      for (std::size_t axis = 0; axis < 6; ++axis) six.axes[axis].limit = Limit{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        if (joint.kind == GameJointKind::kDistance) six.axes[axis].limit = {-limit.upper, limit.upper};
        if (joint.kind == GameJointKind::kSpring) six.axes[axis].spring = {joint.stiffness_n_m, joint.damping_ns_m, 0};
      }
      def.kind = six;
      break;
    }
  }
  return def;
}

void Write(ByteWriter& out, const std::vector<GameJoint>& joints) {
  out.Varint(joints.size());
  for (const GameJoint& joint : joints) WriteJoint(out, joint);
}

void ReadJoints(ByteReader& in, std::vector<GameJoint>& joints) {
  joints.resize(in.Count(kMinJointBytes));
  if (joints.size() > kMaxGameJoints) in.Fail("more than 8 joints");
  for (GameJoint& joint : joints) {
    if (!in.ok()) return;
    ReadJoint(in, joint);
  }
}

std::vector<std::uint8_t> EncodeJoints(const std::vector<JointOfBody>& joints) {
  if (joints.empty()) return {};
  ByteWriter out;
  const std::size_t count = std::min(joints.size(), kMaxToldJoints);
  out.Varint(count);
  for (const auto& [body, joint] : std::span(joints).first(count)) {
    GameJoint told = joint;
    told.until = Tick();
    told.answer.clear();
    out.Varint(body.value());
    WriteJoint(out, told);
  }
  return out.Take();
}

absl::StatusOr<std::vector<JointOfBody>> DecodeJoints(std::span<const std::uint8_t> bytes) {
  std::vector<JointOfBody> joints;
  if (bytes.empty()) return joints;
  ByteReader in(bytes);
  in.Field("joints");
  joints.resize(in.Count(1 + kMinJointBytes));
  if (joints.size() > kMaxToldJoints) return BadJoint("joints: too many");
  for (auto& [body, joint] : joints) {
    body = BodyId(in.Varint());
    ReadJoint(in, joint);
    if (!in.ok()) return BadJoint("joints: truncated");
    const std::vector<GameJoint> one{joint};
    if (absl::Status status = CheckJoints(one); !status.ok()) return status;
    if (absl::Status status = CheckJointsOf(body, one); !status.ok()) return status;
  }
  if (!in.ok() || in.remaining() != 0) return BadJoint("joints: truncated, or followed by other bytes");
  return joints;
}

absl::Status CheckJoints(const std::vector<GameJoint>& joints) {
  if (joints.size() > kMaxGameJoints) return BadJoint("joints: more than 8");
  BodyId last;
  for (const GameJoint& joint : joints) {
    if (joint.other <= last) return BadJoint("joints: out of order");
    last = joint.other;
    if (!IsGameJoint(joint.id)) return BadJoint("joints: a number that no game gives");
    if (joint.kind < GameJointKind::kBall || joint.kind > GameJointKind::kDistance) {
      return BadJoint("joints: of an unknown kind");
    }
    if (!IsSaneFrame(joint.frame) || !IsSaneFrame(joint.other_frame)) {
      return BadJoint("joints: a frame is not finite, or too far away");
    }
    if (!(std::abs(joint.lower) <= kMaxJointLimit) || !(std::abs(joint.upper) <= kMaxJointLimit)) {
      return BadJoint("joints: a limit is not finite, or too large");
    }
    const auto sane = [](float x) { return x >= 0 && x <= static_cast<float>(kMaxJointStiffness); };
    if (!sane(joint.stiffness_n_m) || !sane(joint.damping_ns_m)) return BadJoint("joints: stiffness beyond limits");
  }
  return absl::OkStatus();
}

absl::Status CheckJointsOf(BodyId body, const std::vector<GameJoint>& joints) {
  if (!joints.empty() && joints.front().other <= body) return BadJoint("joints: to a body with a lower id");
  return absl::OkStatus();
}

}  // namespace tessera::game

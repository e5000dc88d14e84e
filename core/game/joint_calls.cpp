#include "core/game/joint_calls.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/arguments.h"
#include "core/game/message_calls.h"
#include "core/game/settings.h"
#include "core/game/value.h"

namespace tessera::game {
namespace {

// In the message that asks for a joint: the joint as bytes.
constexpr char kJointField[] = "joint";

struct JointKindName {
  std::string_view name;
  GameJointKind kind;
};
constexpr JointKindName kJointKinds[] = {{"ball", GameJointKind::kBall},     {"fixed", GameJointKind::kFixed},
                                         {"hinge", GameJointKind::kHinge},   {"slider", GameJointKind::kSlider},
                                         {"spring", GameJointKind::kSpring}, {"distance", GameJointKind::kDistance}};

absl::Status JointFault(absl::string_view function, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(function, ": ", what));
}

// The shortest turn that takes one unit vector to another.
Quatd TurnBetween(Vec3d from, Vec3d to) {
  const double cosine = Dot(from, to);
  if (cosine < -0.999999) {
    const Vec3d aside = std::abs(from.x) < 0.9 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    const Vec3d axis = Cross(from, aside);
    const double length = Length(axis);
    return {axis.x / length, axis.y / length, axis.z / length, 0};
  }
  const Vec3d axis = Cross(from, to);
  return Normalized(Quatd{axis.x, axis.y, axis.z, 1 + cosine});
}

// Reads what game code wrote about a joint between two bodies that are here.
class JointReader {
 public:
  JointReader(tessera_game_call& call, BodyId self, BodyId other) : call_(call), self_(self), other_(other) {}

  absl::StatusOr<GameJoint> Read(CallArguments arguments) {
    const bool given = arguments.size() > 1 && arguments[1].type == TESSERA_GAME_FIELDS;
    if (given) {
      for (const tessera_game_field& field : std::span(arguments[1].as.fields, arguments[1].count)) {
        if (absl::Status status = Take(field); !status.ok()) return status;
      }
    }
    if (absl::Status status = CheckTogether(); !status.ok()) return status;
    return Made();
  }

 private:
  static absl::Status Wrong(std::string_view field, absl::string_view what) {
    return JointFault("connect", absl::StrCat("`joint.", absl::string_view(field.data(), field.size()), "` ", what));
  }
  bool Is(GameJointKind kind) const { return joint_.kind == kind; }
  bool TwoPoints() const { return Is(GameJointKind::kSpring) || Is(GameJointKind::kDistance); }
  bool Turns() const { return Is(GameJointKind::kHinge) || Is(GameJointKind::kSlider); }

  absl::Status Take(const tessera_game_field& field) {
    const std::string_view name = std::string_view(field.name, field.name_bytes).substr(0, 63);
    const tessera_game_value& value = field.value;
    if (name == "kind") return TakeKind(value);
    if (name == "at") return TakeVector(name, value, at_);
    if (name == "at_other") return TakeVector(name, value, at_other_);
    if (name == "axis") return TakeVector(name, value, axis_);
    if (name == "lower") return TakeNumber(name, value, -kMost, kMost, lower_);
    if (name == "upper") return TakeNumber(name, value, -kMost, kMost, upper_);
    if (name == "length") return TakeNumber(name, value, 0, kMaxJointReach_m, length_);
    if (name == "stiffness") return TakeNumber(name, value, 0, kMaxJointStiffness, stiffness_);
    if (name == "damping") return TakeNumber(name, value, 0, kMaxJointStiffness, damping_);
    if (name == "collide") {
      if (value.type != TESSERA_GAME_FLAG) return Wrong(name, "must be true or false");
      joint_.bodies_collide = value.as.whole != 0;
      return absl::OkStatus();
    }
    if (name == "answer") {
      const std::string_view text(value.as.text, value.type == TESSERA_GAME_TEXT ? value.count : 0);
      if (text.empty() || text.size() > kMaxMessageNameBytes) return Wrong(name, "must have 1 to 32 bytes");
      joint_.answer = std::string(text);
      return absl::OkStatus();
    }
    return Wrong(name,
                 "is none of kind, at, at_other, axis, lower, upper, length, stiffness, damping, collide, answer");
  }

  absl::Status TakeKind(const tessera_game_value& value) {
    const std::string_view name(value.as.text, value.type == TESSERA_GAME_TEXT ? value.count : 0);
    const auto* const kind = std::ranges::find(kJointKinds, name, &JointKindName::name);
    if (kind == std::end(kJointKinds)) return Wrong("kind", "is none of ball, fixed, hinge, slider, spring, distance");
    joint_.kind = kind->kind;
    return absl::OkStatus();
  }

  static absl::Status TakeVector(std::string_view name, const tessera_game_value& value, std::optional<Vec3d>& out) {
    if (value.type != TESSERA_GAME_VECTOR) return Wrong(name, "must be a vector");
    out = VectorGiven(value);
    return IsFinite(*out) ? absl::OkStatus() : Wrong(name, "is not finite");
  }

  static absl::Status TakeNumber(std::string_view name, const tessera_game_value& value, double least, double most,
                                 std::optional<double>& out) {
    if (!IsNumber(value)) return Wrong(name, "must be a number");
    out = NumberGiven(value);
    // Not <: what is not a number fails, too.
    if (*out >= least && *out <= most) return absl::OkStatus();
    return Wrong(name, absl::StrCat("must be ", least, " to ", most, ", got ", *out));
  }

  // The arguments given must belong to the kind.
  absl::Status CheckTogether() const {
    if (at_other_ && !TwoPoints()) return Wrong("at_other", "is for a spring or a distance");
    if (axis_ && !Turns()) return Wrong("axis", "is for a hinge or a slider");
    if (axis_ && Length(*axis_) < 1e-9) return Wrong("axis", "has no direction");
    if ((lower_ || upper_) && !Turns()) return Wrong(lower_ ? "lower" : "upper", "is for a hinge or a slider");
    if (lower_.has_value() != upper_.has_value()) return Wrong(lower_ ? "upper" : "lower", "is missing");
    if (lower_ && *lower_ > *upper_) return Wrong("lower", "is above `joint.upper`");
    if (Is(GameJointKind::kDistance) != length_.has_value()) {
      return Wrong("length", length_ ? "is for a distance" : "is missing");
    }
    if (Is(GameJointKind::kSpring) != stiffness_.has_value()) {
      return Wrong("stiffness", stiffness_ ? "is for a spring" : "is missing");
    }
    if (damping_ && !Is(GameJointKind::kSpring)) return Wrong("damping", "is for a spring");
    return absl::OkStatus();
  }

  absl::StatusOr<GameJoint> Made() {
    const BodyState own = call_.transaction.StateOf(self_), its = call_.transaction.StateOf(other_);
    if (const double apart = Length(own.position - its.position); apart > kMaxJointReach_m) {
      return JointFault("connect",
                        absl::StrCat("body ", other_.value(), " is ", apart, " m away, at most ", kMaxJointReach_m));
    }
    const Vec3d at = at_.value_or(TwoPoints() ? own.position : its.position);
    const Vec3d at_other = TwoPoints() ? at_other_.value_or(its.position) : at;
    if (Length(at - own.position) > kMaxJointReach_m) return Wrong("at", "is too far away");
    if (Length(at_other - its.position) > kMaxJointReach_m) return Wrong("at_other", "is too far away");
    Quatd turn = own.orientation;
    if (Turns()) {
      const Vec3d axis = axis_.value_or(Vec3d{0, 1, 0});
      turn = TurnBetween(Is(GameJointKind::kHinge) ? Vec3d{0, 0, 1} : Vec3d{1, 0, 0}, axis / Length(axis));
    }
    joint_.frame = FrameOn(self_, own, at, turn);
    joint_.other_frame = FrameOn(other_, its, at_other, turn);
    if (lower_) joint_.lower = static_cast<float>(*lower_), joint_.upper = static_cast<float>(*upper_);
    if (length_) joint_.lower = 0, joint_.upper = static_cast<float>(*length_);
    joint_.stiffness_n_m = static_cast<float>(stiffness_.value_or(0));
    joint_.damping_ns_m = static_cast<float>(damping_.value_or(0));
    joint_.other = other_;
    if (!joint_.answer.empty()) joint_.asked_by = call_.self == BodyId() ? kInstanceBody : call_.self;
    if (self_ < other_) return joint_;
    // Positions along the axis are those of the other body against this one.
    std::swap(joint_.frame, joint_.other_frame);
    if (joint_.lower <= joint_.upper && Turns()) {
      joint_.lower = std::exchange(joint_.upper, -joint_.lower);
      joint_.lower = -joint_.lower;
    }
    joint_.other = self_;
    return joint_;
  }

  Pose FrameOn(BodyId id, const BodyState& state, Vec3d at, Quatd turn) const {
    const Quatd back = Conjugate(Normalized(state.orientation));
    const Vec3d center = call_.transaction.world().CenterOfMassOf(*call_.transaction.Find(id));
    return {Rotate(back, at - state.position) + center, Normalized(back * turn)};
  }

  static constexpr double kMost = 1'000;
  tessera_game_call& call_;
  const BodyId self_, other_;
  GameJoint joint_;
  std::optional<Vec3d> at_, at_other_, axis_;
  std::optional<double> lower_, upper_, length_, stiffness_, damping_;
};

absl::Status CheckPair(const tessera_game_call& call, absl::string_view function, BodyId self, BodyId other) {
  if (self == other) return JointFault(function, absl::StrCat("body ", self.value(), " with itself"));
  for (const BodyId id : {self, other}) {
    const BodyDef* def = call.transaction.Find(id);
    if (def == nullptr) return absl::NotFoundError(absl::StrCat(function, ": body ", id.value(), " is not here"));
    if (def->motion != Motion::kDynamic) {
      return JointFault(function, absl::StrCat("body ", id.value(), " does not move, and has no joints"));
    }
  }
  return absl::OkStatus();
}

GameJoint* FindJoint(GameRecord& record, BodyId other) {
  const auto at = std::ranges::find(record.joints, other, &GameJoint::other);
  return at == record.joints.end() ? nullptr : &*at;
}

bool IsConnected(const Transaction& transaction, BodyId lower, BodyId other) {
  return transaction.world().Find(lower) != nullptr && transaction.world().Find(other) != nullptr &&
         transaction.world().AreConnected(lower, other);
}

// Why the two may not be connected; empty if they may.
std::string WhyNotTogether(const GameWorld& world, BodyId a, BodyId b) {
  std::vector<BodyId> bodies = world.AssemblyOf(a);
  const std::vector<BodyId> more = world.AssemblyOf(b);
  bodies.insert(bodies.end(), more.begin(), more.end());
  std::ranges::sort(bodies);
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  if (bodies.size() > kMaxJointedBodies) {
    return absl::StrCat(bodies.size(), " bodies would hang together, at most ", kMaxJointedBodies);
  }
  const auto players = std::ranges::count_if(bodies, [&](BodyId id) {
    return IsPlayerBody(id) || (world.Owns(id) && world.RecordOf(id).driver != PlayerNumber());
  });
  return players > 1 ? "two players would hang together" : "";
}

void TellAsker(Transaction& transaction, BodyId carrier, const GameJoint& joint, bool connected, std::string reason,
               Tick now) {
  if (joint.answer.empty()) return;
  GameFields fields;
  fields.emplace_back("body", carrier);
  fields.emplace_back("connected", connected);
  fields.emplace_back("other", joint.other);
  if (!connected) fields.emplace_back("reason", reason.substr(0, 128));
  Message message;
  message.name = joint.answer;
  message.speaker = carrier;
  if (auto bytes = EncodeFields(fields, kMaxMessageBytes); bytes.ok()) message.values = *std::move(bytes);
  const absl::Status sent = transaction.Send(carrier, joint.asked_by, now, std::move(message));
  if (!sent.ok()) transaction.Log(absl::StrCat("connect: no answer: ", sent.message()));
}

// The region owns `body`, the lower of the two.
absl::Status Decide(tessera_game_call& call, BodyId body, GameJoint joint) {
  Transaction& transaction = call.transaction;
  if (absl::Status status = CheckPair(call, "connect", body, joint.other); !status.ok()) return status;
  Transaction::Changes& own = *transaction.Own(body);
  if (FindJoint(own.record, joint.other) != nullptr || IsConnected(transaction, body, joint.other)) {
    return JointFault("connect",
                      absl::StrCat("bodies ", body.value(), " and ", joint.other.value(), " are connected already"));
  }
  if (own.record.joints.size() >= kMaxGameJoints) {
    return absl::ResourceExhaustedError(
        absl::StrCat("connect: body ", body.value(), " has ", kMaxGameJoints, " joints already"));
  }
  const GameWorld& world = transaction.world();
  if (world.Find(body) != nullptr && world.Find(joint.other) != nullptr) {
    if (const std::string why = WhyNotTogether(world, body, joint.other); !why.empty()) {
      return absl::ResourceExhaustedError(absl::StrCat("connect: ", why));
    }
  }
  const auto id = transaction.NextJoint();
  if (!id) return absl::ResourceExhaustedError("connect: the region has given all its joints");
  joint.id = *id;
  joint.until = call.tick + world.scene().tick_rate_hz;
  // Both are of one transaction: neither is handed over before the standby knows of the joint.
  transaction.Own(joint.other);
  const auto at = std::ranges::lower_bound(own.record.joints, joint.other, {}, &GameJoint::other);
  own.record.joints.insert(at, std::move(joint));
  return absl::OkStatus();
}

absl::StatusOr<tessera_game_value> Connect(tessera_game_call& call, BodyId self, BodyId other,
                                           CallArguments arguments) {
  absl::StatusOr<GameJoint> joint = JointReader(call, self, other).Read(arguments);
  if (!joint.ok()) return joint.status();
  const BodyId lower = std::min(self, other);
  if (call.transaction.Owns(lower)) {
    const absl::Status status = Decide(call, lower, *std::move(joint));
    if (!status.ok()) return status;
    return tessera_game_value{};
  }
  joint->id = JointId(std::uint64_t{1} << 62);  // its owner gives it another
  ByteWriter out;
  Write(out, std::vector<GameJoint>{*joint});
  const std::vector<std::uint8_t> bytes = out.Take();
  const GameFields fields{{kJointField, std::string(bytes.begin(), bytes.end())}};
  auto values = EncodeFields(fields, kMaxMessageBytes);
  if (!values.ok()) return values.status();
  Message message;
  message.verb = kBodyConnect;
  message.values = *std::move(values);
  const absl::Status status = SendFrom(call, *FindFunction(kBodyConnect), lower, std::move(message));
  if (!status.ok()) return status;
  return tessera_game_value{};
}

absl::StatusOr<tessera_game_value> Disconnect(tessera_game_call& call, const Function& function, BodyId self,
                                              BodyId other, CallArguments arguments) {
  const BodyId lower = std::min(self, other), higher = std::max(self, other);
  Transaction::Changes* const own = call.transaction.Own(lower);
  if (own == nullptr) {
    std::vector<tessera_game_value> swapped(arguments.begin(), arguments.end());
    swapped[0].as.id = higher.value();
    return SendVerb(call, function, lower, swapped);
  }
  const bool there =
      std::erase_if(own->record.joints, [&](const GameJoint& joint) { return joint.other == higher; }) > 0;
  if (there) call.transaction.Own(higher);
  return ToInterface(GameValue(there));
}

}  // namespace

bool IsJointCall(std::uint32_t function) {
  return function == kBodyConnect || function == kBodyDisconnect || function == kBodyIsConnected;
}

absl::StatusOr<tessera_game_value> CallJoint(tessera_game_call& call, const Function& function, BodyId id,
                                             std::span<const tessera_game_value> arguments) {
  const BodyId other(arguments[0].as.id);
  const absl::string_view name(function.name.data(), function.name.size());
  if (function.number == kBodyConnect || id == other) {
    if (absl::Status status = CheckPair(call, name, id, other); !status.ok()) return status;
  }
  if (function.number == kBodyConnect) return Connect(call, id, other, arguments);
  if (function.number == kBodyDisconnect) return Disconnect(call, function, id, other, arguments);
  const BodyId lower = std::min(id, other), higher = std::max(id, other);
  Transaction::Changes* const own = call.transaction.Own(lower);
  if (own != nullptr && FindJoint(own->record, higher) == nullptr) {
    GameRecord before = call.transaction.world().RecordOf(lower);
    if (FindJoint(before, higher) != nullptr) return ToInterface(GameValue(false));  // this call ended it
  }
  return ToInterface(GameValue(IsConnected(call.transaction, lower, higher)));
}

absl::Status CarryOutConnect(tessera_game_call& call, BodyId body, const Message& message) {
  const absl::StatusOr<GameFields> fields = DecodeFields(message.values, kMaxMessageBytes);
  if (!fields.ok()) return fields.status();
  const auto* text = fields->size() == 1 ? std::get_if<std::string>(&fields->front().second) : nullptr;
  if (text == nullptr) return JointFault("connect", "a message without a joint");
  const std::vector<std::uint8_t> bytes(text->begin(), text->end());
  ByteReader in(bytes);
  std::vector<GameJoint> joints;
  ReadJoints(in, joints);
  if (!in.ok() || in.remaining() != 0 || joints.size() != 1 || !CheckJoints(joints).ok() ||
      !CheckJointsOf(body, joints).ok()) {
    return JointFault("connect", "a message with a joint that is not sound");
  }
  const absl::Status status = Decide(call, body, joints.front());
  if (status.ok() || joints.front().answer.empty()) return status;
  TellAsker(call.transaction, body, joints.front(), false, std::string(status.message()), call.tick);
  return absl::OkStatus();
}

bool MustSettleJoints(const GameWorld& world, BodyId body) {
  const GameRecord record = world.RecordOf(body);
  return std::ranges::any_of(record.joints,
                             [&](const GameJoint& joint) { return joint.until != Tick() || !world.Owns(joint.other); });
}

void SettleJoints(Transaction& transaction, BodyId body, Tick now) {
  Transaction::Changes& own = *transaction.Own(body);
  const GameWorld& world = transaction.world();
  const std::vector<GameJoint> before = std::exchange(own.record.joints, {});
  struct Settled {
    GameJoint joint;
    bool connected;
    std::string reason;
  };
  std::vector<Settled> settled;
  for (const GameJoint& joint : before) {
    GameJoint after = joint;
    std::string reason;
    if (world.Owns(joint.other)) {
      if (joint.until == Tick()) {
        own.record.joints.push_back(joint);
        continue;
      }
      reason = WhyNotTogether(world, body, joint.other);
      after.until = Tick();
      after.answer.clear();
      after.asked_by = BodyId();
      if (reason.empty()) own.record.joints.push_back(after);
      settled.push_back({joint, reason.empty(), std::move(reason)});
    } else if (world.IsRemoved(joint.other)) {
      settled.push_back({joint, false, absl::StrCat("body ", joint.other.value(), " is gone")});
    } else if (joint.until != Tick() && joint.until <= now) {
      settled.push_back({joint, false, absl::StrCat("body ", joint.other.value(), " did not come within a second")});
    } else {
      // A death may have parted two that were connected.
      if (joint.until == Tick()) after.until = now + world.scene().tick_rate_hz;
      own.record.joints.push_back(after);
    }
  }
  for (Settled& one : settled) {
    if (!one.connected && one.joint.answer.empty() && one.joint.until != Tick()) {
      transaction.Log(absl::StrCat("connect: ", one.reason));
    }
    TellAsker(transaction, body, one.joint, one.connected, std::move(one.reason), now);
  }
}

}  // namespace tessera::game

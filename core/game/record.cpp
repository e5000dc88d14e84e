#include "core/game/record.h"

#include <algorithm>
#include <span>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/game/settings.h"
#include "core/game/value.h"
#include "core/world/state_check.h"

namespace tessera::game {
namespace {

auto Order(const GameTimer& timer) { return std::tuple(timer.due, timer.number); }

constexpr std::uint32_t kPushes = 1, kWakes = 2, kJumped = 4, kForces = 8, kTeleport = 16, kTarget = 32, kJumps = 64,
                        kTuning = 128, kLaterGame = 256, kHasMail = 512, kRemoved = 1024, kHasPlayer = 2048,
                        kHasPublished = 4096, kHasJoints = 8192, kQuestions = 16384, kDriven = 32768, kBlasts = 65536,
                        kWaiting = 131072, kAllFlags = 262143;
enum : std::uint8_t { kRotation = 1, kVelocity = 2, kSpin = 4 };  // parts of a teleport

std::uint32_t FlagsOf(const GameRecord& record) {
  const bool pushes = record.push_ns != Vec3f() || record.push_nms != Vec3f();
  return static_cast<std::uint32_t>(
      (pushes ? kPushes : 0) | (record.wakes ? kWakes : 0) | (record.jumped ? kJumped : 0) |
      (record.last_force != 0 ? kForces : 0) | (record.teleport ? kTeleport : 0) | (record.target ? kTarget : 0) |
      (record.jumps != 0 ? kJumps : 0) | (record.tuning.empty() ? 0 : kTuning) | (record.game != 0 ? kLaterGame : 0) |
      (record.mail.empty() ? 0 : kHasMail) | (record.removed ? kRemoved : 0) |
      (record.player.empty() ? 0 : kHasPlayer) | (record.published.empty() ? 0 : kHasPublished) |
      (record.joints.empty() ? 0 : kHasJoints) | (record.last_question != 0 ? kQuestions : 0) |
      (record.driver != PlayerNumber() ? kDriven : 0) | (record.blasts.empty() ? 0 : kBlasts) |
      (record.waiting.empty() ? 0 : kWaiting));
}

void WriteTeleport(ByteWriter& out, const GameTeleport& teleport) {
  out.U8(static_cast<std::uint8_t>((teleport.rotation ? kRotation : 0) | (teleport.velocity_m_s ? kVelocity : 0) |
                                   (teleport.spin_rad_s ? kSpin : 0)));
  out.V(teleport.position);
  if (teleport.rotation) out.Q(*teleport.rotation);
  if (teleport.velocity_m_s) out.V(*teleport.velocity_m_s);
  if (teleport.spin_rad_s) out.V(*teleport.spin_rad_s);
}

GameTeleport ReadTeleport(ByteReader& in) {
  GameTeleport teleport;
  const std::uint8_t flags = in.U8();
  if (flags > (kRotation | kVelocity | kSpin)) in.Fail("unknown flags");
  teleport.position = in.V3d();
  if ((flags & kRotation) != 0) teleport.rotation = in.Q();
  if ((flags & kVelocity) != 0) teleport.velocity_m_s = in.V3f();
  if ((flags & kSpin) != 0) teleport.spin_rad_s = in.V3f();
  return teleport;
}

// A state with this pose and these velocities would be accepted.
bool IsSanePose(Vec3d position, const std::optional<Quatd>& rotation, Vec3f velocity_m_s = {}, Vec3f spin_rad_s = {}) {
  BodyState state;
  state.position = position;
  if (rotation) state.orientation = *rotation;
  state.linear_velocity = velocity_m_s;
  state.angular_velocity = spin_rad_s;
  return IsSane(state);
}

absl::Status CheckForces(const GameRecord& record) {
  if (record.forces.size() > kMaxForces) return absl::InvalidArgumentError("forces: more than 4");
  std::uint32_t last = 0;
  for (const GameForce& force : record.forces) {
    if (force.number <= last || force.number > record.last_force) {
      return absl::InvalidArgumentError(absl::StrCat("forces: ", force.number, " is no number of a force"));
    }
    last = force.number;
    if (!CheckForce(BodyId(), force.force_n, force.torque_nm).ok()) {
      return absl::InvalidArgumentError("forces: one is not finite, or too strong");
    }
  }
  return absl::OkStatus();
}

}  // namespace

Vec3f GameRecord::NextForce(float tick_rate_hz) const {
  Vec3f sum = push_ns * tick_rate_hz;
  for (const GameForce& force : forces) sum += force.force_n;
  return sum;
}

Vec3f GameRecord::NextTorque(float tick_rate_hz) const {
  Vec3f sum = push_nms * tick_rate_hz;
  for (const GameForce& force : forces) sum += force.torque_nm;
  return sum;
}

void GameRecord::Acted(Tick tick) {
  push_ns = push_nms = Vec3f();
  wakes = jumped = false;
  std::erase_if(forces, [tick](const GameForce& force) { return force.ends <= tick; });
}

void Write(ByteWriter& out, const GameRecord& record) {
  out.Varint(record.last_timer);
  out.Varint(record.timers.size());
  for (const GameTimer& timer : record.timers) {
    out.Varint(timer.due.value());
    out.Varint(timer.number);
    out.Block(std::string_view(timer.name));
    out.Block(timer.values);
  }
  out.Varint(record.expires.value());
  const std::uint32_t flags = FlagsOf(record);
  out.Varint(flags);
  if ((flags & kPushes) != 0) {
    out.V(record.push_ns);
    out.V(record.push_nms);
  }
  if ((flags & kForces) != 0) {
    out.Varint(record.last_force);
    out.Varint(record.forces.size());
    for (const GameForce& force : record.forces) {
      out.Varint(force.number);
      out.Varint(force.ends.value());
      out.V(force.force_n);
      out.V(force.torque_nm);
    }
  }
  if (record.teleport) WriteTeleport(out, *record.teleport);
  if (record.target) {
    out.Varint(record.target->arrives.value());
    out.V(record.target->position);
    out.Q(record.target->rotation);
  }
  if ((flags & kJumps) != 0) out.U8(record.jumps);
  if ((flags & kTuning) != 0) Write(out, record.tuning);
  if (record.game != 0) out.Varint(record.game);
  if (!record.mail.empty()) Write(out, record.mail);
  if (!record.player.empty()) Write(out, *record.player);
  if (!record.published.empty()) Write(out, record.published);
  if (!record.joints.empty()) Write(out, record.joints);
  if (record.last_question != 0) {
    out.Varint(record.last_question);
    Write(out, record.questions);
  }
  if ((flags & kDriven) != 0) {
    out.Varint(record.driver.value());
    out.Varint(record.driver_until.value());
  }
  if (!record.blasts.empty()) Write(out, record.blasts);
  if (!record.waiting.empty()) Write(out, std::span<const GameEvent>(record.waiting));
}

GameRecord ReadRecord(ByteReader& in) {
  GameRecord record;
  record.last_timer = in.Varint32();
  const std::uint64_t count = in.Varint();
  if (count > kMaxTimers) in.Fail("more than 16 timers");
  for (std::uint64_t i = 0; in.ok() && i < count; ++i) {
    GameTimer& timer = record.timers.emplace_back();
    timer.due = Tick(in.Varint());
    timer.number = in.Varint32();
    const auto name = in.Block(kMaxTimerNameBytes);
    timer.name.assign(name.begin(), name.end());
    const auto values = in.Block(kMaxFieldBytes);
    timer.values.assign(values.begin(), values.end());
  }
  record.expires = Tick(in.Varint());
  const std::uint64_t flags = in.Varint();
  if (flags > kAllFlags) in.Fail("unknown flags");
  record.wakes = (flags & kWakes) != 0;
  record.jumped = (flags & kJumped) != 0;
  if ((flags & kPushes) != 0) {
    record.push_ns = in.V3f();
    record.push_nms = in.V3f();
  }
  if ((flags & kForces) != 0) {
    record.last_force = in.Varint32();
    const std::uint64_t forces = in.Varint();
    if (forces > kMaxForces) in.Fail("more than 4 forces");
    for (std::uint64_t i = 0; in.ok() && i < forces; ++i) {
      GameForce& force = record.forces.emplace_back();
      force.number = in.Varint32();
      force.ends = Tick(in.Varint());
      force.force_n = in.V3f();
      force.torque_nm = in.V3f();
    }
  }
  if ((flags & kTeleport) != 0) record.teleport = ReadTeleport(in);
  if ((flags & kTarget) != 0) {
    GameTarget& target = record.target.emplace();
    target.arrives = Tick(in.Varint());
    target.position = in.V3d();
    target.rotation = in.Q();
  }
  if ((flags & kJumps) != 0) record.jumps = in.U8();
  if ((flags & kTuning) != 0) record.tuning = ReadTuning(in);
  if ((flags & kLaterGame) != 0) record.game = in.Varint32();
  if ((flags & kHasMail) != 0) record.mail = ReadMail(in);
  record.removed = (flags & kRemoved) != 0;
  if ((flags & kHasPlayer) != 0) record.player.Change() = ReadPlayerRecord(in);
  if ((flags & kHasPublished) != 0) record.published = ReadPublished(in);
  if ((flags & kHasJoints) != 0) ReadJoints(in, record.joints);
  if ((flags & kQuestions) != 0) {
    record.last_question = in.Varint32();
    Read(in, record.questions);
  }
  if ((flags & kDriven) != 0) {
    record.driver = PlayerNumber(in.Varint32());
    record.driver_until = Tick(in.Varint());
  }
  if ((flags & kBlasts) != 0) ReadBlastMarks(in, record.blasts);
  if ((flags & kWaiting) != 0) record.waiting = ReadEvents(in, kMaxCarriedEvents);
  return record;
}

absl::Status CheckRecord(const GameRecord& record) {
  if (record.timers.size() > kMaxTimers) return absl::InvalidArgumentError("timers: more than 16");
  if (!std::ranges::is_sorted(record.timers, std::less_equal<>(), Order)) {
    return absl::InvalidArgumentError("timers: out of order");
  }
  for (const GameTimer& timer : record.timers) {
    if (timer.number == 0 || timer.number > record.last_timer) {
      return absl::InvalidArgumentError(absl::StrCat("timers: ", timer.number, " is no number of a timer"));
    }
    if (timer.name.size() > kMaxTimerNameBytes) return absl::InvalidArgumentError("timers: a name is too long");
    if (const auto fields = DecodeFields(timer.values); !fields.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("timers: ", fields.status().message()));
    }
  }
  if (!IsSaneImpulse(record.push_ns) || !IsSaneAngularImpulse(record.push_nms)) {
    return absl::InvalidArgumentError("push: is not finite, or too strong");
  }
  if (absl::Status status = CheckForces(record); !status.ok()) return status;
  if (record.teleport &&
      !IsSanePose(record.teleport->position, record.teleport->rotation, record.teleport->velocity_m_s.value_or(Vec3f()),
                  record.teleport->spin_rad_s.value_or(Vec3f()))) {
    return absl::InvalidArgumentError("teleport: is not finite, or beyond limits");
  }
  if (record.target && !IsSanePose(record.target->position, record.target->rotation)) {
    return absl::InvalidArgumentError("target: is not finite, or beyond limits");
  }
  if (!IsSane(record.tuning)) return absl::InvalidArgumentError("tuning: is not finite, or beyond limits");
  if (absl::Status status = CheckQuestions(record.questions, record.last_question); !status.ok()) return status;
  if (record.removed &&
      (!record.timers.empty() || !record.questions.empty() || record.expires != Tick() || record.acts() ||
       !record.joints.empty() || record.driver != PlayerNumber() || !record.waiting.empty())) {
    return absl::InvalidArgumentError("timers: of a body that is gone");
  }
  if (absl::Status status = CheckJoints(record.joints); !status.ok()) return status;
  if (record.driver == PlayerNumber() && record.driver_until != Tick()) {
    return absl::InvalidArgumentError("driver: nobody is awaited");
  }
  if (absl::Status status = CheckBlastMarks(record.blasts); !status.ok()) return status;
  if (const absl::Status events = CheckEvents(record.waiting); !events.ok()) {
    return absl::InvalidArgumentError(absl::StrCat("waiting: ", events.message()));
  }
  if (absl::Status status = CheckMail(record.mail); !status.ok()) return status;
  if (absl::Status status = CheckPublished(record.published); !status.ok()) return status;
  return CheckPlayerRecord(*record.player);
}

}  // namespace tessera::game

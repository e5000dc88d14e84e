#include "core/game/motion_calls.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/game/arguments.h"
#include "core/game/settings.h"
#include "core/game/value.h"
#include "core/world/limits.h"
#include "core/world/state_check.h"

namespace tessera::game {
namespace {

// Carries out one call. What is wrong is named as game code wrote it: "teleport: `options.spin` is above ...".
class MotionCall {
 public:
  MotionCall(tessera_game_call& call, const Function& function, BodyId id, const BodyDef& def,
             Transaction::Changes& body, CallArguments arguments)
      : call_(call), function_(function), id_(id), def_(def), record_(body.record), arguments_(arguments) {}

  absl::StatusOr<tessera_game_value> Run() {
    if (absl::Status status = CheckBody(); !status.ok()) return status;
    switch (function_.number) {
      case kBodyPushFor:
        return PushFor();
      case kBodyCancelPush:
        return ToInterface(GameValue(CancelPush()));
      case kBodySetSpin:
        return Nothing(SetSpin(VectorGiven(arguments_[0]), "spin"));
      case kBodyTeleport:
        return Nothing(Teleport());
      case kBodyWake:
        record_.wakes = true;
        return tessera_game_value{};
      case kBodySetGravity:
        return Nothing(SetGravity());
      case kBodySetMaterial:
        return Nothing(SetMaterial());
      default:
        return Nothing(MoveTo());
    }
  }

 private:
  absl::Status Wrong(const std::string& what) const {
    return absl::InvalidArgumentError(
        absl::StrCat(absl::string_view(function_.name.data(), function_.name.size()), ": ", what));
  }
  static absl::StatusOr<tessera_game_value> Nothing(const absl::Status& status) {
    if (!status.ok()) return status;
    return tessera_game_value{};
  }
  const Scene& scene() const { return call_.transaction.world().scene(); }

  absl::Status CheckBody() const {
    if (def_.motion != Motion::kDynamic) return Wrong(absl::StrCat("body ", id_.value(), " does not move"));
    if (function_.number == kBodyMoveTo) {
      return def_.kinematic ? absl::OkStatus() : Wrong(absl::StrCat("body ", id_.value(), " is not kinematic"));
    }
    if (def_.kinematic && function_.number != kBodyTeleport && function_.number != kBodySetMaterial) {
      return Wrong(absl::StrCat("body ", id_.value(), " is kinematic: move_to moves it"));
    }
    return absl::OkStatus();
  }

  absl::Status CheckTicks(std::int64_t ticks, std::int64_t most) const {
    return ticks >= 1 && ticks <= most ? absl::OkStatus()
                                       : Wrong(absl::StrCat("`ticks` must be 1 to ", most, ", got ", ticks));
  }

  absl::StatusOr<tessera_game_value> PushFor() {
    const std::int64_t ticks = arguments_[0].as.whole;
    if (absl::Status status = CheckTicks(ticks, kMaxForceTicks); !status.ok()) return status;
    const Vec3d force_n = VectorGiven(arguments_[1]);
    const Vec3d torque_nm = IsGiven(arguments_, 2) ? VectorGiven(arguments_[2]) : Vec3d();
    if (Length(force_n) > kMaxAcceleration_m_s2 * def_.mass_kg) {
      return Wrong(absl::StrCat("`force` makes a body of ", def_.mass_kg, " kg faster by more than ",
                                kMaxAcceleration_m_s2, " m/s^2"));
    }
    const GameForce force{record_.last_force + 1, call_.tick + static_cast<std::uint64_t>(ticks), Vec3f(force_n),
                          Vec3f(torque_nm)};
    if (!CheckForce(id_, force.force_n, force.torque_nm).ok()) {
      return Wrong(absl::StrCat("`torque` is above ", kMaxForce, " N m"));
    }
    if (record_.forces.size() >= kMaxForces) {
      return absl::ResourceExhaustedError(absl::StrCat("push_for: the body has ", kMaxForces, " pushes already"));
    }
    if (record_.last_force == std::numeric_limits<std::uint32_t>::max()) {
      return absl::ResourceExhaustedError("push_for: the body has used up the numbers of pushes");
    }
    record_.forces.push_back(force);
    return ToInterface(GameValue(std::int64_t{++record_.last_force}));
  }

  bool CancelPush() {
    const std::int64_t number = arguments_[0].as.whole;
    return std::erase_if(record_.forces, [&](const GameForce& force) { return force.number == number; }) > 0;
  }

  absl::Status CheckSpin(Vec3d spin_rad_s, std::string_view name) const {
    if (Length(spin_rad_s) <= kMaxAngularSpeed_rad_s) return absl::OkStatus();
    return Wrong(absl::StrCat("`", absl::string_view(name.data(), name.size()), "` is above ", kMaxAngularSpeed_rad_s,
                              " rad/s"));
  }

  absl::Status SetSpin(Vec3d spin_rad_s, std::string_view name) {
    if (absl::Status status = CheckSpin(spin_rad_s, name); !status.ok()) return status;
    if (BodyState* made = call_.transaction.MadeState(id_); made != nullptr) {
      made->angular_velocity = Vec3f(spin_rad_s);
      record_.push_nms = {};
      return absl::OkStatus();
    }
    if (record_.teleport) {
      record_.teleport->spin_rad_s = Vec3f(spin_rad_s);
      record_.push_nms = {};
      return absl::OkStatus();
    }
    const Vec3f push_nms = call_.transaction.world().AngularImpulseFor(id_, spin_rad_s);
    const auto rate = static_cast<float>(scene().tick_rate_hz);
    if (!CheckForce(id_, {}, push_nms * rate).ok()) return Wrong("turns the body more than can be computed");
    record_.push_nms = push_nms;
    return absl::OkStatus();
  }

  absl::Status CheckPlace(Vec3d place) const {
    if (scene().bounds.Contains(place)) return absl::OkStatus();
    return Wrong(absl::StrCat("(", place.x, ", ", place.y, ", ", place.z, ") is outside the scene's bounds"));
  }

  absl::StatusOr<Quatd> RotationFrom(const tessera_game_value& value) const {
    const double* q = value.as.rotation;
    const Quatd given{q[0], q[1], q[2], q[3]};
    if (std::abs(Length(given) - 1) > kUnitTolerance) return Wrong("`rotation` is not of length 1");
    return Normalized(given);
  }

  // A field of the table of options, or nothing; `names` are all that there are.
  absl::Status ReadFields(std::size_t index, std::string_view table, std::span<const std::string_view> names,
                          std::span<const tessera_game_value*> found) const {
    if (!IsGiven(arguments_, index)) return absl::OkStatus();
    const std::span fields(arguments_[index].as.fields, arguments_[index].count);
    const absl::string_view shown_table(table.data(), table.size());
    for (const tessera_game_field& field : fields) {
      const std::string_view name(field.name, field.name_bytes);
      const auto known = std::ranges::find(names, name);
      const absl::string_view shown(name.data(), std::min<std::size_t>(name.size(), 63));
      if (known == names.end()) {
        std::string all;
        for (const std::string_view one : names) absl::StrAppend(&all, all.empty() ? "" : ", ", std::string(one));
        return Wrong(absl::StrCat("`", shown_table, ".", shown, "` is none of ", all));
      }
      found[static_cast<std::size_t>(known - names.begin())] = &field.value;
    }
    return absl::OkStatus();
  }

  // A vector among options, no longer than `most`.
  absl::Status ReadVector(const tessera_game_value& value, std::string_view name, double most, std::string_view unit,
                          std::optional<Vec3f>& out) const {
    const absl::string_view shown(name.data(), name.size());
    if (value.type != TESSERA_GAME_VECTOR) return Wrong(absl::StrCat("`", shown, "` must be a vector"));
    const Vec3d vector = VectorGiven(value);
    if (!IsFinite(vector)) return Wrong(absl::StrCat("`", shown, "` is not finite"));
    if (Length(vector) > most) {
      return Wrong(absl::StrCat("`", shown, "` is above ", most, " ", absl::string_view(unit.data(), unit.size())));
    }
    out = Vec3f(vector);
    return absl::OkStatus();
  }

  absl::Status Teleport() {
    GameTeleport to{VectorGiven(arguments_[0]), {}, {}, {}};
    if (absl::Status status = CheckPlace(to.position); !status.ok()) return status;
    if (IsGiven(arguments_, 1)) {
      const absl::StatusOr<Quatd> rotation = RotationFrom(arguments_[1]);
      if (!rotation.ok()) return rotation.status();
      to.rotation = *rotation;
    }
    static constexpr std::string_view kNames[] = {"velocity", "spin"};
    const tessera_game_value* given[2] = {};
    absl::Status status = ReadFields(2, "options", kNames, given);
    if (status.ok() && given[0] != nullptr) {
      status = ReadVector(*given[0], "options.velocity", kMaxGameSpeed_m_s, "m/s", to.velocity_m_s);
    }
    if (status.ok() && given[1] != nullptr) {
      status = ReadVector(*given[1], "options.spin", kMaxAngularSpeed_rad_s, "rad/s", to.spin_rad_s);
    }
    if (!status.ok()) return status;
    if (def_.kinematic && (to.velocity_m_s || to.spin_rad_s)) {
      return Wrong(absl::StrCat("body ", id_.value(), " is kinematic: it has no velocity of its own"));
    }
    if (BodyState* made = call_.transaction.MadeState(id_); made != nullptr) {
      made->position = to.position;
      if (to.rotation) made->orientation = *to.rotation;
      if (to.velocity_m_s) made->linear_velocity = *to.velocity_m_s;
      if (to.spin_rad_s) made->angular_velocity = *to.spin_rad_s;
      return absl::OkStatus();
    }
    if (call_.transaction.world().IsAnchored(id_)) {
      return Wrong(absl::StrCat("joints hold body ", id_.value(), " where it is"));
    }
    // The velocity that a push of the same tick was to give counts, unless this gives another one.
    if (to.velocity_m_s) record_.push_ns = {};
    if (to.spin_rad_s) record_.push_nms = {};
    record_.teleport = to;
    return absl::OkStatus();
  }

  absl::Status SetGravity() {
    const double factor = NumberGiven(arguments_[0]);
    const double most = kMaxTunedGravity;
    if (!(std::abs(factor) <= most))
      return Wrong(absl::StrCat("`factor` must be -", most, " to ", most, ", got ", factor));
    if (std::abs(factor) * Length(scene().gravity_m_s2) > kMaxAcceleration_m_s2) {
      return Wrong(absl::StrCat("`factor` times gravity is above ", kMaxAcceleration_m_s2, " m/s^2"));
    }
    Tune([&](BodyTuning& tuning) { tuning.gravity_scale = static_cast<float>(factor); });
    return absl::OkStatus();
  }

  absl::Status SetMaterial() {
    static constexpr std::string_view kNames[] = {"friction", "restitution"};
    static constexpr double kMost[] = {kMaxFriction, 1};
    const tessera_game_value* given[2] = {};
    if (absl::Status status = ReadFields(0, "material", kNames, given); !status.ok()) return status;
    std::optional<float> values[2];
    for (std::size_t i = 0; i < 2; ++i) {
      if (given[i] == nullptr) continue;
      const std::string name(kNames[i]);
      if (!IsNumber(*given[i])) {
        return Wrong(absl::StrCat("`material.", name, "` must be a number"));
      }
      const double value = NumberGiven(*given[i]);
      if (!(value >= 0 && value <= kMost[i])) {
        return Wrong(absl::StrCat("`material.", name, "` must be 0 to ", kMost[i], ", got ", value));
      }
      values[i] = static_cast<float>(value);
    }
    Tune([&](BodyTuning& tuning) {
      if (values[0]) tuning.friction = values[0];
      if (values[1]) tuning.restitution = values[1];
    });
    return absl::OkStatus();
  }

  // A change is felt at once, by a sleeper too.
  template <class Change>
  void Tune(Change change) {
    const BodyTuning before = record_.tuning;
    change(record_.tuning);
    if (record_.tuning != before && !def_.kinematic) record_.wakes = true;
  }

  absl::Status MoveTo() {
    const Vec3d position = VectorGiven(arguments_[0]);
    if (absl::Status status = CheckPlace(position); !status.ok()) return status;
    const std::int64_t ticks = arguments_[2].as.whole;
    if (absl::Status status = CheckTicks(ticks, kMaxMoveTicks); !status.ok()) return status;
    const BodyState now = call_.transaction.StateOf(id_);
    Quatd rotation = now.orientation;
    if (IsGiven(arguments_, 1)) {
      const absl::StatusOr<Quatd> given = RotationFrom(arguments_[1]);
      if (!given.ok()) return given.status();
      rotation = *given;
    }
    const double seconds = static_cast<double>(ticks) / scene().tick_rate_hz;
    const double speed = Length(position - now.position) / seconds;
    if (speed > kMaxPathSpeed_m_s) {
      return Wrong(absl::StrCat("it would have to move at ", speed, " m/s, at most ", kMaxPathSpeed_m_s));
    }
    record_.target = GameTarget{call_.tick + static_cast<std::uint64_t>(ticks), position, rotation};
    return absl::OkStatus();
  }

  tessera_game_call& call_;
  const Function& function_;
  const BodyId id_;
  const BodyDef& def_;
  GameRecord& record_;
  const CallArguments arguments_;
};

}  // namespace

bool IsMotionCall(std::uint32_t function) { return function >= kBodyPushFor && function <= kBodyMoveTo; }

absl::StatusOr<tessera_game_value> CallMotion(tessera_game_call& call, const Function& function, BodyId id,
                                              const BodyDef& def, Transaction::Changes& body,
                                              std::span<const tessera_game_value> arguments) {
  return MotionCall(call, function, id, def, body, arguments).Run();
}

}  // namespace tessera::game
